"""Very many steps at once cost what single rows of the power model say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.power.account import ACCOUNT, LIMITS
from planner.power.limits import broken_limit
from planner.power.motion_row import set_acceleration, set_motion, set_wind
from planner.quantities import INDEX
from planner.search.kernel_arguments import Steps
from planner.search.requests import SituationRequest
from planner.search.resolution import SLOWEST, STILL, WIDTH
from planner.search.situation import situation_of
from planner.search.turns.turning_steps import SLOWER, TRIES, step_costs
from tests.search.maps import terrain


@pytest.fixture(scope="module")
def conditions():
    """A robot in wind, on a map of its own."""
    ground = terrain(np.zeros((20, 20)))
    request = SituationRequest(map=ground.name, conditions={"wind": {"x": 3.0, "y": -2.0}})
    return situation_of(request, terrain=ground).conditions


def one_by_one(conditions, objective, direction, bend, slope, steep, ground, move):
    """The same cost by the model's account of single rows, looked at one after the other."""
    model, limits = conditions.model, conditions.limits
    middle, length, turn = move
    speed, cost = limits[0], math.inf
    looks = [(slope[:2], middle)]
    # Where limits are near, a bend takes the speed and the force that it takes on the way.
    bend = bend if steep else 0.0
    if bend:
        speed = min(speed, math.sqrt(model.vehicle.limits.acceleration / abs(bend)))
    if steep:
        looks.insert(0, (slope[2:4], middle))
    if steep and abs(turn) > WIDTH:
        # A sixth of the step from either end.
        looks = [(slope[6:], middle - turn / 3.0), (slope[4:6], middle + turn / 3.0), *looks]
    for place, yaw in looks:
        row = conditions.class_rows[ground].copy()
        set_wind(row, conditions.wind, yaw)
        surface = length * set_motion(row, *place, yaw, direction, 1.0)
        unit = row[[INDEX["vx"], INDEX["vy"]]]
        if abs(turn) > STILL:
            speed = min(speed, limits[6] * surface / abs(turn))
            if speed < 1.1 * SLOWEST * limits[0]:
                return math.inf
        cost = math.inf
        for _ in range(TRIES):
            row[[INDEX["vx"], INDEX["vy"]]] = unit * speed
            row[INDEX["wz"]] = turn * speed / surface
            set_acceleration(row, 0.0, speed * speed * bend, *unit, 1.0)
            accounts, _ = model.evaluate(row[None])
            if broken_limit(accounts[0], limits) < 0:
                cost = surface / speed * (1.0 if objective == 1 else accounts[0, 0])
                break
            speed *= SLOWER
        if cost == math.inf:
            return cost
    return cost


@pytest.mark.parametrize("objective", [0, 1])
def test_steps_cost_what_single_rows_say(conditions, objective) -> None:
    random = np.random.default_rng(3)
    steps, moves = 40, 300  # several blocks, the last one not full
    directions = random.uniform(-math.pi, math.pi, steps)
    bends = random.choice([0.0, -0.4, 1.5], steps)
    slopes = random.normal(0.0, 0.15, (steps, 8))
    steep = random.random(steps) < 0.7
    ground = np.zeros(steps, np.int64)
    at = np.sort(random.integers(0, steps, moves))
    asked = np.column_stack(
        [
            random.uniform(-math.pi, math.pi, moves),
            random.uniform(0.05, 0.5, moves),
            random.choice([0.0, 0.05, 0.4], moves),
        ]
    )
    costs = np.empty(moves)
    track = Steps(directions, np.ones(steps), bends, slopes, steep, ground)
    step_costs(
        conditions.model.limits_kernel, conditions.arrays, objective, track, at, asked, costs
    )
    expected = [
        one_by_one(
            *(conditions, objective, directions[j], bends[j]),
            *(slopes[j], steep[j], ground[j], asked[n]),
        )
        for n, j in enumerate(at)
    ]
    assert 20 < np.isinf(costs).sum() < moves - 100, "nothing is tested"
    np.testing.assert_allclose(costs, expected, rtol=1e-12)


def test_power_and_limits_are_those_of_the_account(conditions) -> None:
    rows = np.repeat(conditions.class_rows[:1], 150, axis=0)
    random = np.random.default_rng(4)
    for row in rows:
        slope = random.normal(0.0, 0.2, 2)
        set_motion(row, *slope, random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), 0.4)
    accounts, _ = conditions.model.evaluate(rows)
    columns = [0, *(ACCOUNT.index(name) for name in LIMITS)]
    np.testing.assert_array_equal(conditions.model.power_and_limits(rows), accounts[:, columns])
