"""Exhaustive search on the map's grid: the least cost from everywhere to one goal.

    to_go = cost_to_go(field, lattice, goal)               # the whole map
    to_go = cost_to_go(field, lattice, goal, start=start)  # no more than this start needs
    path = grid_path(field, lattice, to_go, start)         # (k, 2), or None

Dijkstra's algorithm runs backwards from the goal with the 16 moves of ``lattice``. Yaw is not a
state (planner.search.field.cost_field). Costs are dissipated energy, so never negative. Nodes wait
in buckets of equal width instead of a sorted queue (Dial; Meyer and Sanders, J. Algorithms 49,
2003): what is improved within its own bucket is taken up again, so costs are exact for any width.
Every node keeps the move that it starts with, and the path is read off. What the limited set of
directions loses, planner.search.waypoints.path_smoothing takes back. For one start only, nodes wait
by their cost plus that of the straight line to the start, at the least cost of any metre (A*, Hart,
Nilsson and Raphael, 1968).

Costs are kept in single precision: 1e-7 of each sum, a thousandth of what the directions lose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.cancellation import CancellationToken
from planner.compiled_code import njit
from planner.search.field import CostField, segment_cost
from planner.search.grid.close_moves import close_cost, price_closely
from planner.search.grid.lattice import PRICED_CLOSELY, Lattice
from planner.search.resolution import LEAST_COST

BUCKETS = 4096
"""Buckets in the ring, enough that few entries wait in the last one for their own."""
BUCKET_WIDTH = 0.35
"""Width of a bucket in the least cost of a cell: few are empty, and little is taken up twice."""
FIRST_POOL = 4096
"""Entries that the pool has room for at first; it doubles when it is full."""
ROUNDED = 1.0 - 1e-6
"""Factor below what rounding to single precision takes off a cost."""
_ARRIVED = 254
"""In place of a move's number: from here straight to the goal."""
_NONE = 255
"""In place of a move's number: nothing leads from here to the goal."""


@dataclass(frozen=True)
class CostToGo:
    """Least costs to one goal, or from it.

    Attributes:
        goal: x, y, m.
        values: (ny, nx) cost of every node; infinity where there is no path.
        moves: (ny, nx) number of the move that a node starts with.
        from_start: costs are from the goal to the nodes instead, and moves those that arrive there.
        start: the only point that the costs are final for, or None if they are for all.
    """

    goal: tuple[float, float]
    values: NDArray[np.float32]
    moves: NDArray[np.uint8]
    from_start: bool = False
    start: tuple[float, float] | None = None

    @property
    def nbytes(self) -> int:
        """Cached bytes."""
        return self.values.nbytes + self.moves.nbytes


def cost_to_go(
    field: CostField,
    lattice: Lattice,
    goal: tuple[float, float],
    *,
    start: tuple[float, float] | None = None,
    beyond: float = 1.0,
    from_start: bool = False,
    token: CancellationToken | None = None,
) -> CostToGo:
    """Least cost from every node to the goal.

    Args:
        field: map and costs.
        lattice: its moves.
        goal: x, y in the map's frame, m.
        start: only what the least cost from this point needs; None fills the whole map.
        beyond: times the least cost from the start up to which detours through a node may cost for
            its cost to be final.
        from_start: least cost from ``goal`` to every node instead.
        token: the caller's wish to stop, seen within the search while its thread runs.

    Raises:
        Cancelled: the caller wants to stop.
    """
    least = max(lattice.cheapest * float(field.factor.min()), LEAST_COST)
    width = BUCKET_WIDTH * least * min(field.dx, field.dy)
    token = token or CancellationToken()
    values, moves = _solve(
        field._replace(factor=lattice.factor),
        lattice._replace(factor=field.factor),
        *goal,
        *(goal if start is None else start),
        width,
        0.0 if start is None else 0.999 * least,
        ROUNDED * field.least_cost(),
        beyond,
        from_start,
        token.flag,
    )
    token.check()
    return CostToGo(goal, values, moves, from_start, start)


@njit(cache=True, error_model="numpy")
def _corner_costs(field: Any, x: float, y: float, leaving: bool) -> tuple[Any, int, int]:
    """Costs (2, 2) of straight lines between a point and the nodes around it.

    Args:
        field: map and costs.
        x, y: the point, m.
        leaving: from the point to the nodes instead of from the nodes to it.

    Returns:
        the costs, infinite beyond the border; row and column of the first of these nodes.
    """
    ny, nx = field.heights.shape
    i0 = min(max(int(math.floor((x - field.x0) / field.dx)), 0), nx - 1)
    j0 = min(max(int(math.floor((y - field.y0) / field.dy)), 0), ny - 1)
    costs = np.full((2, 2), np.inf)
    for j in range(j0, min(j0 + 2, ny)):
        for i in range(i0, min(i0 + 2, nx)):
            px, py = field.x0 + i * field.dx, field.y0 + j * field.dy
            if leaving:
                costs[j - j0, i - i0] = segment_cost(field, x, y, px, py, field.step)
            else:
                costs[j - j0, i - i0] = segment_cost(field, px, py, x, y, field.step)
    return costs, j0, i0


@njit(cache=True, error_model="numpy")
def _seeds(
    field: Any,
    factor: Any,
    goal_x: float,
    goal_y: float,
    start_x: float,
    start_y: float,
    metre: float,
    from_start: bool,
) -> tuple[Any, Any, Any]:
    """The nodes around the goal that reach it by a straight line.

    Returns:
        their numbers, costs and estimates, each (n,).
    """
    nx = field.heights.shape[1]
    costs, j0, i0 = _corner_costs(field, goal_x, goal_y, from_start)
    reached = np.flatnonzero(costs.ravel() < np.inf)
    nodes = (j0 + reached // 2) * nx + i0 + reached % 2
    found, estimates = np.empty(nodes.size), np.empty(nodes.size)
    for n in range(nodes.size):
        j, i = nodes[n] // nx, nodes[n] % nx
        found[n] = costs[j - j0, i - i0]
        if factor.shape[0] > 1:
            found[n] *= factor[j, i]
        x, y = field.x0 + i * field.dx - start_x, field.y0 + j * field.dy - start_y
        estimates[n] = found[n] + metre * math.hypot(x, y)
    return nodes, found, estimates


@njit(cache=True, error_model="numpy", inline="always")
def _estimate(cost: float, metre: float, x: float, y: float) -> float:
    """Cost with that of the straight line (x, y) to the start, ``metre`` for each m."""
    return cost if metre == 0.0 else cost + metre * math.sqrt(x**2 + y**2)


@njit(cache=True, error_model="numpy", inline="always")
def _bucket(estimate: float, width: float, current: int) -> int:
    """Slot in the ring for an estimate; nothing waits in a bucket that has passed."""
    return max(min(int(estimate / width), current + BUCKETS - 1), current) % BUCKETS


@njit(cache=True, error_model="numpy", inline="always")
def _put(head: Any, after: Any, slot: int, place: int) -> int:
    """Make a free place the first of a bucket; the next free place, or -1."""
    free: int = after[place]
    after[place] = head[slot]
    head[slot] = place
    return free


@njit(cache=True, error_model="numpy")
def _chain(after: Any, first: int | np.int64) -> None:
    """Make a list of the free places from ``first`` on."""
    for k in range(first, after.shape[0]):
        after[k] = k + 1
    after[-1] = -1


@njit(cache=True, error_model="numpy")
def _farthest(values: Any, corners: Any, j0: int, i0: int) -> float:
    """Largest of the values at those of the nodes (2, 2) whose corner cost is finite."""
    farthest = 0.0
    for b in range(2):
        for a in range(2):
            if corners[b, a] < np.inf:
                farthest = max(farthest, values[j0 + b, i0 + a])
    return farthest


@njit(cache=True, error_model="numpy")
def _price_round(
    field: Any, lattice: Any, values: Any, leasts: Any, j: int, i: int, side: int
) -> None:
    """Price closely whatever ``_solve`` asks for at a node."""
    ny, nx = values.shape
    offsets, factor = lattice.moves, lattice.factor
    wanted, back = 0, min(side, 0)
    for m in range(offsets.shape[0]):
        x, y = i + side * offsets[m, 0], j + side * offsets[m, 1]
        if x < 0 or y < 0 or x >= nx or y >= ny or values[y, x] <= values[j, i]:
            continue
        a, b = i + back * offsets[m, 0], j + back * offsets[m, 1]
        if lattice.slopes[b, a] != PRICED_CLOSELY:
            continue
        least = leasts[m] * (factor[b, a] if factor.shape[0] > 1 else 1.0)
        may_be_better = np.float32(values[j, i] + least) <= values[y, x]
        if may_be_better and math.isnan(lattice.close[lattice.row[b, a], m]):
            wanted |= 1 << m
    price_closely(field, lattice, j, i, wanted, back)


@njit(cache=True, error_model="numpy", nogil=True)
def _solve(
    field: Any,
    lattice: Any,
    goal_x: float,
    goal_y: float,
    start_x: float,
    start_y: float,
    width: float,
    metre: float,
    cheapest: float,
    beyond: float,
    from_start: bool,
    stop: Any,
) -> Any:
    """Values and moves of a ``CostToGo``.

    Args:
        field, lattice: map, costs and moves; the factor on the cost is the lattice's.
        goal_x, goal_y, start_x, start_y: m.
        width: cost that a bucket spans.
        metre: cost of a metre to the start, in the estimates by which nodes wait; 0 fills the map.
        cheapest: cost of a metre that no move undercuts, near obstacles neither.
        beyond: as for ``cost_to_go``.
        from_start: costs from the goal instead.
        stop: (1,) True once the caller has cancelled.
    """
    ny, nx = field.heights.shape
    values = np.full((ny, nx), np.float32(np.inf))
    moves = np.full((ny, nx), np.uint8(_NONE))
    # Entries that wait: a linked list for each bucket, in one pool that is as long as the front.
    head = np.full(BUCKETS, -1, np.int32)
    node_of, key_of = np.empty(FIRST_POOL, np.int32), np.empty(FIRST_POOL, np.float32)
    after = np.empty(FIRST_POOL, np.int32)
    _chain(after, np.int64(0))
    free, waiting = 0, 0
    # Arrays by names of their own: taking them out of the tuples costs more than a look-up.
    slopes, table, offsets, beside = lattice.slopes, lattice.table, lattice.moves, lattice.beside
    row, close, factor, ground = lattice.row, lattice.close, lattice.factor, field.ground
    side, back = (1, 0) if from_start else (-1, -1)
    penalised, kept = factor.shape[0] > 1, row.shape[0] > 1
    # Moves of two cells pass between two further nodes.
    long = np.maximum(np.abs(offsets[:, 0]), np.abs(offsets[:, 1])) > 1
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    leasts = cheapest * np.hypot(offsets[:, 0] * dx, offsets[:, 1] * dy)
    nodes, costs, estimates = _seeds(
        field, factor, goal_x, goal_y, start_x, start_y, metre, from_start
    )
    # The first bucket is that of the cheapest seed: costs of far seeds may be large.
    current = int(np.float32(estimates.min()) / width) if nodes.size > 0 else 0
    for k in range(nodes.size):
        j, i = nodes[k] // nx, nodes[k] % nx
        values[j, i], moves[j, i] = costs[k], _ARRIVED
        node_of[free], key_of[free] = nodes[k], values[j, i]
        free = _put(head, after, _bucket(estimates[k], width, current), free)
        waiting += 1
    # Where it can be left by none of them, the goal may still be near enough for a straight line.
    corners, sj0, si0 = _corner_costs(field, start_x, start_y, not from_start)
    while waiting > 0:
        slot = current % BUCKETS
        place = head[slot]
        if place < 0:
            current += 1
            # Nodes that the start cannot be left by need not be reached.
            if stop[0] or (
                metre > 0.0
                and current % 16 == 0
                and beyond * (_farthest(values, corners, sj0, si0) + metre * (dx + dy))
                < current * width
            ):
                break
            continue
        head[slot] = after[place]
        after[place] = free
        free = place
        waiting -= 1
        node, key = node_of[place], key_of[place]
        j, i = node // nx, node % nx
        value = values[j, i]
        if key > value:
            continue  # a better path was found since
        estimate = _estimate(value, metre, x0 + i * dx - start_x, y0 + j * dy - start_y)
        if int(estimate / width) > current:
            # It waited in the last bucket for its own to come into the ring.
            to_go = _bucket(estimate, width, current)
            free = _put(head, after, to_go, place)
            waiting += 1
            if to_go == slot:
                current += 1
            continue
        for m in range(offsets.shape[0]):
            di, dj = offsets[m, 0], offsets[m, 1]
            x, y = i + side * di, j + side * dj
            if x < 0 or y < 0 or x >= nx or y >= ny or values[y, x] <= value:
                continue
            # The move leads from (b, a) by (dj, di): backwards into this node, or onward out of it.
            a, b = i + back * di, j + back * dj
            here, there = slopes[b, a], slopes[b + dj, a + di]
            if here != PRICED_CLOSELY:
                g = ground[b, a]
                cost = table[g, here, m] + table[g, here if there == PRICED_CLOSELY else there, m]
                if long[m]:
                    there = slopes[b + beside[m, 0, 1], a + beside[m, 0, 0]]
                    cost += table[g, here if there == PRICED_CLOSELY else there, m]
                    there = slopes[b + beside[m, 1, 1], a + beside[m, 1, 0]]
                    cost += table[g, here if there == PRICED_CLOSELY else there, m]
            else:
                least = leasts[m] * (factor[b, a] if penalised else 1.0)
                if np.float32(value + least) > values[y, x]:
                    continue  # whatever it costs, it is no better
                if not kept:
                    cost = close_cost(field, b, a, di, dj)
                else:
                    cost = close[row[b, a], m]
                    if math.isnan(cost):
                        _price_round(field, lattice, values, leasts, j, i, side)
                        cost = close[row[b, a], m]
            if penalised:
                cost *= factor[b, a]
            cost += value
            rounded = np.float32(cost)
            if rounded < values[y, x]:
                values[y, x], moves[y, x] = rounded, m
                if free < 0:
                    free = after.shape[0]
                    node_of = np.concatenate((node_of, np.empty_like(node_of)))
                    key_of = np.concatenate((key_of, np.empty_like(key_of)))
                    after = np.concatenate((after, np.empty_like(after)))
                    _chain(after, free)
                node_of[free], key_of[free] = y * nx + x, rounded
                estimate = _estimate(cost, metre, x0 + x * dx - start_x, y0 + y * dy - start_y)
                free = _put(head, after, _bucket(estimate, width, current), free)
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
def _enter(field: Any, values: Any, x: float, y: float, from_start: bool) -> tuple[float, int, int]:
    """Least cost from a point by one of the nodes around it, and that node."""
    costs, j0, i0 = _corner_costs(field, x, y, not from_start)
    best, at_j, at_i = np.inf, -1, -1
    for k in range(4):
        b, a = k // 2, k % 2
        if costs[b, a] < np.inf and costs[b, a] + values[j0 + b, i0 + a] < best:
            best, at_j, at_i = costs[b, a] + values[j0 + b, i0 + a], j0 + b, i0 + a
    return best, at_j, at_i


def cost_from(field: CostField, to_go: CostToGo, start: tuple[float, float]) -> float:
    """Least cost from a point to the goal (to the point, with ``from_start``) along the grid."""
    a, b = (to_go.goal, start) if to_go.from_start else (start, to_go.goal)
    direct = float(segment_cost(field, *a, *b, field.step)) if _near(field, a, b) else math.inf
    return min(direct, float(_enter(field, to_go.values, *start, to_go.from_start)[0]))


def _near(field: CostField, a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether a straight line is worth trying beside the grid's path."""
    return math.hypot(b[0] - a[0], b[1] - a[1]) < 64.0 * max(field.dx, field.dy)


def grid_path(
    field: CostField, lattice: Lattice, to_go: CostToGo, start: tuple[float, float]
) -> NDArray[np.float64] | None:
    """Polyline (k, 2) from start to goal by the least-cost moves, or None if there is no path.

    With ``to_go.from_start`` from the goal to the start.
    """
    best, j, i = _enter(field, to_go.values, *start, to_go.from_start)
    a, b = (to_go.goal, start) if to_go.from_start else (start, to_go.goal)
    if _near(field, a, b) and segment_cost(field, *a, *b, field.step) <= best < math.inf:
        return np.array([a, b], float)
    if math.isinf(best):
        straight = math.isfinite(segment_cost(field, *a, *b, field.step))
        return np.array([a, b], float) if straight else None
    nodes = _follow(lattice, to_go.values, to_go.moves, j, i, -1 if to_go.from_start else 1)
    inner = np.column_stack([field.x0 + nodes[:, 0] * field.dx, field.y0 + nodes[:, 1] * field.dy])
    path: NDArray[np.float64] = np.vstack([start, inner, to_go.goal])
    if to_go.from_start:
        path = path[::-1].copy()
    apart = np.hypot(*np.diff(path, axis=0).T) > 1e-9
    kept: NDArray[np.float64] = path[np.concatenate([[True], apart])]
    return kept
