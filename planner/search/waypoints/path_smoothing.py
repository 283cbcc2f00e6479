"""Refinement: from a path on the grid, or from OMPL, to the best polyline in its neighbourhood.

    [(path, cost)] = refine(field, path, penalties=[toll])

    band        move every waypoint across the path, a row of offsets each, and choose the cheapest
                combination (dynamic programming over the rows), with ever finer offsets
    shortcut    keep only the waypoints that pay for themselves (exact dynamic programming)

Both minimise the same yaw-free cost as the search (planner.search.field.cost_field), so a grid of
16 directions loses nothing in the end that a local change could win back. What a bend costs
(turning the body, slowing down, fighting a sideways force) is not part of that cost. A penalty for
each corner stands for it. Without it, smoothing would gain 0.01 % on straights with corners that
cost 1 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.field import CostField, polyline_cost, segment_cost, wind_cost
from planner.search.resolution import ALL_YAWS, DIRECTIONS, GENTLE, LEAST_COST
from planner.terrain.footprint import middle_fits
from planner.terrain.interpolation import interpolate

VARIANTS = {4.0: (1.0,), 8.0: (1.0, 0.1), 12.0: (1.0, 0.1)}
"""Shares of the corner penalty by the distance of waypoints in cells; driving them decides. Close
waypoints bend around obstacles, distant ones stay smooth, evenly curved paths turn cheaply."""
MOST_SKIPPED, LONG_PATH = 30, 500
"""Waypoints that a shortcut may leave out; half as many on paths of more than LONG_PATH."""
MANY_SKIPPED, FAR_STEP = 10, 2.0
"""Waypoints left out from which a shortcut is priced at points FAR_STEP times further apart."""
COARSE_STEP = 2.0
"""Distance of the points at which candidates are priced, as a multiple of the final one."""
BANDS = ((2.0, 5, COARSE_STEP), (0.7, 5, COARSE_STEP), (0.25, 4, 1.0))
"""Of each band: offset step in cells, offsets to each side, and distance of the pricing points as a
multiple of the final one."""
MOST_CHANGE = 2
"""Largest change of offset from a waypoint to the next, in offset steps."""


def resample(path: Array, spacing: float) -> Array:
    """The same polyline with its corners kept and no piece longer than ``spacing``."""
    pieces = [path[:1]]
    for a, b in zip(path[:-1], path[1:], strict=True):
        count = max(1, math.ceil(float(np.hypot(*(b - a))) / spacing - 1e-9))
        pieces.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    return np.vstack(pieces)


def even(path: Array, spacing: float) -> Array:
    """Points at even distances along the polyline; corners are cut, ends are kept."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    count = max(1, round(along[-1] / spacing))
    at = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(at, along, path[:, k]) for k in (0, 1)])


def even_where_free(field: CostField, path: Array, spacing: float) -> Array:
    """Points at even distances along a path, with its corners where a piece between is blocked.

    Cutting corners may lead into something solid. The path's own corners do not, but with all of
    them the waypoints would be many, and too close to move far.
    """
    start = even(path, spacing)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    at = np.linspace(0.0, along[-1], len(start))
    corners = np.flatnonzero(_bends(path))
    pieces = [start[:1]]
    for k in range(1, len(start)):
        (xa, ya), (xb, yb) = start[k - 1], start[k]
        if not math.isfinite(segment_cost(field, xa, ya, xb, yb, field.step)):
            first, last = np.searchsorted(along[corners], (at[k - 1] + 1e-9, at[k] - 1e-9))
            pieces.append(path[corners[first:last]])
        pieces.append(start[k : k + 1])
    return np.vstack(pieces)


def _bends(path: Array) -> NDArray[np.bool_]:
    """Whether the direction changes at each point (n,) of a polyline; not at its ends."""
    before, after = np.diff(path[:-1], axis=0), np.diff(path[1:], axis=0)
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    bends = np.zeros(len(path), np.bool_)
    bends[1:-1] = np.abs(cross) > 1e-9 * np.hypot(*before.T) * np.hypot(*after.T)
    return bends


@njit(cache=True, error_model="numpy", nogil=True)
def _fewest(
    field: Any, path: Any, straight: Any, step: float, least: float, corner_penalty: float
) -> Any:
    """The subset of waypoints of least cost, where each costs a corner penalty, and that cost.

    A line counts with its length times ``least`` until it seems to be the best; then it is priced.

    Args:
        field: map and costs.
        path: (waypoints, 2) m.
        straight: (waypoints, reach) costs of straight lines to every waypoint from those before
            it; NaN where not priced, and written where they are.
        step: m between the points at which lines are priced.
        least: cost of a metre at least.
        corner_penalty: of each waypoint.
    """
    count, reach = straight.shape
    cost = np.full(count, np.inf)
    came = np.zeros(count, np.int64)
    total, known = np.empty(reach), np.empty(reach, np.bool_)
    cost[0] = 0.0
    for k in range(1, count):
        near = min(reach, k)
        for back in range(near):
            q = k - 1 - back
            price = straight[k, back]
            known[back] = not math.isnan(price)
            if not known[back]:
                price = least * math.hypot(path[k, 0] - path[q, 0], path[k, 1] - path[q, 1])
            total[back] = cost[q] + corner_penalty + price
        while True:
            back = int(np.argmin(total[:near]))
            q = k - 1 - back
            if known[back] or total[back] == np.inf:
                break
            # The longer it is, the less a single point matters.
            apart = FAR_STEP * step if back >= MANY_SKIPPED else step
            price = segment_cost(field, path[q, 0], path[q, 1], path[k, 0], path[k, 1], apart)
            straight[k, back], known[back] = price, True
            total[back] = cost[q] + corner_penalty + price
        cost[k], came[k] = total[back], q
    kept = np.empty(count, np.int64)
    size, k = 0, count - 1
    while k > 0:
        kept[size] = k
        size += 1
        k = came[k]
    kept[size] = 0
    return kept[: size + 1][::-1].copy(), cost[count - 1]


def shortcuts(field: CostField, path: Array, penalties: Sequence[float]) -> list[Array]:
    """The cheapest polylines over subsets of the waypoints, one for each corner penalty."""
    whole = polyline_cost(field, path, field.step)
    if not math.isfinite(whole):
        return [path] * len(penalties)
    reach = MOST_SKIPPED if len(path) <= LONG_PATH else MOST_SKIPPED // 2
    straight, least = np.full((len(path), reach), np.nan), field.least_cost()
    found = []
    for corner_penalty in penalties:
        # A tiny penalty at least: on even ground a straight line then has no inner waypoints.
        penalty = max(corner_penalty, 1e-6 * whole)
        kept, cost = _fewest(field, path, straight, COARSE_STEP * field.step, least, penalty)
        found.append(path[kept] if math.isfinite(cost) else path)
    return found


@njit(cache=True, error_model="numpy")
def _sample_strip(
    field: Any,
    xs: Any,
    ys: Any,
    parts: int,
    slopes: Any,
    ground: Any,
    doubtful: Any,
    closed: Any,
) -> None:
    """Sample the ground between the offsets of two waypoints.

    Args:
        field: map and costs.
        xs, ys: (2, wide) m, the offsets' places.
        parts: columns of samples from one offset to the next.
        slopes: (rows, (wide - 1)·parts + 1, 2) written: gradient; rows lie evenly between the
            waypoints, half a row from either.
        ground: (rows, columns) written: ground class.
        doubtful: (rows, columns) written: whether a limit, something solid or ground to be avoided
            may be near.
        closed: (rows, columns) written: whether the body fits with no yaw.
    """
    heights, mask, steep, classes = field.heights, field.mask, field.steep, field.ground
    x0, y0, dx, dy, safe = field.x0, field.y0, field.dx, field.dy, field.safe
    everywhere = field.factor.shape[0] > 1
    ny, nx = heights.shape
    rows, columns = ground.shape
    for r in range(rows):
        w = (r + 0.5) / rows
        for c in range(columns):
            m = min(c // parts, xs.shape[1] - 2)
            v = c / parts - m
            x = (1.0 - w) * ((1.0 - v) * xs[0, m] + v * xs[0, m + 1])
            x += w * ((1.0 - v) * xs[1, m] + v * xs[1, m + 1])
            y = (1.0 - w) * ((1.0 - v) * ys[0, m] + v * ys[0, m + 1])
            y += w * ((1.0 - v) * ys[1, m] + v * ys[1, m + 1])
            i = min(max(int(math.floor((x - x0) / dx + 0.5)), 0), nx - 1)
            j = min(max(int(math.floor((y - y0) / dy + 0.5)), 0), ny - 1)
            _, px, py = interpolate(heights, x0, y0, dx, dy, x, y)
            steepness = math.sqrt(px * px + py * py)
            closed[r, c] = mask[j, i] == np.uint64(0) and not middle_fits(field, x, y)
            doubtful[r, c] = everywhere or steep[j, i] or mask[j, i] != ALL_YAWS
            if steepness >= safe:
                # Within the table; on ground that nobody can drive on there is no slope in it.
                doubtful[r, c] = True
                gentler = (1.0 - 1e-6) * safe / steepness if safe > 0.0 else 0.0
                px, py = px * gentler, py * gentler
            slopes[r, c, 0], slopes[r, c, 1] = px, py
            ground[r, c] = classes[j, i]


@njit(cache=True, error_model="numpy")
def _across(
    gentle: Any,
    reach: float,
    slopes: Any,
    ground: Any,
    doubtful: Any,
    closed: Any,
    first: float,
    last: float,
    ux: float,
    uy: float,
    wind: float,
) -> tuple[float, bool]:
    """Mean cost per metre of a straight path through a strip, and whether it is doubtful.

    As ``planner.search.field.cost_field.segment_cost``, but linear between the samples of
    ``_sample_strip``. Between two closed samples the mean is infinite: to price such paths closely,
    point by point, was half the work among obstacles.

    Args:
        gentle, reach: of the CostField.
        slopes, ground, doubtful, closed: of ``_sample_strip``.
        first, last: columns of the samples at which the path begins and ends.
        ux, uy: direction of the path.
        wind: J/m that wind adds to it.
    """
    scale = 0.5 * (GENTLE - 1) / reach
    rows, columns = ground.shape
    total = 0.0
    inexact = False
    for r in range(rows):
        w = (r + 0.5) / rows
        f = (1.0 - w) * first + w * last
        c = min(int(f), columns - 2)
        f -= c
        if closed[r, c] and closed[r, c + 1]:
            return np.inf, False
        inexact |= doubtful[r, c] | doubtful[r, c + 1]
        px = (1.0 - f) * slopes[r, c, 0] + f * slopes[r, c + 1, 0]
        py = (1.0 - f) * slopes[r, c, 1] + f * slopes[r, c + 1, 1]
        u = (px * ux + py * uy + reach) * scale
        v = (py * ux - px * uy + reach) * scale
        a, b = int(u), int(v)
        u -= a
        v -= b
        g = ground[r, c]
        cost = (gentle[g, a, b] * (1.0 - u) + gentle[g, a + 1, b] * u) * (1.0 - v) + (
            gentle[g, a, b + 1] * (1.0 - u) + gentle[g, a + 1, b + 1] * u
        ) * v
        total += max(cost + wind, LEAST_COST)
    return total / rows, inexact


@njit(cache=True, error_model="numpy", nogil=True)
def band(field: Any, path: Any, delta: float, side: int, step: float) -> Any:
    """Waypoints (count, 2) moved across the path by multiples of ``delta``, at the least cost."""
    count = path.shape[0]
    wide = 2 * side + 1
    ny, nx = field.heights.shape
    west, east = field.x0 - 0.5 * field.dx, field.x0 + (nx - 0.5) * field.dx
    south, north = field.y0 - 0.5 * field.dy, field.y0 + (ny - 0.5) * field.dy
    xs = np.empty((count, wide))
    ys = np.empty((count, wide))
    for k in range(count):
        a, b = max(0, k - 1), min(count - 1, k + 1)
        tx, ty = path[b, 0] - path[a, 0], path[b, 1] - path[a, 1]
        length = math.sqrt(tx * tx + ty * ty) + 1e-12
        for m in range(wide):
            offset = (m - side) * delta if 0 < k < count - 1 else 0.0
            xs[k, m] = min(max(path[k, 0] - ty / length * offset, west), east)
            ys[k, m] = min(max(path[k, 1] + tx / length * offset, south), north)
    gentle, reach = field.gentle, field.reach
    windy = field.extra[0] != 0.0 or field.extra[DIRECTIONS // 4] != 0.0
    wind = 0.0
    parts = int(math.ceil(delta / step - 1e-9))
    # By piece, offset at its end, and change of offset.
    price = np.full((count - 1, wide, 2 * MOST_CHANGE + 1), np.inf)
    inexact = np.zeros(price.shape, np.bool_)
    for k in range(count - 1):
        span = math.hypot(path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1])
        rows = max(1, int(math.ceil(span / step)))
        slopes = np.empty((rows, (wide - 1) * parts + 1, 2))
        ground = np.empty(slopes.shape[:2], np.uint8)
        doubtful = np.empty(slopes.shape[:2], np.bool_)
        closed = np.empty(slopes.shape[:2], np.bool_)
        _sample_strip(field, xs[k : k + 2], ys[k : k + 2], parts, slopes, ground, doubtful, closed)
        for m in range(wide):
            if k + 1 == count - 1 and m != side:
                continue
            for q in range(max(0, m - MOST_CHANGE), min(wide, m + MOST_CHANGE + 1)):
                if k == 0 and q != side:
                    continue
                ex, ey = xs[k + 1, m] - xs[k, q], ys[k + 1, m] - ys[k, q]
                length = math.sqrt(ex * ex + ey * ey) + 1e-12
                if windy:
                    wind = wind_cost(field, math.atan2(ey, ex))
                each, inexact[k, m, q - m + MOST_CHANGE] = _across(
                    *(gentle, reach, slopes, ground, doubtful, closed),
                    *(float(q * parts), float(m * parts)),
                    *(ex / length, ey / length, wind),
                )
                price[k, m, q - m + MOST_CHANGE] = each * length
    # Only what seems to be the best is looked at closely where that is called for.
    chosen = np.empty(count, np.int64)
    settled = False
    while not settled:
        total = _least_offsets(price, side, chosen)
        settled = True
        for k in range(count - 1 if total < np.inf else 0):
            q, m = chosen[k], chosen[k + 1]
            if inexact[k, m, q - m + MOST_CHANGE]:
                inexact[k, m, q - m + MOST_CHANGE] = settled = False
                price[k, m, q - m + MOST_CHANGE] = segment_cost(
                    field, xs[k, q], ys[k, q], xs[k + 1, m], ys[k + 1, m], step
                )
    result = np.empty((count, 2))
    for k in range(count):
        result[k, 0], result[k, 1] = xs[k, chosen[k]], ys[k, chosen[k]]
    return result, total


@njit(cache=True, error_model="numpy")
def _least_offsets(price: Any, side: int, chosen: Any) -> float:
    """Least sum of prices from the middle offset to the middle offset; ``chosen`` says how.

    Args:
        price: (pieces, offsets, changes) by piece, offset at its end, and change of offset.
        side: number of the middle offset.
        chosen: (pieces + 1,) written: offsets, those in the middle where there is no way.
    """
    pieces, wide, changes = price.shape
    cost, came = np.full((pieces + 1, wide), np.inf), np.full((pieces + 1, wide), side)
    cost[0, side] = 0.0
    for k in range(pieces):
        for m in range(wide):
            for c in range(changes):
                q = m + c - changes // 2
                if 0 <= q < wide and cost[k, q] + price[k, m, c] < cost[k + 1, m]:
                    cost[k + 1, m], came[k + 1, m] = cost[k, q] + price[k, m, c], q
    at = side
    for k in range(pieces, -1, -1):
        chosen[k] = at
        at = came[k, at]
    total: float = cost[pieces, side]
    return total


def moved_in_bands(
    field: CostField, waypoints: Array, cell: float, check: Callable[[], None]
) -> tuple[float, Array]:
    """Cost and waypoints after all bands; a band that raises the final cost is undone."""
    cost = polyline_cost(field, waypoints, field.step)
    for delta, side, coarse in BANDS:
        check()
        found, _ = band(field, waypoints, delta * cell, side, coarse * field.step)
        lower = polyline_cost(field, found, field.step)
        if lower < cost:
            cost, waypoints = lower, found
    return cost, waypoints


def refine(
    field: CostField,
    path: Array,
    *,
    penalties: Sequence[float] = (0.0,),
    waypoint_cells: float = 8.0,
    check: Callable[[], None] = lambda: None,
) -> list[tuple[Array, float]]:
    """The cheapest polyline found near a path for each corner penalty, with its cost without it.

    Args:
        field: map and costs.
        path: (k, 2) polyline whose cost is finite.
        penalties: corner penalties: what a corner costs, which the costs of a metre do not contain.
        waypoint_cells: distance of the waypoints.
        check: called between rounds; may raise to stop.
    """
    cell = min(field.dx, field.dy)
    step = field.step
    spacing = waypoint_cells * cell
    if field.blocked.any():
        starts = [even_where_free(field, path, spacing)]
    else:
        starts = [even(path, spacing)]
        if not math.isfinite(polyline_cost(field, starts[0], field.step)):
            # Cutting corners led onto ground too steep. The band may lead out of it again, or not.
            starts.append(resample(path, spacing))
    _, waypoints = min(
        (moved_in_bands(field, start, cell, check) for start in starts), key=lambda one: one[0]
    )
    check()
    known = [(polyline_cost(field, candidate, step), candidate) for candidate in (path, waypoints)]
    found = []
    for corner_penalty, shorter in zip(
        penalties, shortcuts(field, waypoints, penalties), strict=True
    ):
        candidates = [*known, (polyline_cost(field, shorter, step), shorter)]
        cost, best = min(candidates, key=lambda pair: pair[0] + corner_penalty * len(pair[1]))
        found.append((best, float(cost)))
    return found
