"""Costs of straight motions: additive, directed, and with the yaw never cheaper than without."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.quantities import STANDARD_GRAVITY
from planner.search.ompl.costs import costs_of, turning_rates
from planner.search.results import Route, drive
from tests.search.maps import hills, terrain
from tests.search.ompl.problems import RELIEF, problem


@pytest.fixture(scope="module")
def run():
    return problem().run


def places(rng, count):
    return [tuple(map(float, place)) for place in rng.uniform(3.0, 20.0, (count, 2))]


def test_uphill_costs_other_than_downhill(run):
    costs = costs_of(run, "energy", poses=False)
    a, b = (3.0, 3.0), (12.0, 11.0)
    there, back = costs.between(a, b), costs.between(b, a)
    assert there > 0.0 < back
    assert there != pytest.approx(back, rel=1e-6)


@pytest.mark.parametrize("poses", [False, True])
@pytest.mark.parametrize("objective", ["energy", "time", "length"])
def test_no_motion_undercuts_the_bound(run, poses, objective):
    costs = costs_of(run, objective, poses)
    rng = np.random.default_rng(1)
    for a, b in zip(places(rng, 40), places(rng, 40), strict=True):
        states = ((*a, 0.3), (*b, -0.4)) if poses else (a, b)
        assert costs.bound(*states) <= costs.between(*states) * (1.0 + 1e-9)


def test_a_given_yaw_costs_at_least_what_the_best_one_does(run):
    plane, poses = (costs_of(run, "energy", flag) for flag in (False, True))
    rng = np.random.default_rng(2)
    for a, b in zip(places(rng, 20), places(rng, 20), strict=True):
        best = plane.between(a, b)
        for yaw in np.linspace(-3.0, 3.0, 7):
            assert poses.between((*a, yaw), (*b, yaw)) >= 0.995 * best


def test_turning_on_the_spot_costs_in_proportion_to_the_angle(run):
    costs = costs_of(run, "energy", poses=True)
    quarter = costs.between((9.0, 9.0, 0.0), (9.0, 9.0, 0.5 * math.pi))
    half = costs.between((9.0, 9.0, 0.0), (9.0, 9.0, math.pi))
    assert half == pytest.approx(2.0 * quarter)
    assert quarter == pytest.approx(0.5 * math.pi * costs.turning.on_the_spot)
    # By the shorter way.
    assert costs.between((9.0, 9.0, 3.0), (9.0, 9.0, -3.0)) < quarter


def test_the_rates_are_those_of_the_power_model(run):
    rate = run.conditions.model.vehicle.limits.yaw_rate
    time = turning_rates(run.conditions, "time")
    assert time.on_the_spot == pytest.approx(1.0 / rate)
    assert time.on_the_move == 0.0
    energy = turning_rates(run.conditions, "energy")
    still = run.conditions.model.watts(run.conditions.class_rows[:1])[0]
    assert energy.on_the_spot - energy.on_the_move == pytest.approx(still / rate)


def test_a_straight_drive_dissipates_the_cost_and_its_ramps(run):
    """With poses and no turning, what driving dissipates is the cost, start and stop."""
    costs = costs_of(run, "energy", poses=True)
    a, b = (4.0, 5.0), (18.0, 9.0)
    yaw = math.atan2(b[1] - a[1], b[0] - a[0])
    cost = costs.between((*a, yaw), (*b, yaw))
    field = run.field("energy")
    route = drive(field, run.conditions, [np.array([a, b])], (yaw, yaw))
    assert isinstance(route, Route)
    dissipated = route.energy_j - run.conditions.mass * STANDARD_GRAVITY * route.rise_m
    assert dissipated == pytest.approx(cost, rel=0.06)


def test_wind_and_avoided_ground_cost_with_poses_too():
    calm = problem("poses").reader.costs
    windy = problem(
        "poses", conditions={"wind": {"x": -4.0, "y": 0.0}}, vehicle="robotino"
    ).reader.costs
    still = problem("poses", vehicle="robotino").reader.costs
    a, b = (4.0, 5.0, 0.0), (12.0, 5.0, 0.0)
    assert windy.between(a, b) >= still.between(a, b)
    doubled = calm._replace(
        field=calm.field._replace(factor=np.full(calm.field.heights.shape, 2.0))
    )
    assert doubled.between(a, b) == pytest.approx(2.0 * calm.between(a, b))


def test_what_stands_across_the_path_is_infeasible():
    heights = hills(48, rms_degrees=1.0)
    blocked = np.zeros(heights.shape, bool)
    blocked[20:28, 20:28] = True
    walled = problem(terrain=terrain(heights, obstacles=blocked), goal={"x": 10.0, "y": 10.0})
    for poses in (False, True):
        costs = costs_of(walled.run, "energy", poses)
        through = ((3.0, 6.0, 0.0), (9.0, 6.0, 0.0))
        states = through if poses else tuple(state[:2] for state in through)
        assert costs.between(*states) == math.inf
        assert not costs.feasible((6.0, 6.0, 0.0) if poses else (6.0, 6.0))
        assert costs.feasible(states[0])
    assert not RELIEF.obstacles.any()
