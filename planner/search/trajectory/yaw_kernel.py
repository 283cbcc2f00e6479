"""The compiled part of the yaw programme: the best states, with few prices from the power model.

    cost = programme(..., estimates, ..., states)

A change of state is first estimated by tables (yaw_estimate). The best
way by these estimates is priced exactly, with its neighbours; what the estimates were off by at a
knot corrects the others there; and so on until the best way has nothing but exact prices. (Lazy
evaluation of edges: Dellin and Srinivasa, ICAPS 2016.)
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types

from planner.power.kernels import BLOCK_KERNEL
from planner.search.resolution import STATES, WIDTH
from planner.search.turns import spin_round, step_costs, turn_cost, turn_place
from planner.terrain.footprint import touches

MOST_SAMPLES = 2
"""Steps that stand for those between two knots, where there are more than three."""
WINDOW = 8
"""Largest change of the angle to the travel between knots, in states (45°)."""
PATIENCE = 2
"""Ways refused at a knot until others further from them are priced as well."""
ROUNDS = 24
"""Rounds of pricing after which the best way among the exact prices will do."""

_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_B1 = types.Array(types.boolean, 1, "C")
_B2 = types.Array(types.boolean, 2, "C")


@njit(cache=True)
def wrap(angle: float) -> float:
    """The same angle between -π and π."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit(cache=True)
def most_turn(span: float, bend: float, limits: Any) -> int:
    """States by which the angle to the travel may change over ``span`` metres with a bend."""
    # No further than the yaw rate allows at full speed, and one state more.
    window = min(WINDOW, 1 + int(math.ceil(limits[6] * span / limits[0] / WIDTH)))
    # Where the travel turns sharply the body may keep its yaw instead.
    return min(window + int(math.ceil(abs(bend) / WIDTH)), STATES // 2)


@njit(cache=True, error_model="numpy")
def _relax(
    price: Any,
    steady: Any,
    steady_then: Any,
    off: float,
    low: Any,
    high: Any,
    u: float,
    span: float,
    priced_only: bool,
    cost: Any,
    ahead: Any,
    origin: Any,
) -> None:
    """Least cost of states at a knot, with one more change of the angle from those before it.

    All arrays have STATES elements, and the loop runs in the processor's vector units.

    Args:
        price: exact prices; NaN where there is none.
        steady, steady_then: what the way costs at an even angle, that before and that after it.
        off: what such estimates are wrong by.
        low, high, u: what turning adds to a metre, and the share of ``high`` in it.
        span: m.
        priced_only: whether nothing is estimated.
        cost: of the states before.
        ahead, origin: costs of the states after it, and which state they come from; written.
    """
    for n in range(STATES):
        guess = 0.5 * (steady[n] + steady_then[n]) + off
        guess += span * ((1.0 - u) * low[n] + u * high[n])
        guess = np.inf if priced_only else guess
        known = float(price[n])
        total = guess if math.isnan(known) else known
        total += cost[n]
        better = total < ahead[n]
        ahead[n] = total if better else ahead[n]
        origin[n] = n if better else origin[n]


@njit(cache=True, error_model="numpy", nogil=True)
def _touching(
    blocked: Any,
    frame: Any,
    points: Any,
    first: int,
    last: int,
    lengths: Any,
    yaw: float,
    turn: float,
) -> bool:
    """Whether the body touches something between two stations while it turns evenly."""
    span, done = 0.0, 0.0
    for j in range(first, last):
        span += lengths[j]
    for j in range(first, last):
        share = lengths[j] / span
        x, y, to_x, to_y = points[j, 0], points[j, 1], points[j + 1, 0], points[j + 1, 1]
        if touches(blocked, frame, x, y, to_x, to_y, yaw + turn * done, turn * share):
            return True
        done += share
    return False


@njit(
    types.float64(
        *(_B2, _F1, _F2, _B1),
        *(BLOCK_KERNEL, _F1, _F1, _F2, _F2, _F1, _F1, types.int64),
        *(_I1, _F1, _F1, _F1, _F2, _I1, _I1),
        *(_F2, _F2, types.float64, _B2, _F2, _F2, types.float64),
        *(types.int64, types.int64, types.int64, _I1),
    ),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def programme(
    blocked: Any,
    frame: Any,
    points: Any,
    crowded: Any,
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
    slopes: Any,
    ground: Any,
    stride: Any,
    steady: Any,
    turning: Any,
    tightest: float,
    free: Any,
    shift: Any,
    spin_cost: Any,
    stop_cost: float,
    start_state: int,
    goal_state: int,
    beside: int,
    states: Any,
) -> Any:
    """Cost of the best yaw; ``states`` (2·knots,) gets the state before and after each knot.

    Infinite where no yaw leads through: states[0] is then the last knot that can be reached.

    Args:
        blocked, frame: as for ``planner.terrain.footprint.touches``.
        points: (stations, 2) m.
        crowded: (stations,) whether some yaw does not fit there.
        kernel, parameters, body, wheels, class_rows, limits, wind, objective: as for
            ``step_costs``.
        knots, knot_directions: stations, and the direction of travel there.
        directions, lengths, slopes, ground: of the steps between stations.
        stride: (knots,) every so many of the steps after a knot stands for the others.
        steady: (knots, STATES) estimate of the way to the next knot at an even angle.
        turning, tightest: table of what turning on the way adds.
        free, shift: (knots, STATES) whether the body fits, and rad by which its angle is off the
            state's own so that it does.
        spin_cost: (knots, STATES) cost per rad of turning on the spot.
        stop_cost: cost of a stop on the way.
        start_state, goal_state: -1 leaves them free.
        beside: states to either side of the best way that are priced with it.
        states: written.
    """
    count = knots.shape[0]
    last = count - 1
    cost = np.empty((count, STATES))
    driven = np.empty((count, STATES))
    came = np.empty((count, STATES), np.int64)  # state at the knot before
    spun = np.empty((count, STATES), np.int64)  # state before a turn on the spot, at this knot
    refused = np.zeros(last, np.int64)
    far, samples = np.empty(last, np.int64), np.zeros(last, np.int64)
    new = np.empty(last, np.bool_)
    off = np.zeros(last)  # what the estimates at a knot are wrong by
    spans, bends, scale = np.zeros(last), np.empty(last), np.empty(last)
    window = np.empty(last, np.int64)
    narrow = np.empty(last, np.bool_)
    for k in range(last):
        taken = 0.0
        for j in range(knots[k], knots[k + 1]):
            spans[k] += lengths[j]
        for j in range(knots[k] + (stride[k] - 1) // 2, knots[k + 1], stride[k]):
            taken += lengths[j]
            samples[k] += 1
        scale[k] = spans[k] / taken
        narrow[k] = crowded[knots[k] : knots[k + 1] + 1].any()
        bends[k] = wrap(knot_directions[k + 1] - knot_directions[k])
        window[k] = most_turn(spans[k], bends[k], limits)
    # By the change of the angle to the travel, and the state before it.
    widest = int(window.max())
    wide = 2 * widest + 1
    price = np.full((last, wide, STATES), np.float32(np.nan))
    every_price = price.reshape(-1)
    by_turn = turning.T.copy()
    # The ring of angles twice over, so that a change of angle is a shift.
    steady_twice = np.hstack((steady, steady))
    ahead, origin = np.empty(2 * STATES), np.empty(2 * STATES, np.int64)
    nothing = False
    for attempt in range(20 * ROUNDS):
        exact = attempt >= ROUNDS and not nothing
        driven[:] = np.inf
        for s in range(STATES):
            if free[0, s] and (start_state < 0 or s == start_state):
                driven[0, s] = 0.0
        for k in range(count):
            halt = stop_cost if 0 < k < last else 0.0
            spin_round(driven[k], free[k], spin_cost[k], halt, cost[k], spun[k])
            if k == last:
                break
            ahead[:] = np.inf
            for w in range(-window[k], min(window[k] + 1, STATES // 2)):
                u, column = turn_place(turning, tightest, spans[k], wrap(bends[k] + w * WIDTH))
                turned = w % STATES
                onto = slice(turned, turned + STATES)
                priced_only = exact or column < 0
                _relax(
                    *(price[k, w + widest], steady[k], steady_twice[k, onto], off[k]),
                    *(by_turn[column], by_turn[column + 1], u, spans[k], priced_only),
                    *(cost[k], ahead[onto], origin[onto]),
                )
            for t in range(STATES):
                again = ahead[t + STATES] < ahead[t]  # the same angle, once round
                best = ahead[t + STATES] if again else ahead[t]
                if free[k + 1, t] and best < np.inf:
                    driven[k + 1, t] = best
                    came[k + 1, t] = origin[t + STATES] if again else origin[t]
        at = goal_state
        if goal_state < 0:
            at = int(np.argmin(cost[last]))
        best = cost[last, at]
        if best == np.inf:
            if exact:
                nothing = True  # what is priced leads nowhere yet
                continue
            for k in range(count):
                if driven[k].min() < np.inf:
                    states[0] = k
            return np.inf
        nothing = False
        for k in range(last, -1, -1):
            states[2 * k + 1] = at
            at = spun[k, at]
            states[2 * k] = at
            at = came[k, at]
        most = 0
        for k in range(last):
            s = states[2 * k + 1]
            w = (states[2 * k + 2] - s + STATES // 2) % STATES - STATES // 2
            new[k] = math.isnan(price[k, w + widest, s])
            if new[k]:
                # What has been refused often here will be refused again: look further about.
                far[k] = min(beside + refused[k] // PATIENCE, STATES // 2)
                most += (2 * far[k] + 1) ** 2 * samples[k]
        if most == 0:
            return best
        asked, moves = np.empty(most, np.int64), np.empty((most, 3))
        of_pair = np.empty(most, np.int64)
        size = 0
        for k in range(last):
            if not new[k]:
                continue
            s, t = states[2 * k + 1], states[2 * k + 2]
            for a in range(s - far[k], s + far[k] + 1):
                for b in range(t - far[k], t + far[k] + 1):
                    p, q = a % STATES, b % STATES
                    w = (q - p + STATES // 2) % STATES - STATES // 2
                    if abs(w) > window[k] or not free[k + 1, q]:
                        continue
                    if not math.isnan(price[k, w + widest, p]):
                        continue
                    turn = wrap(bends[k] + w * WIDTH) + shift[k + 1, q] - shift[k, p]
                    yaw = knot_directions[k] + p * WIDTH + shift[k, p]
                    price[k, w + widest, p] = 0.0
                    if narrow[k] and _touching(
                        blocked, frame, points, knots[k], knots[k + 1], lengths, yaw, turn
                    ):
                        price[k, w + widest, p] = np.inf
                        continue
                    done = 0.0
                    for j in range(knots[k] + (stride[k] - 1) // 2, knots[k + 1], stride[k]):
                        share = lengths[j] * scale[k] / spans[k]
                        asked[size] = j
                        moves[size, 0] = yaw + turn * (done + 0.5 * share)
                        moves[size, 1] = lengths[j] * scale[k]
                        moves[size, 2] = turn * share
                        of_pair[size] = (k * wide + w + widest) * STATES + p
                        done += share
                        size += 1
        costs = np.empty(size)
        # Written out: numba takes a tuple that begins with a function for one of functions.
        step_costs(
            kernel,
            parameters,
            body,
            wheels,
            class_rows,
            limits,
            wind,
            objective,
            directions,
            slopes,
            ground,
            asked[:size],
            moves[:size],
            costs,
        )
        n = 0
        while n < size:
            pair, total = of_pair[n], 0.0
            while n < size and of_pair[n] == pair:
                total += costs[n]
                n += 1
            every_price[pair] = total
        for k in range(last):
            if not new[k]:
                continue
            s, t = states[2 * k + 1], states[2 * k + 2]
            w = (t - s + STATES // 2) % STATES - STATES // 2
            if price[k, w + widest, s] == np.inf:
                refused[k] += 1
            else:
                off[k] = price[k, w + widest, s] - 0.5 * (steady[k, s] + steady[k, t])
                off[k] -= turn_cost(turning, tightest, s, spans[k], wrap(bends[k] + w * WIDTH))
    return np.inf
