"""A turn on the spot ends at the yaw asked for, the short way, and moves nothing else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.limit_places import Infeasible
from planner.search.trajectory.motion import Motion
from planner.search.trajectory.turn_on_the_spot import turn_on_the_spot
from tests.benchmarks.peers.case import case_of
from tests.search.maps import terrain

PLACE = np.array([5.0, 5.0])


def case_with(obstacles=None):
    asked = {"start": {"x": 2, "y": 5}, "goal": {"x": 8, "y": 5}}
    shape = (100, 100)
    case = case_of("test", asked, terrain(np.zeros(shape), cell=0.1, obstacles=obstacles))
    return case.field, case.situation.conditions


@pytest.mark.parametrize(("start", "goal", "turn"), [(0.0, 1.5, 1.5), (3.0, -3.0, 6.0)])
def test_it_turns_the_short_way_within_the_yaw_rate(start, goal, turn) -> None:
    field, conditions = case_with()
    motion = turn_on_the_spot(field, conditions, PLACE, [start, goal])
    assert isinstance(motion, Motion)
    short = turn if turn < math.pi else 2.0 * math.pi - turn
    assert motion.yaw[0] == pytest.approx(start)
    assert motion.yaw[-1] - motion.yaw[0] == pytest.approx(short)
    assert not motion.speed.any()
    assert (motion.x == PLACE[0]).all()
    assert (motion.y == PLACE[1]).all()
    limit = conditions.model.vehicle.limits.yaw_rate
    assert (np.abs(np.diff(motion.yaw)) <= limit * np.diff(motion.time) * (1.0 + 1e-9)).all()


def test_between_walls_nobody_turns_round() -> None:
    obstacles = np.ones((100, 100), bool)
    obstacles[47:54] = False
    field, conditions = case_with(obstacles)
    found = turn_on_the_spot(field, conditions, PLACE, [0.0, math.pi / 2.0])
    assert isinstance(found, Infeasible)
    assert found.for_want_of_room
    assert (found.x, found.y) == (5.0, 5.0)
