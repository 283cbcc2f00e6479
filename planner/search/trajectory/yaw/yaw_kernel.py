"""The compiled part of the yaw profile: the best states, with few prices from the power model.

    cost = best_states(kernel, arrays, ..., states)

A change of state is first estimated by tables (yaw_moves). The best path by these estimates is
priced exactly, with its neighbours. The error of an estimate corrects the others at its waypoint.
This repeats until the best path has exact prices alone. (Lazy evaluation of edges: Dellin and
Srinivasa, ICAPS 2016.)
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.kernels import BLOCK_KERNEL
from planner.search.kernel_arguments import EAGER, I1, MODEL_ARRAYS, STEPS
from planner.search.resolution import STATES, WIDTH
from planner.search.trajectory.yaw.yaw_moves import (
    PIECES,
    SURROUNDINGS,
    WAYPOINTS,
    change_of,
    moves_near,
    wrap,
)
from planner.search.turns import TURNING, spin_round, step_costs, turn_cost, turn_place

REFUSALS = 2
"""Paths refused at a waypoint for each state by which the search there widens."""
LAZY_ROUNDS = 24
"""Rounds of pricing after which estimates no longer count."""
MOST_ROUNDS = 20 * LAZY_ROUNDS
"""Rounds at most, so that the loop ends."""
MUCH = 4.0
"""States that a body turns on a step from which a close search looks between its middle and its
ends, too: looks are two states apart then. A turn that nowhere holds would go from step to
step."""
ROUGHLY_BESIDE = 1
"""States beside the best path up to which a search is a rough one."""
SAME_COST = 1e-9
"""J or s by which a state's cost may differ from that of the round before and count as the same."""


class Reached(NamedTuple):
    """Least costs by waypoint and state, (n, STATES) each but for the first.

    Attributes:
        least: (n,) J or s by which a waypoint costs at least more than the one before.
        driven, cost: before and after turning there on the spot, over the least before.
        came: the state at the waypoint before.
        spun: the state before turning on the spot.
    """

    least: Array
    driven: Array
    cost: Array
    came: NDArray[np.int64]
    spun: NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def _sweep(
    waypoints: Any,
    pieces: Any,
    turning: Any,
    by_turn: Any,
    steady_twice: Any,
    exact: bool,
    start_state: int,
    fresh: Any,
    reached: Any,
) -> None:
    """Least cost of every state at every waypoint, into ``reached``.

    Where no piece is fresh and the states of a waypoint cost as before, the rest stays.

    The inner loops are short, so that they run in the processor's vector units. There, numbers of
    states are floats as costs are.

    Args:
        waypoints, pieces, turning: of the track, and costs of turning.
        by_turn: (TURNS, STATES) the table of ``turning``.
        steady_twice: (n - 1, 2·STATES) the ring of angles twice over: a change of angle is a shift.
        exact: whether estimates do not count.
        start_state: -1 leaves it free.
        fresh: (n - 1,) pieces whose costs changed since the call before; all begins anew.
        reached: brought up to date.
    """
    # Arrays by names of their own: taking them out of a tuple costs more than a look-up.
    least, driven, cost, came, spun = reached
    free, steady, spin = waypoints.free, waypoints.steady, waypoints.spin
    spans, bends, window = pieces.spans, pieces.bends, pieces.window
    price, off = pieces.price, pieces.off
    last = driven.shape[0] - 1
    widest = price.shape[1] // 2
    next_cost, origin = np.empty(2 * STATES), np.empty(2 * STATES)
    total = np.empty(STATES)
    anew = changed = fresh.all()
    if anew:
        least[0], driven[:] = 0.0, np.inf
        for s in range(STATES):
            if free[0, s] and (start_state < 0 or s == start_state):
                driven[0, s] = 0.0
    for k in range(last + 1):
        if not changed and (k == last or not fresh[k]):
            continue
        halt = turning.stop if 0 < k < last else 0.0
        spin_round(driven[k], free[k], spin[k], halt, cost[k], spun[k])
        if k == last:
            break
        next_cost[:] = np.inf
        for w in range(-window[k], min(window[k] + 1, STATES // 2)):
            u, column = turn_place(turning, spans[k], wrap(bends[k] + w * WIDTH))
            turned, at = w % STATES, w + widest
            if exact or column < 0:
                total[:] = np.inf
            else:
                low, high = spans[k] * (1.0 - u), spans[k] * u
                for n in range(STATES):
                    total[n] = 0.5 * (steady[k, n] + steady_twice[k, turned + n]) + off[k]
                for n in range(STATES):
                    total[n] += low * by_turn[column, n] + high * by_turn[column + 1, n]
            for n in range(STATES):
                known = float(price[k, at, n])
                total[n] = (total[n] if math.isnan(known) else known) + cost[k, n]
            for n in range(STATES):
                better = total[n] < next_cost[turned + n]
                next_cost[turned + n] = total[n] if better else next_cost[turned + n]
                origin[turned + n] = float(n) if better else origin[turned + n]
        for t in range(STATES):
            again = next_cost[t + STATES] < next_cost[t]  # the same angle, once round
            total[t] = np.inf
            if free[k + 1, t]:
                total[t] = next_cost[t + STATES] if again else next_cost[t]
            if total[t] < np.inf:
                came[k + 1, t] = int(origin[t + STATES] if again else origin[t])
        least[k + 1] = total.min()
        changed = anew
        for t in range(STATES):
            over = total[t] - least[k + 1] if total[t] < np.inf else np.inf
            before = driven[k + 1, t]
            changed |= over != before and not abs(over - before) <= SAME_COST
            driven[k + 1, t] = over


@njit(cache=True, error_model="numpy")
def _trace_back(reached: Any, goal_state: int, states: Any) -> float:
    """Write the states of the best path, and return its cost; the last waypoint without a path."""
    cost = reached.cost
    last = cost.shape[0] - 1
    at = goal_state
    if goal_state < 0:
        # Of equal ones the first, however their costs were rounded.
        at = int(np.argmax(cost[last] <= cost[last].min() + SAME_COST))
    best: float = cost[last, at] + reached.least.sum()
    if cost[last, at] == np.inf:
        for k in range(last + 1):
            if reached.driven[k].min() < np.inf:
                states[0] = k
        return np.inf
    for k in range(last, -1, -1):
        states[2 * k + 1] = at
        at = reached.spun[k, at]
        states[2 * k] = at
        at = reached.came[k, at]
    return best


@njit(
    types.float64(
        *(BLOCK_KERNEL, MODEL_ARRAYS, SURROUNDINGS, STEPS, WAYPOINTS, PIECES, TURNING),
        *(types.int64, types.int64, types.int64, I1),
    ),
    **EAGER,
)
def best_states(
    kernel: Any,
    arrays: Any,
    conditions: Any,
    steps: Any,
    waypoints: Any,
    pieces: Any,
    turning: Any,
    start_state: int,
    goal_state: int,
    beside: int,
    states: Any,
) -> Any:
    """Cost of the best yaw; ``states`` (2·n,) gets the state before and after each waypoint.

    Infinite where no yaw leads through: states[0] is then the last waypoint that can be reached.

    Args:
        kernel, arrays: as for ``step_costs``.
        conditions, steps, waypoints: Surroundings, Steps and Waypoints of the track.
        pieces: Pieces between the waypoints; prices that are found are written.
        turning: Turning.
        start_state, goal_state: -1 leaves them free.
        beside: states to either side of the best path that are priced with it.
        states: written.
    """
    count = waypoints.at.shape[0]
    last = count - 1
    # A rough motion may turn through what a close one may not.
    much = MUCH * WIDTH if beside > ROUGHLY_BESIDE else np.inf
    reached = Reached(
        np.empty(count),
        np.empty((count, STATES)),
        np.empty((count, STATES)),
        np.empty((count, STATES), np.int64),
        np.empty((count, STATES), np.int64),
    )
    refused, far = np.zeros(last, np.int64), np.empty(last, np.int64)
    price, off = pieces.price, pieces.off
    off[:] = 0.0  # of angles that are free no longer, it says nothing of the others
    widest = price.shape[1] // 2
    every_price = price.reshape(-1)
    steady = waypoints.steady
    by_turn, steady_twice = turning.table.T.copy(), np.hstack((steady, steady))
    nothing = before = False
    fresh = np.ones(last, np.bool_)  # pieces that the last round priced
    for attempt in range(MOST_ROUNDS):
        exact = attempt >= LAZY_ROUNDS and not nothing
        if exact != before:
            before, fresh[:] = exact, True
        _sweep(
            *(waypoints, pieces, turning, by_turn, steady_twice),
            exact=exact,
            start_state=start_state,
            fresh=fresh,
            reached=reached,
        )
        best = _trace_back(reached, goal_state, states)
        nothing = best == np.inf
        if nothing:
            if exact:
                continue  # exact prices lead nowhere yet: estimates count again
            return best
        most = 0
        for k in range(last):
            s = states[2 * k + 1]
            far[k] = -1
            if math.isnan(price[k, change_of(s, states[2 * k + 2]) + widest, s]):
                # Where much was refused before, the search looks further about.
                far[k] = min(beside + refused[k] // REFUSALS, STATES // 2)
                most += (2 * far[k] + 1) ** 2 * pieces.samples[k]
            fresh[k] = far[k] >= 0
        if most == 0:
            return best
        asked, moves, pairs = moves_near(
            conditions, steps.lengths, waypoints, pieces, states, far, np.int64(most)
        )
        costs = np.empty(asked.shape[0])
        step_costs(kernel, arrays, 0, steps, asked, moves, much, costs)
        # Prices have single precision: sums are rounded once.
        n = 0
        while n < costs.shape[0]:
            pair, total = pairs[n], 0.0
            while n < costs.shape[0] and pairs[n] == pair:
                total += costs[n]
                n += 1
            every_price[pair] = total
        for k in range(last):
            if far[k] < 0:
                continue
            s, t = states[2 * k + 1], states[2 * k + 2]
            w = change_of(s, t)
            if price[k, w + widest, s] == np.inf:
                refused[k] += 1
            else:
                off[k] = price[k, w + widest, s] - 0.5 * (steady[k, s] + steady[k, t])
                off[k] -= turn_cost(turning, s, pieces.spans[k], wrap(pieces.bends[k] + w * WIDTH))
    return np.inf
