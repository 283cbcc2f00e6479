"""Refinement: from a path on the grid, or from OMPL, to the best polyline in its neighbourhood.

    [(path, cost)] = refine(field, path, tolls=[toll])

    band        move every knot across the path, a row of offsets each, and choose the cheapest
                combination (dynamic programming over the rows), with ever finer offsets
    shortcut    keep only the knots that pay for themselves (exact dynamic programming)

Both minimise the same yaw-free cost as the search (planner.search.ground), so a grid of 16
directions loses nothing in the end that a local change could win back. What a bend costs (turning
the body, slowing down, fighting a sideways force) is no part of that cost; a toll for each corner
stands for it, or else refinement buys a tenth of a per mille on the straight with corners that cost
a per cent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.search.ground import CostField, polyline_cost, segment_cost

Path = NDArray[np.float64]

VARIANTS = {4.0: (1.0,), 8.0: (1.0, 0.1)}
"""Shares of the toll by the distance of knots in cells, to choose from once they are driven: close
knots bend round an obstacle, wide ones stay smooth, and evenly round ways have cheap corners."""
REACH, LONG = 30, 500
"""Knots that a shortcut may leave out; half of that on paths of more knots than LONG."""
COARSE = 2.0
"""So much further apart than for the final cost are the points that pieces are priced at while
there are many to choose from."""
BANDS = ((2.0, 5, 5, COARSE), (0.7, 5, 6, COARSE), (0.25, 4, 8, 1.0))
"""Offset step in cells, offsets to each side, largest change of offset between knots, and how much
further apart the points are that a piece is priced at."""


def resample(path: Path, spacing: float) -> Path:
    """The same polyline with its corners kept and no piece longer than ``spacing``."""
    pieces = [path[:1]]
    for a, b in zip(path[:-1], path[1:], strict=True):
        count = max(1, math.ceil(float(np.hypot(*(b - a))) / spacing - 1e-9))
        pieces.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    return np.vstack(pieces)


def even(path: Path, spacing: float) -> Path:
    """Points at even distances along the polyline; corners are cut, ends are kept."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    count = max(1, round(along[-1] / spacing))
    at = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(at, along, path[:, k]) for k in (0, 1)])


@njit(cache=True, error_model="numpy", nogil=True)
def _straight(field: Any, path: Any, reach: int, step: float) -> Any:
    """Cost of the straight way to every knot from the knots before it, (knots, reach)."""
    count = path.shape[0]
    cost = np.full((count, reach), np.inf)
    for k in range(1, count):
        for back in range(min(reach, k)):
            q = k - 1 - back
            cost[k, back] = segment_cost(
                field, path[q, 0], path[q, 1], path[k, 0], path[k, 1], step
            )
    return cost


@njit(cache=True, error_model="numpy", nogil=True)
def _fewest(straight: Any, toll: float) -> Any:
    """Knots of the cheapest way over a subset of them, each of which costs a toll."""
    count, reach = straight.shape
    cost = np.full(count, np.inf)
    came = np.zeros(count, np.int64)
    cost[0] = 0.0
    for k in range(1, count):
        for back in range(min(reach, k)):
            c = cost[k - 1 - back] + toll + straight[k, back]
            if c < cost[k]:
                cost[k], came[k] = c, k - 1 - back
    kept = np.empty(count, np.int64)
    size, k = 0, count - 1
    while k > 0:
        kept[size] = k
        size += 1
        k = came[k]
    kept[size] = 0
    return kept[: size + 1][::-1].copy(), cost[count - 1]


def shortcuts(field: CostField, path: Path, tolls: Sequence[float]) -> list[Path]:
    """The cheapest polylines over a subset of the knots, each of which costs a toll."""
    whole = polyline_cost(field, path, field.step)
    if not math.isfinite(whole):
        return [path] * len(tolls)
    reach = REACH if len(path) <= LONG else REACH // 2
    straight = _straight(field, path, reach, COARSE * field.step)
    found = []
    for toll in tolls:
        # At least a tiny toll: on even ground a straight line then has no knots at all.
        kept, cost = _fewest(straight, max(toll, 1e-6 * whole))
        found.append(path[kept] if math.isfinite(cost) else path)
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def _band(field: Any, path: Any, delta: float, side: int, window: int, step: float) -> Any:
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
    cost = np.full((count, wide), np.inf)
    came = np.zeros((count, wide), np.int64)
    cost[0, side] = 0.0
    for k in range(count - 1):
        for m in range(wide):
            if k + 1 == count - 1 and m != side:
                continue
            for q in range(max(0, m - window), min(wide, m + window + 1)):
                if cost[k, q] == np.inf:
                    continue
                c = cost[k, q] + segment_cost(
                    field, xs[k, q], ys[k, q], xs[k + 1, m], ys[k + 1, m], step
                )
                if c < cost[k + 1, m]:
                    cost[k + 1, m], came[k + 1, m] = c, q
    result = np.empty((count, 2))
    m = side
    for k in range(count - 1, -1, -1):
        result[k, 0], result[k, 1] = xs[k, m], ys[k, m]
        m = came[k, m]
    return result, cost[count - 1, side]


def _moved(
    field: CostField, knots: Path, cell: float, check: Callable[[], None]
) -> tuple[float, Path]:
    """Cost and knots after all bands, none of which may make the way dearer at its final points."""
    cost = polyline_cost(field, knots, field.step)
    for delta, side, window, coarse in BANDS:
        check()
        found, _ = _band(field, knots, delta * cell, side, window, coarse * field.step)
        lower = polyline_cost(field, found, field.step)
        if lower < cost:
            cost, knots = lower, found
    return cost, knots


def refine(
    field: CostField,
    path: Path,
    *,
    tolls: Sequence[float] = (0.0,),
    knot_cells: float = 8.0,
    check: Callable[[], None] = lambda: None,
) -> list[tuple[Path, float]]:
    """The cheapest polylines found near a path, and their costs without tolls, one for each toll.

    Args:
        field: map and costs.
        path: (k, 2) polyline whose cost is finite.
        tolls: what a corner costs, which the costs of a metre do not contain.
        knot_cells: distance of the knots.
        check: called between rounds; may raise to stop.
    """
    cell = min(field.dx, field.dy)
    step = field.step
    starts = [even(path, knot_cells * cell)]
    if not math.isfinite(polyline_cost(field, starts[0], step)):
        # Cutting corners led where nothing can be driven. The band may lead out of it again, or
        # not; with all corners kept the knots are too close to move far.
        starts.append(resample(path, knot_cells * cell))
    _, knots = min((_moved(field, start, cell, check) for start in starts), key=lambda m: m[0])
    check()
    known = [(polyline_cost(field, candidate, step), candidate) for candidate in (path, knots)]
    found = []
    for toll, shorter in zip(tolls, shortcuts(field, knots, tolls), strict=True):
        candidates = [*known, (polyline_cost(field, shorter, step), shorter)]
        cost, best = min(candidates, key=lambda pair: pair[0] + toll * len(pair[1]))
        found.append((best, float(cost)))
    return found
