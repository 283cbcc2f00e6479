"""The compiled search of poses: A* over nodes of the grid with the angle of the body.

    states, cost = search_poses(field, frame, lattice, nodes, ..., stop)

hybrid_search calls it and says what a state is.
"""

from __future__ import annotations

import heapq
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.field import wind_cost
from planner.search.grid import can_be_driven
from planner.search.resolution import COUNT, LEAST_COST, YAW_BINS
from planner.search.se2.pose_costs import (
    ANGLE,
    End,
    as_polar,
    bends_of,
    from_travel,
    is_free,
    metre_cost,
    states_near,
)
from planner.search.turns import turn_cost
from planner.terrain.footprint import touches

MOST_TURN = 3
"""Angles by which the body may turn on one move, to either side: 17°."""
MOST_REOPENED = 1.1
"""Times the least that a path may cost, up to which a state is searched again where less is found
to lead to it. Beyond, each is searched once: the path need not be cheap, and is found sooner."""
_TURNS = 2 * MOST_TURN + 1
_SPUN = COUNT * _TURNS
"""From this number on, a state was reached by a turn on the spot, from the angle beyond it."""
_BEGUN = _SPUN + YAW_BINS
"""The state was reached from the start."""


class AtNodes(NamedTuple):
    """What a search knows of every node.

    Attributes:
        slopes: (ny, nx, 4) gradient, and its steepness and azimuth.
        free: (ny, nx) as the field's ``mask``: angles that may be used.
        to_go: (ny, nx) cost-to-go.
    """

    slopes: Array
    free: NDArray[np.uint32]
    to_go: NDArray[np.float32]


class Moves(NamedTuple):
    """Properties of the moves of the grid.

    Attributes:
        offsets: (n, 2) columns and rows.
        length, direction, wind: (n,) m, rad, and cost that wind adds per metre.
        relative: (n, YAW_BINS) angle of the body to the travel, in steps.
        turns: (n, YAW_BINS, 2·MOST_TURN + 1) cost that turning adds.
    """

    offsets: NDArray[np.int64]
    length: Array
    direction: Array
    wind: Array
    relative: NDArray[np.int64]
    turns: Array


@njit(cache=True, error_model="numpy", inline="always")
def _roomy(mask: Any, b: int) -> bool:
    """Whether an angle of a node is free and its neighbours are, too."""
    before, after = (b - 1) % YAW_BINS, (b + 1) % YAW_BINS
    return is_free(mask, before) and is_free(mask, b) and is_free(mask, after)


@njit(cache=True, error_model="numpy", inline="always")
def _wrap(angle: float) -> float:
    """An angle in -π to π."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@njit(cache=True, error_model="numpy")
def _moves(field: Any, offsets: Any, turning: Any) -> Any:
    count = offsets.shape[0]
    length, direction, wind = np.empty(count), np.empty(count), np.empty(count)
    relative = np.empty((count, YAW_BINS), np.int64)
    turns = np.zeros((count, YAW_BINS, _TURNS))
    for m in range(count):
        ex, ey = offsets[m, 0] * field.dx, offsets[m, 1] * field.dy
        length[m], direction[m] = math.sqrt(ex * ex + ey * ey), math.atan2(ey, ex)
        wind[m] = wind_cost(field, direction[m])
        for b in range(YAW_BINS):
            relative[m, b] = from_travel(b, direction[m])
            for w in range(-MOST_TURN, MOST_TURN + 1):
                if w != 0:
                    turns[m, b, w + MOST_TURN] = turn_cost(
                        turning, relative[m, b], length[m], w * ANGLE
                    )
    return Moves(offsets, length, direction, wind, relative, turns)


@njit(cache=True, error_model="numpy")
def _trace_back(came: Any, last: int, offsets: Any, nx: int) -> list[int]:
    """States from the start to ``last``; none where that is negative."""
    trail = [last for _ in range(1 if last >= 0 else 0)]
    while len(trail) > 0 and came[trail[-1]] != _BEGUN:
        state, number = trail[-1], came[trail[-1]]
        node, b = state // YAW_BINS, state % YAW_BINS
        if number >= _SPUN:
            trail.append(node * YAW_BINS + number - _SPUN)
        else:
            m, w = number // _TURNS, number % _TURNS - MOST_TURN
            before = node - offsets[m, 1] * nx - offsets[m, 0]
            trail.append(before * YAW_BINS + (b - w) % YAW_BINS)
    return trail[::-1]


@njit(cache=True, error_model="numpy")
def _begin(
    field: Any, frame: Any, free: Any, start: End, to_go: Any, eager: float, spent: Any, came: Any
) -> Any:
    """Heap of the states round the start."""
    nx = to_go.shape[1]
    waiting = [(0.0, np.float32(0.0), 0) for _ in range(0)]
    for node, b, cost in states_near(field, frame, start, True):
        state = node * YAW_BINS + b
        whole = np.float32(cost + 1.0)
        if not is_free(free[node // nx, node % nx], b):
            continue
        if spent[state] == 0.0 or whole < spent[state]:
            spent[state] = whole
            came[state] = _BEGUN
            heapq.heappush(waiting, (cost + eager * to_go[node // nx, node % nx], whole, state))
    return waiting


@njit(cache=True, error_model="numpy")
def _arriving(field: Any, frame: Any, free: Any, goal: End) -> Any:
    """Cost from states round the goal, by state."""
    nx = free.shape[1]
    costs = {}
    for node, b, cost in states_near(field, frame, goal, False):
        if is_free(free[node // nx, node % nx], b):
            costs[node * YAW_BINS + b] = cost
    return costs


@njit(cache=True, error_model="numpy")
def _spin(
    mask: Any,
    spent: Any,
    came: Any,
    closed: Any,
    waiting: Any,
    state: int,
    still: float,
    halt: float,
    spin: float,
) -> None:
    """Reach the other angles of a node by turning on the spot, both ways round."""
    b = state % YAW_BINS
    value = spent[state] - 1.0
    for side in (1, -1):
        for turned in range(1, YAW_BINS // 2 + 1):
            to_b = (b + side * turned) % YAW_BINS
            if not is_free(mask, to_b):
                break
            if closed[state - b + to_b]:
                continue
            cost = value + halt + turned * spin
            whole = np.float32(cost + 1.0)
            other = state - b + to_b
            if spent[other] == 0.0 or whole < spent[other]:
                spent[other] = whole
                came[other] = _SPUN + b
                heapq.heappush(waiting, (cost + still, whole, other))


@njit(cache=True, error_model="numpy")
def _bends(
    field: Any,
    j: int,
    i: int,
    b: int,
    slope: Any,
    reached: int,
    moves: Any,
    from_x: float,
    from_y: float,
) -> tuple[float, float, float]:
    """Direction in which a state was reached, and the bends to the left and right that hold, rad.

    On gentle ground, and after a turn on the spot, any bend will do.

    Args:
        field: map and costs.
        j, i, b: row, column and angle of the state.
        slope: (4,) of the node, as in AtNodes.
        reached: number of how it was reached.
        moves: (n,) rad, direction of each move.
        from_x, from_y: m, from the start of the path.
    """
    if not field.steep[j, i] or _SPUN <= reached < _BEGUN:
        return 0.0, math.pi, math.pi
    before = math.atan2(from_y, from_x) if reached == _BEGUN else moves[reached // _TURNS]
    ground = field.ground[j, i]
    left, right = bends_of(
        *(field.by_yaw[ground], field.yaw_limit[ground], field.margin, slope[2], slope[3]),
        *(b, before),
    )
    return before, left, right


@njit(cache=True, error_model="numpy", nogil=True)
def search_poses(
    field: Any,
    frame: Any,
    lattice: Any,
    nodes: Any,
    turning: Any,
    spin: float,
    spin_limit: Any,
    turning_limit: Any,
    start: End,
    goal: End,
    limits: Any,
    stop: Any,
) -> Any:
    """States along the cheapest path, and its cost; none without a path.

    Args:
        field, frame: CostField, and its ``body_frame()``.
        lattice: of the field.
        nodes: AtNodes.
        turning: Turning.
        spin: cost of turning on the spot by one angle.
        spin_limit: (grounds,) slope up to which that is possible.
        turning_limit: (MOST_TURN, ...) as the field's ``yaw_limit``, while the body turns by as
            many angles on a move.
        start, goal: both ends.
        limits: PoseLimits: how far the search goes.
        stop: (1,) not zero ends the search.
    """
    # Arrays by names of their own: taking them out of the tuple costs more than a look-up.
    slopes, mask, to_go = nodes.slopes, nodes.free, nodes.to_go
    heights, grounds, factor = field.heights, field.ground, field.factor
    steep, offsets = field.steep, lattice.moves
    by_yaw, yaw_limit, blocked, margin = field.by_yaw, field.yaw_limit, field.blocked, field.margin
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    penalised, halt = factor.shape[0] > 1, turning.stop
    ny, nx = heights.shape
    states = ny * nx * YAW_BINS
    here_cost = np.empty(1 + MOST_TURN)
    moves = _moves(field, offsets, turning)
    length, direction, wind = moves.length, moves.direction, moves.wind
    relative, turns = moves.relative, moves.turns
    spent = np.zeros(states, np.float32)  # cost and 1, so that 0 is a state not seen yet
    came = np.zeros(states, np.uint16)
    closed = np.zeros(states, np.bool_)
    waiting = _begin(field, frame, mask, start, to_go, limits.eager, spent, came)
    arriving = _arriving(field, frame, mask, goal)
    best, last, expanded = np.inf, -1, 0
    while len(waiting) > 0:
        expected, known, state = heapq.heappop(waiting)
        if expected >= best or expanded > limits.most_expanded or stop[0]:
            break
        node, b = state // YAW_BINS, state % YAW_BINS
        j, i = node // nx, node % nx
        if known > spent[state] or closed[state]:
            continue  # searched before
        closed[state] = limits.eager > MOST_REOPENED
        value = spent[state] - 1.0
        expanded += 1
        x, y = x0 + i * dx, y0 + j * dy
        before, left, right = _bends(
            *(field, j, i, b, slopes[j, i], came[state], direction, x - start.x, y - start.y)
        )
        if value + arriving.get(state, np.inf) < best and (
            -right <= _wrap(math.atan2(goal.y - y, goal.x - x) - before) <= left
        ):
            best, last = value + arriving[state], state
        here = mask[j, i]
        if slopes[j, i, 2] <= spin_limit[grounds[j, i]]:
            _spin(here, spent, came, closed, waiting, state, limits.eager * to_go[j, i], halt, spin)
        for m in range(offsets.shape[0]):
            to_i, to_j = i + offsets[m, 0], j + offsets[m, 1]
            inside = 0 <= to_i < nx and 0 <= to_j < ny
            if not (inside and -right <= _wrap(direction[m] - before) <= left):
                continue
            still, metres = to_go[to_j, to_i], length[m]
            if steep[j, i] and not can_be_driven(field, lattice, j, i, m):
                metres *= limits.too_steep
            if still == np.inf or metres == np.inf:
                continue
            there = mask[to_j, to_i]
            straight, here_cost[:] = -1.0, -1.0
            hard = steep[j, i] or steep[to_j, to_i]
            for w in range(-MOST_TURN, MOST_TURN + 1):
                to_b = (b + w) % YAW_BINS
                other = (to_j * nx + to_i) * YAW_BINS + to_b
                cost = value + turns[m, b, w + MOST_TURN]
                # Most were reached for less before; they need no price.
                if not is_free(there, to_b) or closed[other] or 0.0 < spent[other] <= cost + 1.0:
                    continue
                if hard:
                    # Few yaw angles hold here, other ones half a cell on, and fewer while it turns.
                    ground, end = grounds[j, i], grounds[to_j, to_i]
                    edges = yaw_limit if w == 0 else turning_limit[abs(w) - 1]
                    if here_cost[abs(w)] < 0.0:
                        here_cost[abs(w)] = 0.5 * metre_cost(
                            *(by_yaw[ground], edges[ground], margin, slopes[j, i, 2]),
                            *(slopes[j, i, 3] - direction[m], relative[m, b]),
                        )
                    straight = here_cost[abs(w)]
                    if straight < np.inf:
                        straight += 0.5 * metre_cost(
                            *(by_yaw[end], edges[end], margin, slopes[to_j, to_i, 2]),
                            *(slopes[to_j, to_i, 3] - direction[m], relative[m, to_b]),
                        )
                elif straight < 0.0:
                    ground = grounds[j, i]
                    steepness, azimuth = as_polar(
                        0.5 * (slopes[j, i, 0] + slopes[to_j, to_i, 0]),
                        0.5 * (slopes[j, i, 1] + slopes[to_j, to_i, 1]),
                    )
                    straight = metre_cost(
                        *(by_yaw[ground], yaw_limit[ground], margin),
                        *(steepness, azimuth - direction[m], relative[m, b]),
                    )
                driven = max(straight + wind[m], LEAST_COST) * metres
                cost += driven * (factor[j, i] if penalised else 1.0)
                whole = np.float32(cost + 1.0)
                # An infinite cost is never below the best one.
                if cost + still >= best or 0.0 < spent[other] <= whole:
                    continue
                # With an angle to spare at both ends, nothing is touched between two nodes. The
                # finished motion is tried for contact all the same.
                if not (_roomy(here, b) and _roomy(there, to_b)):
                    to_x, to_y = x + offsets[m, 0] * dx, y + offsets[m, 1] * dy
                    if touches(blocked, frame, x, y, to_x, to_y, b * ANGLE, w * ANGLE):
                        continue
                spent[other] = whole
                came[other] = m * _TURNS + w + MOST_TURN
                heapq.heappush(waiting, (cost + limits.eager * still, whole, other))
    return _trace_back(came, last, offsets, nx), best
