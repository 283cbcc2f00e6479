"""The compiled part of the yaw programme: prices of steps, and the way back through the states."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types

from planner.power.compile_kernel import KERNEL
from planner.power.pipeline import ACCOUNT_LENGTH, PER_WHEEL
from planner.quantities import INDEX
from planner.search.steady import BRIEFLY, SLOWEST, broken_limit, set_motion, set_wind

STATES = 64
"""Angles to the travel at which the body may stand."""
MOST_SAMPLES = 2
"""Steps that stand for those between two knots, where there are more than three."""
WINDOW = 8
"""Largest change of the angle to the travel between knots, in states (45°)."""

_WHEEL_COLUMNS = len(PER_WHEEL)
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_B2 = types.Array(types.boolean, 2, "C")
_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]


@njit(cache=True)
def wrap(angle: float) -> float:
    """The same angle between -π and π."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F1, _F1, _F1, types.float64, types.float64, types.float64),
        *(types.float64, types.float64, types.float64, types.int64, _F1, _F2),
    ),
    cache=True,
    error_model="numpy",
)
def _step_cost(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    row: Any,
    limits: Any,
    wind: Any,
    slope_x: float,
    slope_y: float,
    yaw: float,
    direction: float,
    length: float,
    turn: float,
    objective: int,
    account: Any,
    per_wheel: Any,
) -> float:
    """Cost of one straight step during which the body turns by ``turn``; infinity if impossible."""
    stretch = set_motion(row, slope_x, slope_y, yaw, direction, 1.0)
    vx, vy = row[_VX], row[_VY]
    set_wind(row, wind, yaw)
    surface = length * stretch
    speed = limits[0]
    if abs(turn) > 1e-12:
        speed = min(speed, limits[6] * surface / abs(turn))
        if speed < 1.1 * SLOWEST * limits[0]:
            return np.inf
    cost = np.inf
    # As fast as the limits let it: the speed programme finds the best speed afterwards.
    for _ in range(7):
        time = surface / speed
        row[_VX], row[_VY] = vx * speed, vy * speed
        row[_WZ] = turn / time
        watts = kernel(row, parameters, body, wheels, account, per_wheel)
        if broken_limit(account, limits, BRIEFLY if turn != 0.0 else 1.0) < 0:
            cost = time if objective == 1 else watts * time
            break
        speed *= 0.85
    row[_WZ] = 0.0
    return cost


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1, types.int64),
        *(_I1, _F1, _F1, _F1, _F1, _F1, _I1),  # knots and their directions; steps
        *(_B2, _F2, *(types.float64,) * 4, _I1),
    ),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def programme(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    class_rows: Any,
    limits: Any,
    wind: Any,
    objective: int,
    knots: Any,
    knot_directions: Any,
    directions: Any,
    lengths: Any,
    slope_x: Any,
    slope_y: Any,
    ground: Any,
    free: Any,
    spin_cost: Any,
    stop_cost: float,
    gentle: float,
    start_yaw: float,
    goal_yaw: float,
    states: Any,
) -> Any:
    """Cost of the best yaw; ``states`` (2·knots,) gets the state before and after each knot."""
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    rows = class_rows.copy()
    count = knots.shape[0]
    width = 2.0 * math.pi / STATES
    cost = np.full((count, STATES), np.inf)
    driven = np.full((count, STATES), np.inf)
    came = np.full((count, STATES), -1, np.int64)  # state at the knot before
    spun = np.full((count, STATES), -1, np.int64)  # state before a turn on the spot, at this knot
    for s in range(STATES):
        if free[0, s]:
            driven[0, s] = 0.0
    if not math.isnan(start_yaw):
        for s in range(STATES):
            driven[0, s] = np.inf
        nearest = int(round(wrap(start_yaw - knot_directions[0]) / width)) % STATES
        driven[0, nearest] = 0.0
    # Where knots lie far apart on gentle ground, a few steps stand for all between them.
    stride = np.ones(count, np.int64)
    scale = np.ones(count)
    steepest = np.zeros(count)
    for k in range(count - 1):
        for j in range(knots[k], knots[k + 1]):
            steepest[k] = max(steepest[k], slope_x[j] ** 2 + slope_y[j] ** 2)
        if steepest[k] < gentle * gentle:
            stride[k] = max(1, (knots[k + 1] - knots[k]) // MOST_SAMPLES)
        whole, taken = 0.0, 0.0
        for j in range(knots[k], knots[k + 1]):
            whole += lengths[j]
            if (j - knots[k] - (stride[k] - 1) // 2) % stride[k] == 0:
                taken += lengths[j]
        scale[k] = whole / taken
    for k in range(count):
        # Turning on the spot: cheapest way round the ring, both ways, stopping once.
        for s in range(STATES):
            cost[k, s] = driven[k, s]
            spun[k, s] = s
        halt = stop_cost if 0 < k < count - 1 else 0.0
        for s in range(STATES):
            if driven[k, s] == np.inf:
                continue
            for way in (1, -1):
                total, at = driven[k, s] + halt, s
                for _ in range(STATES // 2 - 1):
                    following = (at + way) % STATES
                    if not free[k, following]:
                        break
                    total += 0.5 * (spin_cost[k, at] + spin_cost[k, following]) * width
                    at = following
                    if total < cost[k, at]:
                        cost[k, at] = total
                        spun[k, at] = s
        if k == count - 1:
            break
        bend = wrap(knot_directions[k + 1] - knot_directions[k])
        span = 0.0
        for j in range(knots[k], knots[k + 1]):
            span += lengths[j]
        # No further than the yaw rate allows at full speed, and one state more.
        window = min(WINDOW, 1 + int(math.ceil(limits[6] * span / limits[0] / width)))
        # Where the travel turns sharply the body may keep its yaw instead.
        window += int(math.ceil(abs(bend) / width))
        for s in range(STATES):
            if cost[k, s] == np.inf:
                continue
            yaw_a = knot_directions[k] + s * width
            for w in range(-window, window + 1):
                t = (s + w) % STATES
                if not free[k + 1, t]:
                    continue
                turn = bend + w * width
                total = cost[k, s]
                done = 0.0
                for j in range(knots[k] + (stride[k] - 1) // 2, knots[k + 1], stride[k]):
                    share = lengths[j] * scale[k] / span
                    yaw = yaw_a + turn * (done + 0.5 * share)
                    done += share
                    total += _step_cost(
                        kernel,
                        parameters,
                        body,
                        wheels,
                        rows[ground[j]],
                        limits,
                        wind,
                        slope_x[j],
                        slope_y[j],
                        yaw,
                        directions[j],
                        lengths[j] * scale[k],
                        turn * share,
                        objective,
                        account,
                        per_wheel,
                    )
                    if total >= driven[k + 1, t]:
                        break
                if total < driven[k + 1, t]:
                    driven[k + 1, t] = total
                    came[k + 1, t] = s
    last = count - 1
    best, at = np.inf, -1
    if math.isnan(goal_yaw):
        for s in range(STATES):
            if cost[last, s] < best:
                best, at = cost[last, s], s
    else:
        at = int(round(wrap(goal_yaw - knot_directions[last]) / width)) % STATES
        best = cost[last, at]
    if best < np.inf:
        for k in range(last, -1, -1):
            states[2 * k + 1] = at
            at = spun[k, at]
            states[2 * k] = at
            at = came[k, at]
    return best
