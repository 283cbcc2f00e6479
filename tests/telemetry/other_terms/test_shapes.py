"""Which axes of a log get shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.other_terms.shapes import Dictionary, levels


def test_values_at_three_places_are_three_levels():
    random = np.random.default_rng(1)
    places = random.choice([0.08, 0.17, 0.27], 3000) + 0.003 * random.standard_normal(3000)
    assert levels(places) == 3
    assert levels(random.uniform(0.0, 0.3, 3000)) == np.inf
    # A heap and a tail is no set of levels.
    assert levels(np.concatenate([places, random.uniform(0.05, 0.3, 3000)])) == np.inf


def test_no_curve_over_a_quantity_with_three_levels(motion):
    rows = motion.rows.copy()
    speed = np.hypot(rows[:, INDEX["vx"]], rows[:, INDEX["vy"]])
    level = np.random.default_rng(2).choice([0.1, 0.3, 0.6], len(motion))
    for name in ("vx", "vy"):
        rows[:, INDEX[name]] *= level / np.maximum(speed, 1e-9)
    axes = {shape.axis for shape in Dictionary.of(replace(motion, rows=rows)).shapes}
    assert "speed" in {shape.axis for shape in Dictionary.of(motion).shapes}
    assert "speed" not in axes
    assert "heading" in axes


def test_no_shape_over_a_tilt_that_is_noise(motion):
    """On flat ground; where the ground is as steep as that, the slope has shapes."""
    random = np.random.default_rng(3)
    axes = []
    for smooth in (1, 40):
        rows = motion.rows.copy()
        for name in ("gravity_x", "gravity_y"):
            white = random.standard_normal(len(motion) + smooth - 1)
            tilt = 0.0035 * np.sqrt(smooth) * np.convolve(white, np.ones(smooth) / smooth, "valid")
            rows[:, INDEX[name]] = STANDARD_GRAVITY * tilt
        found = Dictionary.of(replace(motion, rows=rows)).shapes
        axes.append({shape.axis for shape in found if "slope" in shape.axis})
    assert axes == [set(), {"slope_along", "slope_across"}]


def test_gradual_shapes_do_not_change_at_once(motion):
    """A filter of the meter shows where the power jumps: such shapes would stand in for it."""
    dictionary = Dictionary.of(motion)
    top = dictionary.ranges["speed"][1]
    rows = np.tile(motion.rows[:1], (2000, 1))
    for name in ("vx", "vy"):
        rows[:, INDEX[name]] = np.linspace(0.0, top / np.sqrt(2.0), 2000)

    def steepest(shapes) -> float:
        over_speed = shapes.only(s for s in shapes.shapes if s.axis == "speed")
        columns = over_speed.columns(rows)
        return float((np.abs(np.diff(columns, axis=0)) / np.ptp(columns, axis=0)).max())

    assert steepest(dictionary.gradual) < 0.01
    assert steepest(dictionary) > 0.015


def test_two_loads_tell_straight_lines(motion):
    """And no threshold, which may lie anywhere between; one load tells nothing."""

    def over_load(loads):
        rows = motion.rows.copy()
        rows[:, INDEX["payload"]] = np.array(loads)[motion.run % len(loads)]
        shapes = Dictionary.of(replace(motion, rows=rows)).shapes
        return {(shape.kind, shape.at) for shape in shapes if shape.axis == "load"}

    assert over_load([0.0]) == set()
    assert over_load([0.0, 3.0]) == {("power", 1.0)}
    assert ("step", 0.6) in {(kind, round(at, 3)) for kind, at in over_load([0.0, 1.0, 3.0])}
