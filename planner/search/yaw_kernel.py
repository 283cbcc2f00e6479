"""The compiled part of the yaw programme: prices of steps, and the way back through the states."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types

from planner.power.compile_kernel import KERNEL
from planner.power.pipeline import ACCOUNT_LENGTH, PER_WHEEL
from planner.quantities import INDEX
from planner.search.steady import (
    BRIEFLY,
    SLOWEST,
    broken_limit,
    set_motion,
    set_wind,
)

STATES = 64
"""Angles to the travel at which the body may stand."""
WIDTH = 2.0 * math.pi / STATES
"""rad from one to the next."""
SPUN = 4
"""Turning on the spot is priced at every so many states, and evenly in between."""
MOST_SAMPLES = 2
"""Steps that stand for those between two knots, where there are more than three."""
WINDOW = 8
"""Largest change of the angle to the travel between knots, in states (45°)."""

_WHEEL_COLUMNS = len(PER_WHEEL)
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_B2 = types.Array(types.boolean, 2, "C")
_B3 = types.Array(types.boolean, 3, "C")
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
def step_cost(
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
    types.void(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1, _F1, _F1, _I1, types.int64, _F2),
    ),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def spin_costs(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    class_rows: Any,
    limits: Any,
    directions: Any,
    slope_x: Any,
    slope_y: Any,
    ground: Any,
    objective: int,
    spin: Any,
) -> None:
    """Cost per rad of turning on the spot at every knot and state (knots, STATES), into ``spin``.

    Infinite where a limit would be broken.
    """
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    rate = limits[6]
    for k in range(directions.shape[0]):
        row = class_rows[ground[k]].copy()
        row[_WZ] = rate
        for s in range(0, STATES, SPUN):
            set_motion(row, slope_x[k], slope_y[k], directions[k] + s * WIDTH, 0.0, 0.0)
            watts = kernel(row, parameters, body, wheels, account, per_wheel)
            spin[k, s] = max(1.0 if objective == 1 else watts, 0.0) / rate
            if broken_limit(account, limits, BRIEFLY) >= 0:
                spin[k, s] = np.inf
        for s in range(STATES):
            low = s - s % SPUN
            share = (s - low) / SPUN
            if share > 0.0:
                spin[k, s] = (1.0 - share) * spin[k, low] + share * spin[k, (low + SPUN) % STATES]


@njit(cache=True)
def most_turn(span: float, bend: float, limits: Any) -> int:
    """States by which the angle to the travel may change over ``span`` metres with a bend."""
    # No further than the yaw rate allows at full speed, and one state more.
    window = min(WINDOW, 1 + int(math.ceil(limits[6] * span / limits[0] / WIDTH)))
    # Where the travel turns sharply the body may keep its yaw instead.
    return window + int(math.ceil(abs(bend) / WIDTH))


@njit(cache=True, error_model="numpy", nogil=True, inline="always")
def spin_round(driven: Any, free: Any, spin_cost: Any, halt: float, cost: Any, spun: Any) -> None:
    """Turning on the spot at one knot: cheapest way round the ring, both ways, stopping once."""
    for s in range(STATES):
        cost[s] = driven[s]
        spun[s] = s
    for s in range(STATES):
        if driven[s] == np.inf:
            continue
        for way in (1, -1):
            total, at = driven[s] + halt, s
            for _ in range(STATES // 2 - 1):
                following = (at + way) % STATES
                if not free[following]:
                    break
                total += 0.5 * (spin_cost[at] + spin_cost[following]) * WIDTH
                at = following
                if total < cost[at]:
                    cost[at] = total
                    spun[at] = s


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1, types.int64),
        *(_I1, _F1, _F1, _F1, _F1, _F1, _I1),  # knots and their directions; steps
        *(_B2, _B3, _F2, *(types.float64,) * 4, _I1),
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
    near: Any,
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
        nearest = int(round(wrap(start_yaw - knot_directions[0]) / WIDTH)) % STATES
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
        spin_round(
            driven[k], free[k], spin_cost[k], stop_cost * (0 < k < count - 1), cost[k], spun[k]
        )
        if k == count - 1:
            break
        bend = wrap(knot_directions[k + 1] - knot_directions[k])
        span = 0.0
        for j in range(knots[k], knots[k + 1]):
            span += lengths[j]
        window = most_turn(span, bend, limits)
        for s in range(STATES):
            if cost[k, s] == np.inf:
                continue
            yaw_a = knot_directions[k] + s * WIDTH
            for w in range(-window, window + 1):
                t = (s + w) % STATES
                if not free[k + 1, t] or not near[k, s, t]:
                    continue
                turn = bend + w * WIDTH
                total = cost[k, s]
                done = 0.0
                for j in range(knots[k] + (stride[k] - 1) // 2, knots[k + 1], stride[k]):
                    share = lengths[j] * scale[k] / span
                    yaw = yaw_a + turn * (done + 0.5 * share)
                    done += share
                    total += step_cost(
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
        at = int(round(wrap(goal_yaw - knot_directions[last]) / WIDTH)) % STATES
        best = cost[last, at]
    if best < np.inf:
        for k in range(last, -1, -1):
            states[2 * k + 1] = at
            at = spun[k, at]
            states[2 * k] = at
            at = came[k, at]
    return best
