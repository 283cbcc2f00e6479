"""The table of the least steady cost against the model itself, at slopes between its nodes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from planner.power.limits import broken_in_results
from planner.power.motion_row import set_motion
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.certificate.steady_floor import YAW_RESERVE, SteadyFloor, steady_floor
from planner.search.conditions import OperatingConditions
from tests.search.certificate.robots import around_of, model_of

SPEED = [INDEX["vx"], INDEX["vy"]]


def looked_up(floor: SteadyFloor, along: float, across: float) -> float:
    """J per horizontal metre, bilinear."""
    u, v = (along + floor.steepest) / floor.step, (across + floor.steepest) / floor.step
    i, j = int(u), int(v)
    corners = floor.least[0, i : i + 2, j : j + 2]
    return float([1.0 - u + i, u - i] @ corners @ [1.0 - v + j, v - j])


def driven(
    conditions: OperatingConditions, along: float, across: float, yaws: NDArray[np.float64]
) -> float:
    """J per horizontal metre by the model itself: the least over these yaws and 20 speeds."""
    rows = np.repeat(conditions.class_rows[:1], len(yaws), axis=0)
    for row, yaw in zip(rows, yaws, strict=True):
        stretch = set_motion(row, along, across, yaw, 0.0, 1.0)
    least = math.inf
    for speed in float(conditions.limits[0]) * np.arange(1, 21) / 20:
        fast = rows.copy()
        fast[:, SPEED] *= speed
        found = conditions.model.power_and_limits(fast)
        kept = [broken_in_results(one, conditions.limits) < 0 for one in found]
        costs = found[kept, 0] * stretch / speed
        least = min([least, *(costs - conditions.mass * STANDARD_GRAVITY * along)])
    return least


@pytest.mark.parametrize(
    ("name", "payload"),
    [
        ("minibalance", 0.0),
        ("minibalance", 8.0),
        ("robotino", 0.0),
        ("four omni wheels", 0.0),
        ("steep rollers", 0.0),
        ("giving rollers", 8.0),
    ],
)
def test_no_steady_drive_undercuts_the_table(name: str, payload: float) -> None:
    """Random slopes; yaws of any angle, many of them near where wheels or rollers stand."""
    conditions = around_of(model_of(name), payload)
    floor = steady_floor(conditions)
    assert floor is not None
    rng = np.random.default_rng(5)
    short = []
    for _ in range(25):
        slope, azimuth = floor.steepest * math.sqrt(rng.random()), rng.uniform(-math.pi, math.pi)
        along, across = slope * math.cos(azimuth), slope * math.sin(azimuth)
        near = rng.integers(0, 24, 300) * math.pi / 12 + rng.normal(0.0, 0.02, 300)
        yaws = np.concatenate([rng.uniform(-math.pi, math.pi, 200), near])
        least = driven(conditions, along, across, yaws)
        if least < math.inf:
            low = looked_up(floor, along, across)
            assert low <= least
            if slope < 0.2:
                short.append(1.0 - low / least)
    # The reserves cost half of one per cent where robots drive.
    assert not short or np.median(short) < 0.02


def test_level_ground_loses_little_but_the_stated_reserve() -> None:
    """Where the best yaw is a node, only the bend beside it is taken off as well."""
    conditions = around_of(model_of("minibalance"))
    floor = steady_floor(conditions)
    assert floor is not None
    least = driven(conditions, 0.0, 0.0, np.zeros(1))
    assert 0.98 * least < looked_up(floor, 0.0, 0.0) <= (1.0 - YAW_RESERVE) * least
