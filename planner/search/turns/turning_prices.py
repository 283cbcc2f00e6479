"""Costs of turning and stopping under a request's circumstances, by objective.

    prices = turning(conditions, OBJECTIVES["energy"])
    prices.stop, prices.tightest, prices.table

The yaw profile and the search of poses estimate with them. Path smoothing weighs a corner by the
cost of a stop.
"""

from __future__ import annotations

import math

import numpy as np

from planner.arrays import Array
from planner.cache import CACHE
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.kernel_arguments import Steps
from planner.search.resolution import OBJECTIVES, SLOWEST, STATES, TURNS, WIDTH
from planner.search.turns.turning_steps import step_costs
from planner.search.turns.turning_table import Turning


def turning(conditions: OperatingConditions, objective: int) -> Turning:
    """Costs for an objective, 1 for time and anything else for energy."""
    return CACHE.get(
        ("turning", conditions.key, objective), lambda: _turning(conditions, objective)
    )


def _turning(conditions: OperatingConditions, objective: int) -> Turning:
    limits = conditions.limits
    # Up to the yaw rate's limit at the lowest speed that is tried.
    tightest = 0.8 * float(limits[6] / (SLOWEST * limits[0]))
    table = _turning_costs(conditions, objective, tightest)
    return Turning(_cost_of_a_stop(conditions, objective), tightest, table)


def _cost_of_a_stop(conditions: OperatingConditions, objective: int) -> float:
    """Kinetic energy with the rotors', of which braking returns little, or both ramps' time."""
    v, a = float(conditions.limits[0]), conditions.model.vehicle.limits.acceleration
    if objective == OBJECTIVES["time"]:
        return v / a
    cruise = conditions.class_rows[:1].copy()
    cruise[0, INDEX["vx"]] = v
    ramp = np.repeat(cruise, 8, axis=0)
    ramp[:, INDEX["vx"]] *= (np.arange(8) + 0.5) / 8.0
    ramp[:, INDEX["ax"]] = a
    up = float(_watts(conditions, ramp).mean()) * v / a
    ramp[:, INDEX["ax"]] = -a
    down = float(_watts(conditions, ramp).mean()) * v / a
    return up + down - float(_watts(conditions, cruise)[0]) * v / a


def _watts(conditions: OperatingConditions, rows: Array) -> Array:
    """Power of rows (n,), by the kernel that motions need anyway."""
    return conditions.model.power_and_limits(rows)[:, 0]


def _turning_costs(conditions: OperatingConditions, objective: int, tightest: float) -> Array:
    """Cost that turning adds to a level metre, (STATES, TURNS)."""
    moves = np.empty((STATES, TURNS, 3))
    moves[..., 0] = WIDTH * np.arange(STATES)[:, None]
    moves[..., 1] = 1.0
    moves[..., 2] = tightest * np.arange(TURNS) / (TURNS - 1)
    costs = np.empty(moves[..., 0].size)
    level = Steps(
        *(np.zeros(1), np.ones(1), np.zeros(1), np.zeros((1, 8))),
        *(np.zeros(1, bool), np.zeros(1, np.int64)),
    )
    arrays = conditions.arrays._replace(wind=np.zeros(2))
    at = np.zeros(costs.size, np.int64)
    step_costs(
        *(conditions.model.limits_kernel, arrays, objective, level, at),
        *(moves.reshape(-1, 3), math.inf, costs),
    )
    table = costs.reshape(STATES, TURNS)
    with np.errstate(invalid="ignore"):  # where even straight on is impossible
        return np.asarray(np.fmax(table - table[:, :1], 0.0))
