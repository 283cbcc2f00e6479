"""What turning and stopping cost under a request's circumstances, worked out once for each aim.

    prices = turning(around, OBJECTIVES["energy"])
    prices.stop, prices.tightest, prices.table

The programme for yaw and the search of poses estimate by them, and refinement tells by the price of
a stop what a corner is worth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planner.power.compile_kernel import KERNEL
from planner.power.pipeline import ACCOUNT_LENGTH, PER_WHEEL
from planner.quantities import INDEX
from planner.search.conditions import Circumstances
from planner.search.steady import OBJECTIVES, SLOWEST
from planner.search.yaw_kernel import STATES, WIDTH, step_cost

Array = NDArray[np.float64]

TURNS = 24
"""Bends of the table of what turning on the move adds."""

_WHEEL_COLUMNS = len(PER_WHEEL)
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")


@dataclass(frozen=True)
class Turning:
    """Prices of turning and stopping, in J or in s.

    Attributes:
        stop: speeding up again after a stop on the way.
        tightest: rad/m up to which turning on the way is tabulated.
        table: (STATES, TURNS) what turning adds to a level metre, by the angle to the travel and by
            rad/m from 0 to ``tightest``; infinite where it cannot be.
    """

    stop: float
    tightest: float
    table: Array


def turning(around: Circumstances, objective: int) -> Turning:
    """Prices for an objective, 1 for time and anything else for energy; kept with ``around``."""
    found = around.turning.get(objective)
    if not isinstance(found, Turning):
        model, limits = around.model, around.limits
        # Up to what the yaw rate allows at the lowest speed that is tried.
        tightest = 0.8 * float(limits[6] / (SLOWEST * limits[0]))
        table = np.empty((STATES, TURNS))
        numbers = (model.kernel, model.parameters, model.body, model.wheels)
        _turning_costs(*numbers, around.class_rows[0], limits, objective, tightest, table)
        found = Turning(_cost_of_a_stop(around, objective), tightest, table)
        around.turning[objective] = found
    return found


def _cost_of_a_stop(around: Circumstances, objective: int) -> float:
    """Kinetic energy with the rotors', of which braking returns little, or both ramps' time."""
    v, a = float(around.limits[0]), around.model.vehicle.limits.acceleration
    if objective == OBJECTIVES["time"]:
        return v / a
    cruise = around.class_rows[:1].copy()
    cruise[0, INDEX["vx"]] = v
    ramp = np.repeat(cruise, 8, axis=0)
    ramp[:, INDEX["vx"]] *= (np.arange(8) + 0.5) / 8.0
    ramp[:, INDEX["ax"]] = a
    up = float(around.model.watts(ramp).mean()) * v / a
    ramp[:, INDEX["ax"]] = -a
    down = float(around.model.watts(ramp).mean()) * v / a
    return up + down - float(around.model.watts(cruise)[0]) * v / a


@njit(
    types.void(*(KERNEL, _F1, _F1, _F2, _F1, _F1, types.int64, types.float64, _F2)),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def _turning_costs(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    row: Any,
    limits: Any,
    objective: int,
    tightest: float,
    turning: Any,
) -> None:
    """Write what turning adds to a level metre into ``turning`` (STATES, TURNS)."""
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    still, level = np.zeros(2), np.zeros(4)
    row = row.copy()
    for s in range(STATES):
        straight = 0.0
        for q in range(TURNS):
            cost = step_cost(
                kernel,
                parameters,
                body,
                wheels,
                row,
                limits,
                still,
                level,
                s * WIDTH,
                0.0,
                1.0,
                q * tightest / (TURNS - 1),
                objective,
                account,
                per_wheel,
            )
            straight = cost if q == 0 else straight
            turning[s, q] = max(cost - straight, 0.0)
