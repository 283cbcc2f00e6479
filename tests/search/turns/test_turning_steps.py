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
from planner.search.resolution import SLOPE_SPEED, SLOWEST, STILL, WIDTH
from planner.search.situation import situation_of
from planner.search.turns.turning_steps import LITTLE, SLOWER, TRIES, step_costs
from tests.search.maps import terrain

CLOSER = 0.35
"""rad, turns from which steps are looked at between middle and ends, too."""


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
    # On its arc, the travel turns as well: what counts is how the body stands to it.
    bent = bend * length if steep and abs(turn - bend * length) > abs(turn) else 0.0
    swept = abs(turn - bent)
    looks = [(slope[:2], 0.0, True)]
    # Where limits are near, a bend takes the speed and the force that it takes on the way.
    bend = bend if steep else 0.0
    if steep:
        looks.insert(0, (slope[2:4], 0.0, True))
    if steep and swept > LITTLE * WIDTH:
        looks = [(slope[6:], -0.5, False), (slope[4:6], 0.5, False), *looks]
    if steep and swept > CLOSER:
        looks = [*((slope[2:4], quarter, False) for quarter in (-0.25, 0.25)), *looks]
    for place, off, bends in looks:
        yaw = middle + off * turn
        sideways = bend if bends else 0.0
        if sideways:
            speed = min(speed, math.sqrt(model.vehicle.limits.acceleration / abs(bend)))
        row = conditions.class_rows[ground].copy()
        set_wind(row, conditions.wind, yaw)
        surface = length * set_motion(row, *place, yaw, direction + off * bent, 1.0)
        unit = row[[INDEX["vx"], INDEX["vy"]]]
        if abs(turn) > STILL:
            speed = min(speed, limits[6] * surface / abs(turn))
            if speed < 1.1 * SLOWEST * limits[0]:
                return math.inf
        cost = math.inf
        fastest = speed
        for share in (*SLOWER ** np.arange(TRIES), SLOPE_SPEED):
            speed = fastest * share
            row[[INDEX["vx"], INDEX["vy"]]] = unit * speed
            row[INDEX["wz"]] = turn * speed / surface
            set_acceleration(row, 0.0, speed * speed * sideways, *unit, 1.0)
            accounts, _ = model.evaluate(row[None])
            if broken_limit(accounts[0], limits) < 0:
                cost = surface / speed * (1.0 if objective == 1 else accounts[0, 0])
                break
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
            random.choice([0.0, 0.05, 0.3, 0.8], moves),
        ]
    )
    costs = np.empty(moves)
    track = Steps(directions, np.ones(steps), bends, slopes, steep, ground)
    kernel, arrays = conditions.model.limits_kernel, conditions.arrays
    step_costs(kernel, arrays, objective, track, at, asked, CLOSER, costs)
    expected = [
        one_by_one(
            *(conditions, objective, directions[j], bends[j]),
            *(slopes[j], steep[j], ground[j], asked[n]),
        )
        for n, j in enumerate(at)
    ]
    assert 20 < np.isinf(costs).sum() < moves - 100, "nothing is tested"
    np.testing.assert_allclose(costs, expected, rtol=1e-12)


def one_step(
    conditions, slope: float, curvature: float, turn: float, yaw: float, length: float = 0.2
) -> float:
    """Cost of a steep step of so many m along x, where the ground rises to the left."""
    gradients = np.tile([0.0, slope], 4)[None]
    track = Steps(
        *(np.zeros(1), np.ones(1), np.array([curvature]), gradients),
        *(np.ones(1, bool), np.zeros(1, np.int64)),
    )
    costs, moves = np.empty(1), np.array([[yaw, length, turn]])
    kernel, arrays = conditions.model.limits_kernel, conditions.arrays
    step_costs(kernel, arrays, 0, track, np.zeros(1, np.int64), moves, CLOSER, costs)
    return float(costs[0])


def held(
    conditions, slope: float, yaw: float, rate: float, share: float, bend: float, off: float = 0.0
) -> bool:
    """Whether the limits hold at a share of full speed, with a turn of ``rate`` rad/m.

    The travel is ``off`` rad from the x axis.
    """
    row = conditions.class_rows[0].copy()
    speed = share * conditions.limits[0]
    set_wind(row, conditions.wind, yaw)
    set_motion(row, 0.0, slope, yaw, off, 1.0)
    unit = row[[INDEX["vx"], INDEX["vy"]]]
    row[[INDEX["vx"], INDEX["vy"]]] = unit * speed
    row[INDEX["wz"]] = rate * speed
    set_acceleration(row, 0.0, speed * speed * bend, *unit, 1.0)
    return broken_limit(conditions.model.evaluate(row[None])[0][0], conditions.limits) < 0


def test_a_bend_that_only_a_slow_robot_takes_is_possible(conditions) -> None:
    """Beside a slope that takes almost all there is, towards the side that rises.

    The step is so short that its travel hardly turns.
    """
    bend, short = 1.5, 0.005
    slopes = np.linspace(0.0, 1.0, 400)
    full = math.sqrt(conditions.limits[7] / bend) / conditions.limits[0]
    slowest = min(1.0, full) * SLOWER ** (TRIES - 1)
    only_slow = [
        slope
        for slope in slopes
        if held(conditions, slope, 0.0, 0.0, SLOPE_SPEED * min(1.0, full), bend)
        and not held(conditions, slope, 0.0, 0.0, slowest, bend)
    ]
    assert only_slow
    for slope in only_slow:
        assert one_step(conditions, slope, bend, 0.0, 0.0, short) < math.inf


def test_a_bend_that_the_body_does_not_follow_is_a_turn(conditions) -> None:
    """At its ends the robot stands to its travel as if it had turned on a straight step."""
    bend, length, seen = 1.5, 0.2, 0
    shares = (SLOPE_SPEED, *SLOWER ** np.arange(TRIES))
    for slope in np.linspace(0.1, 0.6, 101):
        ends = [
            any(held(conditions, slope, 0.0, 0.0, share, 0.0, off) for share in shares)
            for off in (-0.5 * bend * length, 0.5 * bend * length)
        ]
        if held(conditions, slope, 0.0, 0.0, SLOPE_SPEED, 0.0) and not all(ends):
            seen += 1
            assert one_step(conditions, slope, bend, 0.0, 0.0, length) == math.inf
    assert seen


def test_a_turn_whose_end_breaks_a_limit_is_impossible(conditions) -> None:
    """Although its middle, and a third of it to either side, keep them all when it is slow."""
    turn, seen = 0.08, 0
    rate, shares = turn / 0.2, (SLOPE_SPEED, *SLOWER ** np.arange(TRIES))
    for slope in np.linspace(0.1, 0.6, 40):
        for middle in np.linspace(-0.5, 0.5, 60):
            inner = (middle, middle + turn / 3.0, middle - turn / 3.0)
            if not all(held(conditions, slope, yaw, rate, SLOPE_SPEED, 0.0) for yaw in inner):
                continue
            ends = (middle - turn / 2.0, middle + turn / 2.0)
            if all(
                any(held(conditions, slope, yaw, rate, share, 0.0) for share in shares)
                for yaw in ends
            ):
                continue
            seen += 1
            assert one_step(conditions, slope, 0.0, turn, middle) == math.inf
    assert seen


def test_power_and_limits_are_those_of_the_account(conditions) -> None:
    rows = np.repeat(conditions.class_rows[:1], 150, axis=0)
    random = np.random.default_rng(4)
    for row in rows:
        slope = random.normal(0.0, 0.2, 2)
        set_motion(row, *slope, random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), 0.4)
    accounts, _ = conditions.model.evaluate(rows)
    columns = [0, *(ACCOUNT.index(name) for name in LIMITS)]
    np.testing.assert_array_equal(conditions.model.power_and_limits(rows), accounts[:, columns])


def test_a_turn_through_angles_that_break_a_limit_is_impossible(conditions) -> None:
    """Middle and ends of a turn may keep to the limits, and what lies between them not."""
    found = 0
    for slope in np.tan(np.radians(np.arange(10.0, 24.0, 0.5))):
        alone = {
            k: one_step(conditions, slope, 0.0, 0.0, math.radians(5.0 * k)) for k in range(-36, 73)
        }
        for k in range(-24, 49):
            for part in (3, 4, 5):
                between = alone[k - part], alone[k + part]
                outer = alone[k - 2 * part], alone[k], alone[k + 2 * part]
                if np.isfinite(outer).all() and np.isinf(between).any():
                    turn = math.radians(20.0 * part)
                    # So slowly that turning itself breaks no limit.
                    cost = one_step(conditions, slope, 0.0, turn, math.radians(5.0 * k), 5.0)
                    found += 1
                    assert math.isinf(cost)
    assert found > 0, "nothing is tested"
