"""Knots moved by what motions cost: parabolas, shares of a motion, straight lines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.trajectory.motion import read_along
from planner.search.waypoints import waypoint_descent as optimise_waypoints
from planner.terrain.heightmap import Terrain
from tests.search.maps import drawn, hills
from tests.search.situations import situation_on

FREE = (None, None)


@pytest.fixture(scope="module")
def level():
    """Level ground of 24 m by 24 m."""
    return situation_on(Terrain.from_arrays(np.zeros((96, 96)), cell=(0.25, 0.25)))


@pytest.fixture(scope="module")
def hilly():
    """Hills of 24 m by 24 m."""
    relief = hills(96, rms_degrees=7.0, seed=8)
    return situation_on(Terrain.from_arrays(relief, cell=(0.25, 0.25)))


def test_a_parabola_leads_to_where_it_is_least():
    rng = np.random.default_rng(5)
    least, bend = rng.uniform(-1.9, 1.9, 50), rng.uniform(0.1, 9.0, 50)
    values = [bend * (x - least) ** 2 + 3.0 for x in (-1.0, 0.0, 1.0)]
    np.testing.assert_allclose(optimise_waypoints.to_least(*values), least, atol=1e-9)


def test_a_waypoint_on_a_crest_goes_down_and_one_in_a_trough_between_walls_stays():
    low = np.array([1.0, 3.0, np.inf, np.inf, 2.0, np.inf])
    here = np.array([2.0, 4.0, 4.0, 4.0, 2.0, np.inf])
    high = np.array([2.5, 1.0, 3.0, 5.0, 2.0, np.inf])
    expected = [-1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    np.testing.assert_array_equal(optimise_waypoints.to_least(low, here, high), expected)


def test_what_is_spent_between_waypoints_adds_up_to_the_whole(hilly):
    situation, field = hilly
    knots = np.column_stack([np.linspace(3.0, 20.0, 9), 12.0 + np.sin(np.arange(9))])
    way = optimise_waypoints.drive_roughly(field, situation.conditions, (knots,), FREE)
    odd = np.arange(9) % 2 == 1
    spent = optimise_waypoints.spent_beside(way, knots, odd)
    assert len(spent) == 4
    assert spent.sum() == pytest.approx(way.dissipated, rel=1e-12)
    assert (spent > 0.0).all()


def test_what_is_spent_up_to_a_place_is_read_where_the_motion_is_nearest():
    # Out and back along the same line, a joule for each metre.
    x = np.concatenate([np.arange(0.0, 10.5, 0.5), np.arange(9.5, -0.5, -0.5)])
    spent = 0.5 * np.arange(len(x))
    places = np.array([[0.0, 0.0], [4.2, 0.1], [10.0, 0.0], [4.2, -0.1], [0.0, 0.0]])
    along = np.array([0.0, 4.2, 10.0, 15.8, 20.0])
    found = read_along(x, np.zeros(len(x)), spent, places, along)
    np.testing.assert_allclose(found, along, atol=1e-9)


def test_of_moves_only_those_stay_that_pay_where_they_are(level):
    """One waypoint comes back to a straight line, another leaves it, and a third may not move."""
    situation, field = level
    before = np.column_stack([np.linspace(2.0, 22.0, 9), np.full(9, 12.0)])
    before[[2, 7], 1] += 0.6
    places = before.copy()
    places[[2, 7], 1] -= 0.6
    places[5, 1] += 0.4
    free = np.arange(9) != 7
    moved, best = (
        optimise_waypoints.drive_roughly(field, situation.conditions, (knots,), FREE)
        for knots in (places, before)
    )
    kept = optimise_waypoints.paying(moved, places, best, before, free)
    expected = before.copy()
    expected[2] = places[2]
    np.testing.assert_array_equal(kept, expected)
    better = optimise_waypoints.drive_roughly(field, situation.conditions, (kept,), FREE)
    assert better.energy < best.energy


def test_on_level_ground_a_bent_path_becomes_straight(level):
    situation, field = level
    ends = np.array([[3.0, 3.0], [20.0, 14.0]])
    straight = optimise_waypoints.drive_roughly(field, situation.conditions, (ends,), FREE)
    share = np.linspace(0.0, 1.0, 5)[:, None]
    across = np.array([-11.0, 17.0]) / math.hypot(11.0, 17.0)
    crooked = ends[0] + share * (ends[1] - ends[0])
    crooked[1:-1] += np.array([0.5, -0.6, 0.4])[:, None] * across
    before = optimise_waypoints.drive_roughly(field, situation.conditions, (crooked,), FREE)
    after = optimise_waypoints.optimise_waypoints(
        field, situation.conditions, [crooked], FREE, steps=(1.0, 0.5, 0.5, 0.25)
    )
    assert before.energy > 1.01 * straight.energy
    assert after.energy < straight.energy + 0.1 * (before.energy - straight.energy)
    [way] = after.legs
    assert np.abs((way - ends[0]) @ across).max() < 0.2


def test_ends_and_places_to_pass_stay_where_they_are(hilly):
    situation, field = hilly
    # Both legs bulge, so that there is something to gain.
    legs = [
        np.array([[3.0, 3.0], [4.8, 9.2], [9.0, 14.0]]),
        np.array([[9.0, 14.0], [15.4, 11.4], [20.0, 6.0]]),
    ]
    given = optimise_waypoints.drive_roughly(
        field, situation.conditions, tuple(legs), (None, None, None)
    )
    found = optimise_waypoints.optimise_waypoints(
        field, situation.conditions, legs, (None, None, None)
    )
    assert found.energy < given.energy
    for before, after in zip(legs, found.legs, strict=True):
        np.testing.assert_array_equal(after[[0, -1]], before[[0, -1]])


def test_no_waypoint_moves_to_where_nobody_can_drive():
    picture = "\n".join(
        "." * 40 if j < 12 or j > 14 else "." * 12 + "#" * 16 + "." * 12 for j in range(24)
    )
    situation, field = situation_on(drawn(picture, cell=0.25))
    knots = np.column_stack([np.linspace(1.5, 8.5, 5), np.full(5, 4.0)])
    shifts = np.zeros((5, 2))
    shifts[1:-1, 1] = -1.2
    moved = optimise_waypoints.where_open(field, knots, shifts)
    found = optimise_waypoints.drive_roughly(field, situation.conditions, (moved,), FREE)
    assert found.motion is not None
    np.testing.assert_array_equal(moved[2], knots[2])
    free = optimise_waypoints.where_open(field, knots, -0.1 * shifts)
    np.testing.assert_allclose(free, knots - 0.1 * shifts)


def test_no_waypoint_is_optimised_once_the_caller_wants_to_stop(hilly):
    situation, field = hilly

    def stop() -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        optimise_waypoints.optimise_waypoints(
            field, situation.conditions, [np.array([[3.0, 3.0], [20.0, 6.0]])], FREE, check=stop
        )


def steps_while(saved: list[float]) -> list[float]:
    """Steps where rounds save so many J, one after the other, of 100 J that are dissipated."""
    spent = np.array([0.0, 100.0])
    energy, steps = 100.0, []

    def best():
        return optimise_waypoints.Driven((), energy=energy, spent=spent)

    for step in optimise_waypoints.while_it_pays(best):
        energy -= saved[len(steps)]
        steps.append(step)
    return steps


def test_steps_stay_while_they_pay_and_halve_then():
    """A round that saves a tenth of a per cent does not pay."""
    assert steps_while([1.0, 0.1, 0.1, 0.1, 5.0]) == [1.0, 1.0, 0.5, 0.25]
    assert steps_while([0.1, 1.0, 0.1, 0.1, 5.0]) == [1.0, 0.5, 0.5, 0.25]


def test_steps_end_however_much_they_save():
    assert 5 <= len(steps_while([5.0] * 30)) < 20
