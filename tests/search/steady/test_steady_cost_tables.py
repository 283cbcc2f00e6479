"""Leaning downhill on a side slope, where the drag of creeping rollers holds the robot."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import plan_route
from planner.search.resolution import DIRECTIONS, STEEPNESSES, YAWS
from planner.search.steady.steady_cost_tables import steady_costs
from tests.power.reference import Robot, State, evaluate, gravity_on
from tests.search.certificate.robots import around_of, model_of
from tests.search.integrator import energy
from tests.search.maps import terrain

ROBOT = Robot()
AHEAD = 0


@pytest.fixture(scope="module")
def steady():
    """Tables of the paper's robot."""
    conditions = around_of(model_of("minibalance"))
    return steady_costs(conditions.model, conditions.class_rows), float(conditions.limits[0])


def joules_per_metre(across: float, yaw: float, speed: float) -> float:
    """Of a body turned by ``yaw`` off a travel with a slope across it, by the second model."""
    # Its left side is uphill; the way is level.
    state = State(
        velocity=(speed * math.cos(yaw), -speed * math.sin(yaw), 0.0),
        gravity=gravity_on(0.0, across, yaw),
        acceleration=(0.0, 0.0, 0.0),
    )
    return float(evaluate(ROBOT, state).supply) / speed


@pytest.mark.parametrize("azimuth", [DIRECTIONS // 4, 3 * DIRECTIONS // 4])
def test_a_contour_is_driven_with_the_body_turned_a_little_downhill(steady, azimuth):
    """The second model, whose signs are sharp, agrees on what leaning saves, and to which side."""
    costs, speed = steady
    side = 1.0 if azimuth < DIRECTIONS // 2 else -1.0
    limit = costs.yaw_limit[0, AHEAD, azimuth] * (1.0 - 1e-3)
    seen = 0
    for level in range(1, STEEPNESSES):
        across = side * limit * level / (STEEPNESSES - 1)
        if not 0.07 < abs(across) < 0.16:
            continue
        crab_angle = float(costs.crab_angle[0, AHEAD, azimuth, level])
        assert 0.0 < side * crab_angle < math.radians(2.0)
        leaning = joules_per_metre(across, crab_angle, speed)
        assert leaning < 0.95 * joules_per_metre(across, 0.0, speed)
        assert leaning < 0.85 * joules_per_metre(across, -crab_angle, speed)
        assert costs.by_yaw[0, AHEAD, azimuth, level] == pytest.approx(leaning, rel=0.02)
        seen += 1
    assert seen >= 3


def test_no_crab_angle_on_the_level_or_straight_up(steady):
    """Where no force is across the travel there is nothing to hold."""
    costs, _ = steady
    assert not costs.crab_angle[..., 0].any()
    for azimuth in (0, DIRECTIONS // 2):
        assert not costs.crab_angle[0, [AHEAD, YAWS // 2], azimuth].any()


def test_crab_angles_are_mirrored_with_the_slope(steady):
    """A slope to the right is answered like one to the left."""
    costs, _ = steady
    mirrored = -costs.crab_angle[0][:, -np.arange(DIRECTIONS)][-np.arange(YAWS)]
    assert np.abs(costs.crab_angle[0] - mirrored).max() < 1e-9
    assert costs.crab_angle.any()


def test_a_route_along_a_slope_is_cheaper_than_one_that_heads_straight_along_it():
    """The poses' energy by the independent integrator, as planned and with the body straight."""
    slope = 0.1
    ground = terrain(np.outer(slope * 0.25 * np.arange(60), np.ones(120)))
    answer = plan_route(terrain=ground, start={"x": 4, "y": 7}, goal={"x": 25, "y": 7})
    poses = answer.to_json()["routes"][0]["poses"]
    straight = []
    for before, after in zip(poses[:-1], poses[1:], strict=True):
        heading = math.atan2(after["y"] - before["y"], after["x"] - before["x"])
        straight.append({**before, "yaw": heading})
    straight.append({**poses[-1], "yaw": straight[-1]["yaw"]})
    where = (ground.riding_surface(0.23), ground.origin, ground.cell, ROBOT)
    assert energy(poses, *where) < 0.96 * energy(straight, *where)
