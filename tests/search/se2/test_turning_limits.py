"""Slopes on which the body turns while it drives: by the power model itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.power.limits import broken_in_results
from planner.power.motion_row import set_motion
from planner.quantities import INDEX
from planner.search.requests import SituationRequest
from planner.search.resolution import DIRECTIONS, SLOPE_SPEED, STATES, WIDTH
from planner.search.se2.turning_limits import turning_limits
from planner.search.situation import situation_of
from tests.search.maps import terrain

CURVATURE = 0.4


@pytest.fixture(scope="module")
def situation():
    """A robot with so heavy a load that the torque limits it."""
    ground = terrain(np.zeros((20, 20)))
    asked = SituationRequest.from_json({"map": ground.name, "payload": {"mass": 28.0}})
    return situation_of(asked, terrain=ground)


@pytest.fixture(scope="module")
def tables(situation):
    """Slope limits straight on, and while the body turns."""
    straight = situation.field("energy").yaw_limit
    [turning] = turning_limits(situation.conditions, np.array([CURVATURE]), float(straight.max()))
    return straight[0], turning[0]


def broken(conditions, slope: float, azimuth: float, yaw: float) -> bool:
    """Whether turning to either side breaks a limit, by the model."""
    speed = SLOPE_SPEED * float(conditions.limits[0])
    rows = np.repeat(conditions.class_rows, 2, axis=0)
    for row, side in zip(rows, (1, -1), strict=True):
        set_motion(row, slope * math.cos(azimuth), slope * math.sin(azimuth), yaw, 0.0, speed)
        row[INDEX["wz"]] = side * CURVATURE * speed
    results = conditions.model.power_and_limits(rows)
    return any(broken_in_results(one, conditions.limits) >= 0 for one in results)


def test_limits_hold_below_and_break_above(situation, tables):
    _, turning = tables
    for state, direction in np.random.default_rng(2).integers(0, (STATES, DIRECTIONS), (40, 2)):
        azimuth = 2.0 * math.pi * direction / DIRECTIONS
        limit = float(turning[state, direction])
        at = azimuth, state * WIDTH
        assert not broken(situation.conditions, 0.995 * limit, *at)
        assert broken(situation.conditions, 1.01 * limit, *at)


def test_a_turn_takes_torque_where_rollers_would_stand_and_hardly_any_where_they_roll(tables):
    """Straight up they stand. Across the slope they roll, whether the body turns or not."""
    straight, turning = tables
    assert turning[0, 0] < 0.95 * straight[0, 0]
    across = DIRECTIONS // 12  # 30° from straight up
    best = int(straight[:, across].argmax())
    assert turning[best, across] == pytest.approx(straight[best, across], rel=0.02)
    beside = min(straight[best - 1, across], straight[best + 1, across])
    assert turning[best, across] > 1.02 * beside, "the angles beside it say as much"
