"""Exhaustive search on the map's grid: the least cost from everywhere to one goal.

Dijkstra's algorithm runs backwards from the goal over the nodes of the grid with 16 or 32 moves a
node (all coprime offsets up to 2 or 3 cells). Yaw is eliminated (planner.search.ground), costs are
dissipated and so never negative. The path that follows the field down is the best on the grid;
what the limited set of directions loses, planner.search.refine takes back. The planner warms OMPL
up with it, and the tests hold OMPL's routes against it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.search.ground import (
    ALL_YAWS,
    CostField,
    masked_cost,
    segment_cost,
    wind_cost,
)
from planner.search.steady import cost_for_best_yaw

_GENERATORS = {
    8: ((1, 0), (1, 1)),
    16: ((1, 0), (1, 1), (2, 1)),
    32: ((1, 0), (1, 1), (2, 1), (3, 1), (3, 2)),
}


def grid_moves(count: int) -> NDArray[np.int64]:
    """Offsets (count, 2) in columns and rows, by angle; count is 8, 16 or 32."""
    moves = {
        (sx * x, sy * y)
        for a, b in _GENERATORS[count]
        for x, y in ((a, b), (b, a))
        for sx in (1, -1)
        for sy in (1, -1)
    }
    return np.array(sorted(moves, key=lambda m: math.atan2(m[1], m[0])), np.int64)


@njit(cache=True, error_model="numpy")
def move_cost(field: Any, j: int, i: int, dj: int, di: int, dx: float, dy: float) -> float:
    """Cost of the straight move from node (j, i) by (dj, di); infinity if anything is in the way.

    ``dx`` and ``dy`` are the cell's sides. Slopes are the means of the nodes beside each piece.
    """
    ny, nx = field.heights.shape
    pieces = max(abs(di), abs(dj))
    ex, ey = di * dx, dj * dy
    length = math.sqrt(ex * ex + ey * ey)
    if field.steep[j, i] or field.steep[j + dj, i + di]:
        # Near a limit the slopes of the nodes do not tell what lies between them.
        x, y = field.x0 + i * dx, field.y0 + j * dy
        return segment_cost(field, x, y, x + ex, y + ey, field.step, True)
    direction = math.atan2(ey, ex)
    total = 0.0
    ground = field.ground[j, i]
    for k in range(pieces):
        u0, v0 = i + di * k / pieces, j + dj * k / pieces
        u1, v1 = i + di * (k + 1) / pieces, j + dj * (k + 1) / pieces
        px, py, mask = 0.0, 0.0, ALL_YAWS
        for u, v in ((u0, v0), (u1, v1)):
            # Off the nodes both neighbours across the move count, for slope and for room.
            a0, b0 = int(math.floor(u)), int(math.floor(v))
            a1, b1 = min(int(math.ceil(u)), nx - 1), min(int(math.ceil(v)), ny - 1)
            px += 0.25 * (field.slope_x[b0, a0] + field.slope_x[b1, a1])
            py += 0.25 * (field.slope_y[b0, a0] + field.slope_y[b1, a1])
            mask &= field.mask[b0, a0] & field.mask[b1, a1]
        if mask == np.uint64(0):
            return np.inf
        steepness = math.sqrt(px * px + py * py)
        azimuth = math.atan2(py, px) - direction
        if mask == ALL_YAWS:
            cost = cost_for_best_yaw(
                field.best, field.limit, ground, azimuth, steepness, field.margin
            )
        else:
            cost = masked_cost(field, ground, mask, direction, azimuth, steepness, 0.0, 0.0, False)
        if cost == np.inf:
            return np.inf
        if field.factor.shape[0] > 1:
            cost *= field.factor[j, i]
        total += max(cost + wind_cost(field, direction), 1e-3)
    return total * length / pieces


@njit(cache=True, error_model="numpy")
def _push(keys: Any, items: Any, size: int, key: float, item: int) -> int:
    at = size
    while at > 0:
        up = (at - 1) >> 1
        if keys[up] <= key:
            break
        keys[at], items[at] = keys[up], items[up]
        at = up
    keys[at], items[at] = key, item
    return size + 1


@njit(cache=True, error_model="numpy")
def _pop(keys: Any, items: Any, size: int) -> int:
    """Remove the least entry; it is left in slot ``size - 1`` of the arrays."""
    size -= 1
    top_key, top_item = keys[0], items[0]
    key, item = keys[size], items[size]
    at = 0
    while True:
        down = 2 * at + 1
        if down >= size:
            break
        if down + 1 < size and keys[down + 1] < keys[down]:
            down += 1
        if keys[down] >= key:
            break
        keys[at], items[at] = keys[down], items[down]
        at = down
    keys[at], items[at] = key, item
    keys[size], items[size] = top_key, top_item
    return size


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
    moves: Any,
    goal_x: float,
    goal_y: float,
    start_x: float,
    start_y: float,
    floor: float,
    onward: bool,
) -> Any:
    """Costs to the goal; with ``onward`` costs from it, driving every move the other way.

    ``floor`` is a cost per metre that no move undercuts: nodes are taken up in the order of their
    cost plus the floor to the start (A*), and the search ends with the start. 0 fills the map.
    """
    ny, nx = field.heights.shape
    values = np.full((ny, nx), np.inf)
    done = np.zeros((ny, nx), np.bool_)
    capacity = ny * nx + 1024
    keys = np.empty(capacity)
    items = np.empty(capacity, np.int64)
    size = 0
    step = field.step
    j0, j1, i0, i1 = _surrounding(field, goal_x, goal_y)
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            x, y = field.x0 + i * field.dx, field.y0 + j * field.dy
            if onward:
                cost = segment_cost(field, goal_x, goal_y, x, y, step, True)
            else:
                cost = segment_cost(field, x, y, goal_x, goal_y, step, True)
            if cost < np.inf:
                values[j, i] = cost
                key = cost + floor * math.hypot(x - start_x, y - start_y)
                size = _push(keys, items, size, key, j * nx + i)
    sj0, sj1, si0, si1 = _surrounding(field, start_x, start_y)
    wanted = (sj1 - sj0 + 1) * (si1 - si0 + 1)
    while size > 0:
        size = _pop(keys, items, size)
        node = items[size]
        j, i = node // nx, node % nx
        if done[j, i]:
            continue
        done[j, i] = True
        value = values[j, i]
        if sj0 <= j <= sj1 and si0 <= i <= si1:
            wanted -= 1
            if wanted == 0 and floor > 0.0:
                break
        for m in range(moves.shape[0]):
            di, dj = moves[m, 0], moves[m, 1]
            a, b = i - di, j - dj
            if a < 0 or b < 0 or a >= nx or b >= ny or done[b, a]:
                continue
            if values[b, a] <= value:
                continue
            ahead = floor * math.hypot(
                field.x0 + a * field.dx - start_x, field.y0 + b * field.dy - start_y
            )
            if onward:
                cost = value + move_cost(field, j, i, -dj, -di, field.dx, field.dy)
            else:
                cost = value + move_cost(field, b, a, dj, di, field.dx, field.dy)
            if cost < values[b, a]:
                values[b, a] = cost
                if size == capacity:
                    more_keys = np.empty(2 * capacity)
                    more_items = np.empty(2 * capacity, np.int64)
                    more_keys[:capacity] = keys
                    more_items[:capacity] = items
                    keys, items = more_keys, more_items
                    capacity *= 2
                size = _push(keys, items, size, cost + ahead, b * nx + a)
    return values


@njit(cache=True, error_model="numpy")
def _descend(field: Any, moves: Any, values: Any, j: int, i: int) -> Any:
    ny, nx = values.shape
    nodes = np.empty((ny * nx, 2), np.int64)
    count = 0
    while True:
        nodes[count, 0], nodes[count, 1] = i, j
        count += 1
        least, at = np.inf, -1
        for m in range(moves.shape[0]):
            a, b = i + moves[m, 0], j + moves[m, 1]
            if a < 0 or b < 0 or a >= nx or b >= ny or values[b, a] >= values[j, i]:
                continue
            cost = values[b, a] + move_cost(
                field, j, i, moves[m, 1], moves[m, 0], field.dx, field.dy
            )
            if cost < least:
                least, at = cost, m
        # The goal's own nodes carry the cost of the last straight piece, cheaper than any move on.
        if at < 0 or least > values[j, i] * (1.0 + 1e-9):
            return nodes[:count]
        i += moves[at, 0]
        j += moves[at, 1]


def cost_floor(field: CostField) -> float:
    """A cost per horizontal metre that nothing on the map undercuts."""
    least = float(field.best[np.isfinite(field.best)].min(initial=math.inf))
    least = least * float(field.factor.min()) + min(0.0, float(field.extra.min()))
    return max(least, 1e-3) if math.isfinite(least) else 1e-3


def cost_field_to(
    field: CostField,
    goal: tuple[float, float],
    start: tuple[float, float],
    *,
    moves: int = 16,
    whole: bool = False,
    onward: bool = False,
) -> NDArray[np.float64]:
    """Least cost (ny, nx) from every node to the goal; infinity where there is no way.

    Args:
        field: map and costs.
        goal, start: x, y in the map's frame, m.
        moves: 8, 16 or 32.
        whole: fill the whole map instead of stopping once the start is settled.
        onward: least cost from ``goal`` to every node instead.
    """
    floor = 0.0 if whole else cost_floor(field)
    values: NDArray[np.float64] = _solve(field, grid_moves(moves), *goal, *start, floor, onward)
    return values


def grid_path(
    field: CostField,
    values: NDArray[np.float64],
    start: tuple[float, float],
    goal: tuple[float, float],
    *,
    moves: int = 16,
) -> NDArray[np.float64] | None:
    """Polyline (k, 2) from start to goal down the cost field, or None if there is no way."""
    offsets = grid_moves(moves)
    step = field.step
    direct = segment_cost(field, *start, *goal, step, True)
    j0, j1, i0, i1 = _surrounding(field, *start)
    best, entry = math.inf, None
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            x, y = field.x0 + i * field.dx, field.y0 + j * field.dy
            cost = segment_cost(field, *start, x, y, step, True) + values[j, i]
            if cost < best:
                best, entry = cost, (j, i)
    if entry is None or direct <= best:
        return None if math.isinf(direct) else np.array([start, goal], float)
    nodes = _descend(field, offsets, values, *entry)
    inner = np.column_stack([field.x0 + nodes[:, 0] * field.dx, field.y0 + nodes[:, 1] * field.dy])
    path: NDArray[np.float64] = np.vstack([start, inner, goal])
    apart = np.hypot(*np.diff(path, axis=0).T) > 1e-9
    kept: NDArray[np.float64] = path[np.concatenate([[True], apart])]
    return kept
