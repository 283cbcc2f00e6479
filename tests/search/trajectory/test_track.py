"""Stations of a track: they keep to the legs, and the ground between them is looked at."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.field import CostField, polyline_cost
from planner.search.trajectory.track import (
    lay_track,
    led_past,
    slopes_of_steps,
    turns_of,
    widest_arcs,
)
from tests.benchmarks.peers.case import case_of
from tests.search.maps import terrain

LAID = {"spacing": 0.25, "speed": 1.2, "acceleration": 1.0}


def level():
    """Level ground of 15 m by 15 m."""
    asked = {"start": {"x": 2, "y": 5}, "goal": {"x": 8, "y": 5}}
    return case_of("test", asked, terrain(np.zeros((60, 60)))).field


def test_straight_legs_keep_their_lengths_and_fixed_points() -> None:
    fixed = np.array([[2.0, 3.0], [6.0, 6.0], [10.0, 9.0], [13.0, 5.0]])
    legs = [fixed[k : k + 2] for k in range(3)]
    track = lay_track(level(), legs, **LAID)
    np.testing.assert_allclose(track.points[list(track.marks)], fixed)
    assert track.lengths.sum() == pytest.approx(15.0)
    assert 0.0 < track.lengths.max() <= LAID["spacing"] + 1e-9
    assert not track.curvatures.any()
    # It stands at both ends and where the travel turns at once, not where it goes straight on.
    assert track.stops[list(track.marks)].tolist() == [True, False, True, True]
    assert track.stops.sum() == 3


def test_legs_meet_in_line_at_the_place_between_them():
    """Their ends and the place between stay, and so do legs at more than 70° to each other."""
    place = np.array([8.0, 7.5])
    come = np.array([[4.0, 7.5], place])
    for turn, pieces in ((0.6, 2), (-0.6, 2), (1.4, 1)):
        go = np.array([place, place + 4.0 * np.array([math.cos(turn), math.sin(turn)])])
        before, after = led_past(level(), [come, go], 1.44)
        np.testing.assert_array_equal(before[[0, -1]], come)
        np.testing.assert_array_equal(after[[0, -1]], go)
        assert len(before) == len(after) == pieces + 1
        if pieces > 1:
            np.testing.assert_allclose(place - before[1], after[1] - place, atol=1e-12)


def test_a_corner_becomes_an_arc_within_the_corner() -> None:
    """A quarter turn to the left: shorter than the polyline, longer than the chord, no stop."""
    corner = np.array([[2.0, 3.0], [8.0, 3.0], [8.0, 9.0]])
    track = lay_track(level(), [corner], **LAID)
    np.testing.assert_allclose(track.points[[0, -1]], corner[[0, -1]])
    assert math.hypot(6.0, 6.0) < track.lengths.sum() < 12.0
    assert track.stops.sum() == 2
    assert (track.curvatures >= 0.0).all()
    # What the arc turns by is the corner's angle.
    assert (track.curvatures * track.lengths).sum() == pytest.approx(math.pi / 2.0, rel=0.01)
    assert (track.points[:, 0] <= 8.0 + 1e-9).all()
    assert (track.points[:, 1] >= 3.0 - 1e-9).all()


def test_corners_share_a_piece_so_that_the_tighter_arc_is_widest() -> None:
    """Arcs side by side meet within the piece, and neither could be wider without the other."""
    off = 0.5
    for first, second in ((30.0, 60.0), (8.0, 80.0), (-40.0, 40.0), (90.0, 20.0)):
        for between in (0.2, 0.6, 2.0):
            turns = np.radians([0.0, first, first + second])
            leg = np.array([[0.0, 0.0], *np.column_stack([np.cos(turns), np.sin(turns)])])
            leg[1:] *= np.array([5.0, between, 5.0])[:, None]
            leg = np.cumsum(leg, axis=0)
            np.testing.assert_allclose(turns_of(leg)[1:3], np.radians([first, second]))
            a, b = widest_arcs(leg, turns_of(leg), off)[1:3]
            half = np.abs(np.radians([first, second])) / 2.0
            wanted = off / (1.0 / np.cos(half) - 1.0)
            taken = np.array([a, b]) * np.tan(half)
            assert taken.sum() <= between * (1.0 + 1e-9)
            assert (np.array([a, b]) <= wanted * (1.0 + 1e-9)).all()
            if taken.sum() < 0.9 * between:
                np.testing.assert_allclose([a, b], np.minimum(wanted, 5.0), rtol=0.05)
            elif not np.isclose(a, b):
                # The tighter one is as wide as it may be at all; the other one has the rest.
                tighter = int(b < a)
                assert [a, b][tighter] == pytest.approx(wanted[tighter])


def test_an_arc_beside_something_solid_is_nearly_as_wide_as_it_may_be() -> None:
    """With a block in a gentle corner, an arc wider by a quarter would run into it."""
    turn, at = math.radians(30.0), np.array([8.0, 5.0])
    ahead = np.array([math.cos(turn), math.sin(turn)])
    corner = np.array([[2.0, 5.0], at, at + 6.0 * ahead])
    asked = {"start": {"x": 2, "y": 5}, "goal": {"x": 8, "y": 2}}
    # With nothing in the way it is 15 cm off the corner, as the cells are small.
    widest = 0.15 / (1.0 / math.cos(0.5 * turn) - 1.0)
    radii = []
    for east in (0, 30, 31, 32):
        blocked = np.zeros((60, 60), bool)
        blocked[22:26, 24:east] = True
        field = case_of("test", asked, terrain(np.zeros((60, 60)), obstacles=blocked)).field
        radius = 1.0 / lay_track(field, [corner], **LAID).curvatures.max()

        def free(radius: float, field: CostField = field) -> bool:
            angle = np.linspace(0.0, turn, 60)[:, None]
            begun = at - np.array([radius * math.tan(0.5 * turn), 0.0])
            arc = begun + radius * np.hstack([np.sin(angle), 1.0 - np.cos(angle)])
            return math.isfinite(polyline_cost(field, arc, field.step))

        assert free(radius)
        assert radius == pytest.approx(widest) or not free(1.25 * radius)
        radii.append(radius)
    assert radii[0] == pytest.approx(widest)
    assert min(radii) < 0.6 * widest


def test_on_a_plane_the_steepest_slope_is_that_of_the_middle() -> None:
    rise = math.tan(math.radians(12.0))
    plane = 0.25 * rise * np.tile(np.arange(40.0), (40, 1))
    field = case_of("test", {"start": {"x": 2, "y": 5}, "goal": {"x": 8, "y": 5}}, terrain(plane))
    slopes = slopes_of_steps(field.field, np.array([[2.0, 5.0], [2.4, 5.1], [3.0, 5.0]]))
    assert slopes[:, 0::2] == pytest.approx(rise, rel=1e-6)
    assert slopes[:, 1::2] == pytest.approx(0.0, abs=1e-9)


def test_the_steepest_slope_of_a_step_is_none_of_its_middle_on_a_bump() -> None:
    """Two steep flanks with a flat crest between them."""
    x = 0.25 * np.arange(60)
    bump = np.clip(0.3 * (1.5 - np.abs(x - 7.0)), 0.0, 0.36)
    bumpy = terrain(np.tile(bump, (60, 1)))
    asked = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 2.0, "y": 8.0}}
    case = case_of("test", asked, bumpy)
    slopes = slopes_of_steps(case.field, np.array([[5.75, 7.0], [8.25, 7.0]]))
    assert abs(slopes[0, 0]) < 0.02
    assert abs(slopes[0, 2]) > 0.25
    # Up early, down late.
    assert slopes[0, 6] > 0.25
    assert slopes[0, 4] < -0.25
