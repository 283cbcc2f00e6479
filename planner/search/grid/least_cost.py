"""Exhaustive search on the map's grid: the least cost from everywhere to one goal.

    ahead = cost_to_go(field, lattice, goal)               # the whole map
    ahead = cost_to_go(field, lattice, goal, start=start)  # no more than this start needs
    path = grid_path(field, lattice, ahead, start)         # (k, 2), or None

Dijkstra's algorithm runs backwards from the goal with the 16 moves of
``lattice``. Yaw is eliminated (planner.search.field.cost_field), costs are
dissipated and so never negative. Nodes wait in buckets of equal width instead of a sorted queue
(Dial; Meyer and Sanders, J. Algorithms 49, 2003): what is improved within its own bucket is taken
up again, so costs are exact for any width. Every node keeps the move that it starts with, and the
path is read off. What the limited set of directions loses, planner.search.waypoints.path_smoothing
takes back. For one start only, nodes wait by their cost with that of the straight way to the start,
at the least that any metre costs (A*, Hart, Nilsson and Raphael, 1968).

Costs are kept in single precision: 1e-7 of each sum, a thousandth of what the directions lose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.cancellation import CancellationToken
from planner.search.field import CostField, segment_cost
from planner.search.grid.lattice import CLOSELY, Lattice, close_cost

BUCKETS = 4096
"""Buckets in the ring; what lies further ahead waits in the last one."""
_ARRIVED = 254
"""In place of a move's number: from here straight to the goal."""
_NONE = 255


@dataclass(frozen=True)
class CostToGo:
    """Least costs to one goal, or from it.

    Attributes:
        goal: x, y, m.
        values: (ny, nx) cost of every node; infinity where there is no way.
        moves: (ny, nx) number of the move that a node starts with.
        onward: costs are from the goal to the nodes instead, and moves those that arrive there.
        start: the only point that the costs are final for, or None if they are for all.
    """

    goal: tuple[float, float]
    values: NDArray[np.float32]
    moves: NDArray[np.uint8]
    onward: bool = False
    start: tuple[float, float] | None = None

    @property
    def nbytes(self) -> int:
        """Memory that is kept."""
        return self.values.nbytes + self.moves.nbytes


def cost_to_go(
    field: CostField,
    lattice: Lattice,
    goal: tuple[float, float],
    *,
    start: tuple[float, float] | None = None,
    onward: bool = False,
    token: CancellationToken | None = None,
) -> CostToGo:
    """Least cost from every node to the goal.

    Args:
        field: map and costs.
        lattice: its moves.
        goal: x, y in the map's frame, m.
        start: only what the least cost from this point needs; None fills the whole map.
        onward: least cost from ``goal`` to every node instead.
        token: the caller's wish to stop, seen within the search while its thread runs.

    Raises:
        Cancelled: the caller wants to stop.
    """
    # Wide enough that few buckets are empty, narrow enough that little is taken up twice.
    least = max(lattice.cheapest * float(field.factor.min()), 1e-3)
    width = 0.35 * least * min(field.dx, field.dy)
    token = token or CancellationToken()
    values, moves = _solve(
        field._replace(factor=lattice.factor),
        lattice._replace(factor=field.factor),
        *goal,
        start is not None,
        *(start if start is not None else goal),
        width,
        0.999 * least if start is not None else 0.0,
        onward,
        token.flag,
    )
    token.check()
    return CostToGo(goal, values, moves, onward, start)


@njit(cache=True, error_model="numpy")
def _surrounding(field: Any, x: float, y: float) -> tuple[int, int, int, int]:
    ny, nx = field.heights.shape
    u, v = (x - field.x0) / field.dx, (y - field.y0) / field.dy
    i0 = min(max(int(math.floor(u)), 0), nx - 1)
    j0 = min(max(int(math.floor(v)), 0), ny - 1)
    return j0, min(j0 + 1, ny - 1), i0, min(i0 + 1, nx - 1)


@njit(cache=True, error_model="numpy", nogil=True)
def _solve(
    field: Any,
    lattice: Any,
    goal_x: float,
    goal_y: float,
    wanted: bool,
    start_x: float,
    start_y: float,
    width: float,
    metre: float,
    onward: bool,
    stop: Any,
) -> Any:
    ny, nx = field.heights.shape
    values = np.full((ny, nx), np.float32(np.inf))
    moves = np.full((ny, nx), np.uint8(_NONE))
    # Entries that wait: a linked list for each bucket, in one pool that is as long as the front.
    head = np.full(BUCKETS, -1, np.int32)
    capacity = 4096
    node_of = np.empty(capacity, np.int32)
    key_of = np.empty(capacity, np.float32)
    after = np.empty(capacity, np.int32)
    for k in range(capacity):
        after[k] = k + 1
    after[capacity - 1] = -1
    free = 0
    waiting = 0
    current = 0
    count = lattice.moves.shape[0]
    j0, j1, i0, i1 = _surrounding(field, goal_x, goal_y)
    first = np.inf
    for seeding in (True, False):
        # The first bucket is that of the cheapest seed: costs of far seeds may be large.
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                px, py = field.x0 + i * field.dx, field.y0 + j * field.dy
                if onward:
                    cost = segment_cost(field, goal_x, goal_y, px, py, field.step)
                else:
                    cost = segment_cost(field, px, py, goal_x, goal_y, field.step)
                if not cost < np.inf:
                    continue
                if lattice.factor.shape[0] > 1:
                    cost *= lattice.factor[j, i]
                whole = cost + metre * math.hypot(px - start_x, py - start_y)
                if seeding:
                    first = min(first, whole)
                    continue
                values[j, i] = cost
                moves[j, i] = _ARRIVED
                place = free
                free = after[place]
                node_of[place], key_of[place] = j * nx + i, values[j, i]
                ahead = max(min(int(whole / width), current + BUCKETS - 1), current) % BUCKETS
                after[place] = head[ahead]
                head[ahead] = place
                waiting += 1
        if seeding and first < np.inf:
            current = int(np.float32(first) / width)
    sj0, sj1, si0, si1 = _surrounding(field, start_x, start_y)
    useful = np.zeros((2, 2), np.bool_)
    for j in range(sj0, sj1 + 1):
        for i in range(si0, si1 + 1):
            px, py = field.x0 + i * field.dx, field.y0 + j * field.dy
            if onward:
                cost = segment_cost(field, px, py, start_x, start_y, field.step)
            else:
                cost = segment_cost(field, start_x, start_y, px, py, field.step)
            useful[j - sj0, i - si0] = cost < np.inf
    # Where it can be left by none of them, the goal may still be near enough for a straight line.
    # Arrays by names of their own: taking them out of the tuples costs more than a look-up.
    slopes, table, offsets, beside = lattice.slopes, lattice.table, lattice.moves, lattice.beside
    row, close, factor, ground = lattice.row, lattice.close, lattice.factor, field.ground
    dearer, remembered = factor.shape[0] > 1, row.shape[0] > 1
    field_x0, field_y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    while waiting > 0:
        slot = current % BUCKETS
        place = head[slot]
        if place < 0:
            current += 1
            if stop[0]:
                break
            if wanted and current % 16 == 0:
                # Nodes that the start cannot be left by need not be reached.
                farthest = 0.0
                for j in range(sj0, sj1 + 1):
                    for i in range(si0, si1 + 1):
                        if useful[j - sj0, i - si0]:
                            farthest = max(farthest, values[j, i])
                if farthest + metre * (dx + dy) < current * width:
                    break
            continue
        head[slot] = after[place]
        node, key = node_of[place], key_of[place]
        after[place] = free
        free = place
        waiting -= 1
        j, i = node // nx, node % nx
        value = values[j, i]
        if key > value:
            continue  # a better way was found since
        whole = value
        if wanted:
            px, py = field_x0 + i * dx, field_y0 + j * dy
            whole += metre * math.sqrt((px - start_x) ** 2 + (py - start_y) ** 2)
        if int(whole / width) > current:
            # It waited in the last bucket for its own to come into the ring.
            ahead = min(int(whole / width), current + BUCKETS - 1) % BUCKETS
            place = free
            free = after[place]
            node_of[place], key_of[place] = node, key
            after[place] = head[ahead]
            head[ahead] = place
            waiting += 1
            if ahead == slot:
                current += 1
            continue
        for m in range(count):
            di, dj = offsets[m, 0], offsets[m, 1]
            # The move leads from (b, a) to (d, c): backwards into this node, or onward out of it.
            if onward:
                a, b, c, d = i, j, i + di, j + dj
                x, y = c, d
            else:
                a, b, c, d = i - di, j - dj, i, j
                x, y = a, b
            if x < 0 or y < 0 or x >= nx or y >= ny or values[y, x] <= value:
                continue
            here = slopes[b, a]
            if here == CLOSELY:
                if remembered:
                    cost = close[row[b, a], m]
                    if math.isnan(cost):
                        cost = close_cost(field, b, a, di, dj)
                        close[row[b, a], m] = cost
                else:
                    cost = close_cost(field, b, a, di, dj)
            else:
                there = slopes[d, c]
                g = ground[b, a]
                cost = table[g, here, m] + table[g, here if there == CLOSELY else there, m]
                if beside[m, 0] != beside[m, 2] or beside[m, 1] != beside[m, 3]:
                    there = slopes[b + beside[m, 1], a + beside[m, 0]]
                    cost += table[g, here if there == CLOSELY else there, m]
                    there = slopes[b + beside[m, 3], a + beside[m, 2]]
                    cost += table[g, here if there == CLOSELY else there, m]
            if dearer:
                cost *= factor[b, a]
            cost += value
            rounded = np.float32(cost)
            if rounded < values[y, x]:
                values[y, x] = rounded
                moves[y, x] = m
                if free < 0:
                    more = 2 * capacity
                    old_node, old_key, old_after = node_of, key_of, after
                    node_of = np.empty(more, np.int32)
                    key_of = np.empty(more, np.float32)
                    after = np.empty(more, np.int32)
                    node_of[:capacity] = old_node
                    key_of[:capacity] = old_key
                    after[:capacity] = old_after
                    for k in range(capacity, more):
                        after[k] = k + 1
                    after[more - 1] = -1
                    free = capacity
                    capacity = more
                place = free
                free = after[place]
                node_of[place], key_of[place] = y * nx + x, rounded
                whole = cost
                if wanted:
                    px, py = field_x0 + x * dx, field_y0 + y * dy
                    whole += metre * math.sqrt((px - start_x) ** 2 + (py - start_y) ** 2)
                ahead = max(min(int(whole / width), current + BUCKETS - 1), current) % BUCKETS
                after[place] = head[ahead]
                head[ahead] = place
                waiting += 1
            elif rounded == values[y, x] and m < moves[y, x] < _ARRIVED:
                moves[y, x] = m  # of equally good ones the first, in whatever order they came
    return values, moves


@njit(cache=True, error_model="numpy", nogil=True)
def _follow(lattice: Any, values: Any, moves: Any, j: int, i: int, side: int) -> Any:
    nodes = np.empty((values.size, 2), np.int64)
    count = 0
    while True:
        nodes[count, 0], nodes[count, 1] = i, j
        count += 1
        m = moves[j, i]
        if m >= _ARRIVED:
            return nodes[:count].copy()
        i += side * lattice.moves[m, 0]
        j += side * lattice.moves[m, 1]


@njit(cache=True, error_model="numpy")
def _enter(field: Any, values: Any, x: float, y: float, onward: bool) -> tuple[float, int, int]:
    """Least cost from a point by one of the nodes round it, and that node."""
    j0, j1, i0, i1 = _surrounding(field, x, y)
    best, at_j, at_i = np.inf, -1, -1
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            px, py = field.x0 + i * field.dx, field.y0 + j * field.dy
            if onward:
                cost = segment_cost(field, px, py, x, y, field.step)
            else:
                cost = segment_cost(field, x, y, px, py, field.step)
            cost += values[j, i]
            if cost < best:
                best, at_j, at_i = cost, j, i
    return best, at_j, at_i


def cost_from(field: CostField, ahead: CostToGo, start: tuple[float, float]) -> float:
    """Least cost from a point to the goal (to the point, with ``onward``) along the grid."""
    a, b = (ahead.goal, start) if ahead.onward else (start, ahead.goal)
    direct = float(segment_cost(field, *a, *b, field.step)) if _near(field, a, b) else math.inf
    return min(direct, float(_enter(field, ahead.values, *start, ahead.onward)[0]))


def _near(field: CostField, a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether a straight line is worth trying beside the grid's path."""
    return math.hypot(b[0] - a[0], b[1] - a[1]) < 64.0 * max(field.dx, field.dy)


def grid_path(
    field: CostField, lattice: Lattice, ahead: CostToGo, start: tuple[float, float]
) -> NDArray[np.float64] | None:
    """Polyline (k, 2) from start to goal by the least-cost moves, or None if there is no way.

    With ``ahead.onward`` from the goal to the start.
    """
    best, j, i = _enter(field, ahead.values, *start, ahead.onward)
    a, b = (ahead.goal, start) if ahead.onward else (start, ahead.goal)
    if _near(field, a, b) and segment_cost(field, *a, *b, field.step) <= best < math.inf:
        return np.array([a, b], float)
    if math.isinf(best):
        straight = math.isfinite(segment_cost(field, *a, *b, field.step))
        return np.array([a, b], float) if straight else None
    nodes = _follow(lattice, ahead.values, ahead.moves, j, i, -1 if ahead.onward else 1)
    inner = np.column_stack([field.x0 + nodes[:, 0] * field.dx, field.y0 + nodes[:, 1] * field.dy])
    path: NDArray[np.float64] = np.vstack([start, inner, ahead.goal])
    if ahead.onward:
        path = path[::-1].copy()
    apart = np.hypot(*np.diff(path, axis=0).T) > 1e-9
    kept: NDArray[np.float64] = path[np.concatenate([[True], apart])]
    return kept
