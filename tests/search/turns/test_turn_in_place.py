"""Turning on the spot: the same cost both ways, none where a limit breaks, the cheapest round."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.power.motion_row import set_motion
from planner.quantities import INDEX
from planner.search.requests import SituationRequest
from planner.search.resolution import STATES, WIDTH
from planner.search.situation import situation_of
from planner.search.turns.turn_in_place import SPUN, spin_costs, spin_round
from tests.search.maps import terrain


@pytest.fixture(scope="module")
def conditions():
    ground = terrain(np.zeros((20, 20)))
    return situation_of(SituationRequest(map=ground.name), terrain=ground).conditions


def costs_of(conditions, slopes, objective=0, gentle=math.inf):
    """Cost per rad (slopes, STATES) for travel along x on slopes (n, 2)."""
    slopes = np.hstack([slopes, slopes]).astype(float)
    count = len(slopes)
    spin = np.empty((count, STATES))
    ground = np.zeros(count, np.int64)
    kernel = conditions.model.limits_kernel
    spin_costs(kernel, conditions.arrays, np.zeros(count), slopes, ground, objective, gentle, spin)
    return spin


def test_a_mirrored_robot_turns_the_other_way_for_the_same(conditions) -> None:
    """Yaw, slope across and yaw rate change sign together: the power model asked row by row."""
    rate = conditions.model.vehicle.limits.yaw_rate
    along, across = 0.06, 0.1
    priced = np.arange(0, STATES, SPUN)
    rows = np.repeat(conditions.class_rows[:1], len(priced), axis=0)
    for row, state in zip(rows, priced, strict=True):
        set_motion(row, along, -across, -state * WIDTH, 0.0, 0.0)
    rows[:, INDEX["wz"]] = -rate
    spin = costs_of(conditions, np.array([[along, across], [0.0, 0.0]]))
    np.testing.assert_allclose(spin[0, priced], conditions.model.watts(rows) / rate, rtol=1e-9)
    assert np.ptp(spin[0]) > 1e-3 * spin[0].mean(), "nothing is tested"
    # On the level no yaw is another.
    np.testing.assert_allclose(spin[1], spin[1, 0], rtol=1e-9)


def test_a_rad_takes_the_time_that_the_yaw_rate_says(conditions) -> None:
    spin = costs_of(conditions, np.zeros((1, 2)), objective=1)
    np.testing.assert_allclose(spin, 1.0 / conditions.model.vehicle.limits.yaw_rate)


def test_nobody_turns_where_a_limit_breaks(conditions) -> None:
    """On a slope that tips the robot over."""
    assert np.isinf(costs_of(conditions, np.array([[3.0, 0.0]]))[0, ::SPUN]).all()


def test_the_cheapest_path_round_is_that_of_all_paths() -> None:
    """Against a look at every pair of angles, both ways round."""
    random = np.random.default_rng(6)
    driven, spin_cost = random.uniform(0.0, 40.0, STATES), random.uniform(1.0, 5.0, STATES)
    free = random.random(STATES) > 0.1
    driven[~free] = np.inf
    halt = 2.0
    cost, spun = np.empty(STATES), np.empty(STATES, np.int64)
    spin_round(driven, free, spin_cost, halt, cost, spun)
    improved = 0
    for goal in np.flatnonzero(free):
        least = driven[goal]
        for start in np.flatnonzero(free):
            for way in (1, -1):
                at, total = start, driven[start] + halt
                for _ in range(STATES // 2 - 1):
                    after = (at + way) % STATES
                    if not free[after]:
                        break
                    total += 0.5 * (spin_cost[at] + spin_cost[after]) * WIDTH
                    at = after
                    if at == goal:
                        least = min(least, total)
        assert cost[goal] == pytest.approx(least)
        improved += spun[goal] != goal
        assert math.isfinite(driven[spun[goal]])
    assert improved > 5


def test_on_steep_ground_a_turn_holds_while_it_speeds_up(conditions) -> None:
    """Just below the slope at which an even turn breaks a limit, the ramp breaks it."""
    slopes = np.column_stack([np.linspace(0.2, 0.7, 200), np.zeros(200)])
    even, ramped = (np.isinf(costs_of(conditions, slopes, gentle=one)) for one in (math.inf, 0.0))
    assert (ramped[even]).all()
    assert even.sum() < ramped.sum()
