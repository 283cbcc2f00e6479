"""Routes that truly differ from the best one.

The ground along the routes that are there already is made dearer, and the search runs again. A
candidate counts when at most ``MOST_OVERLAP`` of it runs near an earlier route and it costs at most
``MOST_EXTRA`` more; after a few refusals in a row there is nothing more to find.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from planner.search.ground import CostField
from planner.search.route import Route

Array = NDArray[np.float64]
MOST_OVERLAP = 0.6
MOST_EXTRA = 0.5
NEAR_CELLS = 6.0


def find_alternatives(
    best: Route, count: int, search: Callable[[Array], Route | None], field: CostField
) -> tuple[tuple[Route, ...], str | None]:
    """Up to ``count`` routes, best first, and a sentence where there are fewer.

    Args:
        best: the route that is there.
        count: how many are wanted in all.
        search: plans with a factor (ny, nx) on the cost of the ground.
        field: map, for its geometry.
    """
    routes = [best]
    factor = np.ones(field.heights.shape)
    dear = similar = 0
    for _ in range(3 * count):
        if len(routes) == count:
            break
        factor = factor * (1.0 + 0.4 * _nearness(routes[-1], field))
        candidate = search(factor)
        if candidate is None:
            break
        if candidate.energy_j > best.energy_j + MOST_EXTRA * abs(best.energy_j):
            dear += 1
            factor = factor * (1.0 + 0.4 * _nearness(candidate, field))
        elif max(_overlap(candidate, route, field) for route in routes) > MOST_OVERLAP:
            similar += 1
            factor = factor * (1.0 + 0.4 * _nearness(candidate, field))
        else:
            routes.append(candidate)
    routes.sort(key=lambda route: route.energy_j)
    if len(routes) == count:
        return tuple(routes), None
    return tuple(routes), (
        f"{len(routes)} of {count} routes: of the others found, {similar} ran more than "
        f"{MOST_OVERLAP:.0%} along an earlier one and {dear} cost over {MOST_EXTRA:.0%} more"
    )


def _cells(route: Route, field: CostField) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    ny, nx = field.heights.shape
    i = np.clip(np.round((route.arrays["x"] - field.x0) / field.dx), 0, nx - 1).astype(np.int64)
    j = np.clip(np.round((route.arrays["y"] - field.y0) / field.dy), 0, ny - 1).astype(np.int64)
    return j, i


def _distance(route: Route, field: CostField) -> Array:
    """Cells to the route, (ny, nx)."""
    away = np.ones(field.heights.shape, bool)
    away[_cells(route, field)] = False
    return np.asarray(ndimage.distance_transform_edt(away))


def _nearness(route: Route, field: CostField) -> Array:
    """1 on the route, 0 from ``NEAR_CELLS`` on, and 0 round its ends, which all routes share."""
    near = np.clip(1.0 - _distance(route, field) / NEAR_CELLS, 0.0, 1.0)
    j, i = _cells(route, field)
    for a, b in ((j[0], i[0]), (j[-1], i[-1])):
        rows, columns = np.ogrid[: near.shape[0], : near.shape[1]]
        near[(rows - a) ** 2 + (columns - b) ** 2 < (2.0 * NEAR_CELLS) ** 2] = 0.0
    return near


def _overlap(route: Route, other: Route, field: CostField) -> float:
    """Share of a route's length that runs near another."""
    near = _distance(other, field)[_cells(route, field)] <= NEAR_CELLS
    lengths = np.diff(route.distance_m)
    return float((lengths * near[1:]).sum() / max(lengths.sum(), 1e-9))
