"""A turn on the spot ends at the yaw asked for, the short way, and moves nothing else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.limit_places import Infeasible
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.trajectory.limit_use import limits_used
from planner.search.trajectory.motion import Motion
from planner.search.trajectory.turn_on_the_spot import turn_on_the_spot
from tests.benchmarks.peers.case import case_of
from tests.search.maps import terrain

PLACE = np.array([5.0, 5.0])


def case_with(obstacles=None, slope=0.0, mass=0.0):
    asked = {"start": {"x": 2, "y": 5}, "goal": {"x": 8, "y": 5}}
    asked["payload"] = {"mass": mass}
    heights = np.tile(slope * 0.1 * np.arange(100.0), (100, 1))
    case = case_of("test", asked, terrain(heights, cell=0.1, obstacles=obstacles))
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


def test_a_turn_that_is_driven_keeps_the_limits_while_its_rate_ramps_up() -> None:
    """Steeper and steeper: as long as it turns, no limit is above 1; then the limit is named."""
    stated = []
    for slope in np.linspace(0.05, 0.25, 41):
        field, conditions = case_with(slope=slope, mass=28.0)
        found = turn_on_the_spot(field, conditions, PLACE, [0.0, math.pi / 2.0])
        if isinstance(found, Infeasible):
            assert found.limit == "torque peak"
            assert found.value > found.allowed
            break
        stated.append(max(use.share for use in limits_used(field, conditions, found)))
    assert 0.9 < max(stated) <= 1.0
    assert len(stated) < 41


def test_a_motion_with_a_turn_on_the_spot_that_breaks_a_limit_is_found_out() -> None:
    """No speed helps there: the yaw has to be another one."""
    field, conditions = case_with()
    motion = turn_on_the_spot(field, conditions, PLACE, [0.0, math.pi / 2.0])
    assert isinstance(motion, Motion)
    assert not broken_limits(field, conditions, motion, finely=True)
    steep, loaded = case_with(slope=0.3, mass=28.0)
    broken = broken_limits(steep, loaded, motion, finely=True)
    assert broken
    assert broken.however_slow.all()
