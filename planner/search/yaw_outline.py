"""The yaw programme in outline: by tables of steady costs, before the power model prices anything.

    if outline(field, knots, spans, bends, ..., near):   # near: changes of state worth pricing

Forwards and backwards through all states, so that every change of state has the cost of the whole
route through it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types

from planner.power.compile_kernel import KERNEL
from planner.power.pipeline import ACCOUNT_LENGTH, PER_WHEEL
from planner.search.steady import cost_for_yaw
from planner.search.yaw_kernel import MOST_SAMPLES, STATES, WIDTH, spin_round, step_cost

TURNS = 24
"""Bends of the table of what turning on the move adds."""
NEAR = 0.003
"""Share of the best cost by which a yaw in the outline may be dearer and still be looked at."""

_WHEEL_COLUMNS = len(PER_WHEEL)
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")


@njit(
    types.void(*(KERNEL, _F1, _F1, _F2, _F1, _F1, types.int64, types.float64, _F2)),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def turning_costs(
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
    """Cost that turning adds to a level metre, (STATES, TURNS) into ``turning``.

    By the angle to the travel, and by rad/m from 0 to ``tightest``; infinite where it cannot be.
    """
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    still = np.zeros(2)
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
                0.0,
                0.0,
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


@njit(cache=True, error_model="numpy", inline="always")
def _turn_cost(turning: Any, tightest: float, s: int, span: float, turn: float) -> float:
    """What a turn adds to the cost of ``span`` metres."""
    u = abs(turn) / span / tightest * (TURNS - 1)
    if u > TURNS - 1:
        return np.inf
    q = min(int(u), TURNS - 2)
    u -= q
    cost: float = span * ((1.0 - u) * turning[s, q] + u * turning[s, q + 1])
    return cost


@njit(cache=True, error_model="numpy", nogil=True)
def outline(
    field: Any,
    knots: Any,
    spans: Any,
    bends: Any,
    directions: Any,
    lengths: Any,
    slope_x: Any,
    slope_y: Any,
    ground: Any,
    free: Any,
    spin_cost: Any,
    stop_cost: float,
    turning: Any,
    tightest: float,
    start_state: int,
    goal_state: int,
    windows: Any,
    near: Any,
) -> bool:
    """Mark the changes of state near the best yaw by tables of steady costs; False without any.

    A turn on the move counts here what it would on the level. The programme proper then prices
    what is near with the power model.

    Args:
        field: tables of steady costs by yaw.
        knots: stations.
        spans, bends: (knots - 1,) m to the next knot, and rad by which the travel turns there.
        directions, lengths, slope_x, slope_y, ground: of the steps.
        free, spin_cost, stop_cost: of the knots' states and turns on the spot.
        turning: (STATES, TURNS) of ``turning_costs``.
        tightest: rad/m of its last entry.
        start_state, goal_state: -1 leaves them free.
        windows: (knots,) states by which the angle to the travel may change after each.
        near: (knots, STATES, STATES) set True for the changes of state near the best ones.
    """
    count = knots.shape[0]
    bins = field.by_yaw.shape[1]
    steady = np.zeros((count, STATES))
    for k in range(count - 1):
        # A few steps stand for all of a long way between two knots.
        first, last = knots[k], knots[k + 1]
        stride = max(1, (last - first) // MOST_SAMPLES)
        whole, taken = 0.0, 0.0
        for j in range(first, last):
            whole += lengths[j]
        for j in range(first + (stride - 1) // 2, last, stride):
            taken += lengths[j]
            steepness = math.sqrt(slope_x[j] ** 2 + slope_y[j] ** 2)
            azimuth = math.atan2(slope_y[j], slope_x[j]) - directions[j]
            before = np.inf
            for b in range(bins + 1):
                cost = lengths[j] * cost_for_yaw(
                    field.by_yaw, field.yaw_limit, ground[j], b % bins, azimuth, steepness, 1.0
                )
                s = (b * STATES) // bins
                if b < bins:
                    steady[k, s] += cost
                # A state between two bins: the mean, or the one that can be driven.
                if b > 0:
                    between = 0.5 * (before + cost)
                    if between == np.inf:
                        between = min(before, cost)
                    steady[k, s - 1] += between
                before = cost
        for s in range(STATES):
            steady[k, s] *= whole / max(taken, 1e-12)
    # Least cost from the start to a state, on arriving and on leaving, and from there to the goal.
    come = np.full((2, count, STATES), np.inf)
    ahead = np.full((2, count, STATES), np.inf)
    last = count - 1
    for s in range(STATES):
        if free[0, s] and (start_state < 0 or s == start_state):
            come[0, 0, s] = 0.0
        if free[last, s] and (goal_state < 0 or s == goal_state):
            ahead[1, last, s] = 0.0
    came = np.empty(STATES, np.int64)
    for k in range(count):
        halt = stop_cost if 0 < k < last else 0.0
        spin_round(come[0, k], free[k], spin_cost[k], halt, come[1, k], came)
        if k == last:
            break
        for s in range(STATES):
            if come[1, k, s] + steady[k, s] < np.inf:
                for w in range(-windows[k], windows[k] + 1):
                    t = (s + w) % STATES
                    if free[k + 1, t]:
                        total = come[1, k, s] + 0.5 * (steady[k, s] + steady[k, t])
                        total += _turn_cost(turning, tightest, s, spans[k], bends[k] + w * WIDTH)
                        come[0, k + 1, t] = min(come[0, k + 1, t], total)
    for k in range(last, -1, -1):
        if k < last:
            for s in range(STATES):
                if free[k, s] and steady[k, s] < np.inf:
                    for w in range(-windows[k], windows[k] + 1):
                        t = (s + w) % STATES
                        total = ahead[0, k + 1, t] + 0.5 * (steady[k, s] + steady[k, t])
                        total += _turn_cost(turning, tightest, s, spans[k], bends[k] + w * WIDTH)
                        ahead[1, k, s] = min(ahead[1, k, s], total)
        halt = stop_cost if 0 < k < last else 0.0
        # What a turn on the spot costs is the same there and back.
        spin_round(ahead[1, k], free[k], spin_cost[k], halt, ahead[0, k], came)
    best = (come[1, last] + ahead[1, last]).min()
    if best == np.inf:
        return False
    most = best * (1.0 + NEAR)
    for k in range(last):
        for s in range(STATES):
            if come[1, k, s] + ahead[1, k, s] > most:
                continue
            for w in range(-windows[k], windows[k] + 1):
                t = (s + w) % STATES
                total = come[1, k, s] + 0.5 * (steady[k, s] + steady[k, t]) + ahead[0, k + 1, t]
                total += _turn_cost(turning, tightest, s, spans[k], bends[k] + w * WIDTH)
                near[k, s, t] = total <= most
    return True
