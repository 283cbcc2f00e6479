"""An effect that is added is fitted with all that it has, and its errors say how sure that is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.candidates import candidate_library
from planner.telemetry.extend import Addition, completed, fit_with
from planner.telemetry.fit import fit
from planner.telemetry.interval import interval_nodes
from planner.telemetry.sensitivity import RUN_ERRORS, mean_watts, predict, run_errors
from planner.telemetry.shapes import levels, shapes_of
from tests.power.states import changed
from tests.telemetry.rows import measured


def robot_with(base, slug, **values):
    model = PowerModel.from_vehicle(base.vehicle, effects=(slug,))
    return changed(model, **{f"{slug}__{name}": value for name, value in values.items()})


def with_wheels(base, excess):
    model = PowerModel.from_vehicle(base.vehicle, effects=("wheel_imbalance",))
    values = model.parameters.copy()
    values[[k for k, s in enumerate(model.slots) if s[0].slug == "wheel_imbalance"]] = excess
    return replace(model, parameters=values)


def found(fitted, slug):
    """(name, element) → parameter."""
    return {(p.name, p.element): p for p in fitted.parameters if p.effect == slug}


@pytest.fixture(scope="module")
def library(motion, base):
    """Columns of the catalogue on the varied drive."""
    return candidate_library(base, motion)


# The third wheel drags a tenth of the mean; against the fourth alone that is beyond any bound.
UNEVEN = np.array([0.35, 0.15, -0.9, 0.4])


@pytest.mark.parametrize("common", [0.0, 0.7])
def test_wheels_differ_from_their_mean(motion, base, common):
    log = measured(motion, with_wheels(base, UNEVEN + common), 0.01, seed=3)
    some = Addition("wheel_imbalance", {("excess", 0): 0.1})
    excess = found(fit_with(base, log, [some]), "wheel_imbalance")
    assert len(excess) == 4
    assert sum(p.value for p in excess.values()) == pytest.approx(0.0, abs=1e-3)
    for wheel in range(4):
        parameter = excess["excess", wheel]
        assert abs(parameter.value - UNEVEN[wheel]) < 4.0 * parameter.stderr
        assert parameter.stderr < 0.1


def test_a_shape_need_not_stand_on_its_grid(motion, base, library):
    log = measured(motion, robot_with(base, "stiction", strength=1.5, stiction_speed=0.04), 0.01, 5)
    on_grid = Addition("stiction", {("strength", 0): 1.0}, {"stiction_speed": 0.02})
    alone = found(fit_with(base, log, [on_grid]), "stiction")
    freed = found(fit_with(base, log, completed([on_grid], library)), "stiction")
    assert set(alone) == {("strength", 0)}
    for name, value in (("strength", 1.5), ("stiction_speed", 0.04)):
        assert abs(freed[name, 0].value - value) < 4.0 * freed[name, 0].stderr
    # Beside a shape that is wrong a strength is surer than it is right.
    off = alone["strength", 0]
    assert abs(off.value - 1.5) > 4.0 * off.stderr


def test_an_effect_acts_with_all_its_parameters(motion, base, library):
    heating = {"copper_coefficient": 0.0039, "magnet_coefficient": -0.0016}
    log = measured(motion, robot_with(base, "motor_heating", **heating), 0.01, seed=7)
    part = Addition("motor_heating", {("magnet_coefficient", 0): -0.003})
    alone = found(fit_with(base, log, [part]), "motor_heating")["magnet_coefficient", 0]
    assert abs(alone.value + 0.0016) > 4.0 * alone.stderr
    full = found(fit_with(base, log, completed([part], library)), "motor_heating")
    for name, value in heating.items():
        assert abs(full[name, 0].value - value) < 3.0 * full[name, 0].stderr


def test_what_is_weighed_once_a_run_makes_less_sure(motion, base):
    log = measured(motion, base, 0.002, seed=9)
    assert {"payload", "com_x"} <= log.present
    sure = fit(replace(log, present=log.present - set(RUN_ERRORS)), base)
    unsure = fit(log, base)
    np.testing.assert_array_equal(sure.model.parameters, unsure.model.parameters)
    more = np.diag(unsure.covariance) - np.diag(sure.covariance)
    assert np.all(more >= 0.0)
    rolling = next(k for k, p in enumerate(sure.parameters) if p.name == "rolling")
    assert more[rolling] > 0.0


def test_an_error_of_the_load_is_that_much_more_load(motion, base):
    rows = motion.rows_for(base.surfaces)
    nodes = interval_nodes(rows, motion.interval, base)
    column = run_errors(base, nodes, mean_watts(base, nodes), {"payload", "ambient_temp"})
    assert column.shape == (len(motion), 1)  # nothing in the base model reads the air's temperature
    heavier = motion.rows.copy()
    heavier[:, INDEX["payload"]] += RUN_ERRORS["payload"]
    change = predict(base, replace(motion, rows=heavier)) - predict(base, motion)
    assert column[:, 0] == pytest.approx(change, abs=1e-12)


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
    axes = {shape.axis for shape in shapes_of(replace(motion, rows=rows)).shapes}
    assert "speed" in {shape.axis for shape in shapes_of(motion).shapes}
    assert "speed" not in axes
    assert "heading" in axes
