"""Routes that truly differ from the best one.

The ground along the routes that are there already is made dearer, and the search runs again. A
candidate counts when at most ``MOST_OVERLAP`` of it runs near an earlier route and it costs at most
``MOST_EXTRA`` more; after a few refusals in a row there is nothing more to find. Cost is what the
request asks for: J, s or m. Near is six cells, but at least what separates two ways for a robot and
at most what separates two ways for a driver who looks at a map.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.results import Route

MOST_OVERLAP = 0.6
"""Share of its length that an alternative may have in common with an earlier route."""
NEAR_COSTS = 0.4
"""Share by which ground on an earlier route costs more; it fades to none where routes count as two.
"""
MOST_EXTRA = 0.5
"""Share of the best route's cost by which an alternative may cost more."""
NEAR_CELLS = 6.0
"""Cells within which two routes count as one."""
LEAST_NEAR, MOST_NEAR = 1.5, 60.0
"""m, bounds of the distance of ``NEAR_CELLS`` cells."""
LEAST_CELLS = 2.0
"""The upper bound does not hold below this: coarser cells cannot separate routes."""


Line = tuple[Array, Array]
"""x and y (n,) of the samples of a route, m."""


def _energy(route: Route) -> float:
    return route.energy_j


def find_alternatives(
    best: Route,
    count: int,
    search: Callable[[Array], Route | None],
    field: CostField,
    value: Callable[[Route], float] = _energy,
) -> tuple[tuple[Route, ...], str | None]:
    """Up to ``count`` routes, best by ``value`` first, and a sentence where there are fewer.

    Args:
        best: the route that is there.
        count: how many are wanted in all.
        search: plans with a factor (ny, nx) on the cost of the ground.
        field: map, for its geometry.
        value: of a route, what the request wants little of.
    """
    routes = [best]
    factor = np.ones(field.heights.shape)
    expensive = similar = 0
    for _ in range(3 * count):
        if len(routes) == count:
            break
        factor = factor * (1.0 + NEAR_COSTS * nearness(_line(routes[-1]), field))
        candidate = search(factor)
        if candidate is None:
            break
        if value(candidate) > value(best) + MOST_EXTRA * abs(value(best)):
            expensive += 1
            factor = factor * (1.0 + NEAR_COSTS * nearness(_line(candidate), field))
        elif max(_overlap(candidate, route, field) for route in routes) > MOST_OVERLAP:
            similar += 1
            factor = factor * (1.0 + NEAR_COSTS * nearness(_line(candidate), field))
        else:
            routes.append(candidate)
    routes.sort(key=value)
    if len(routes) == count:
        return tuple(routes), None
    return tuple(routes), (
        f"{len(routes)} of {count} routes: of the others found, {similar} ran more than "
        f"{MOST_OVERLAP:.0%} along an earlier one and {expensive} cost over {MOST_EXTRA:.0%} more"
    )


def _line(route: Route) -> Line:
    return route.arrays["x"], route.arrays["y"]


def _cells(line: Line, field: CostField) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    ny, nx = field.heights.shape
    i = np.clip(np.round((line[0] - field.x0) / field.dx), 0, nx - 1).astype(np.int64)
    j = np.clip(np.round((line[1] - field.y0) / field.dy), 0, ny - 1).astype(np.int64)
    return j, i


def _near(field: CostField) -> float:
    """m within which two routes count as one."""
    cell = max(field.dx, field.dy)
    return min(max(NEAR_CELLS * cell, LEAST_NEAR), max(MOST_NEAR, LEAST_CELLS * cell))


def _distance(line: Line, field: CostField) -> Array:
    """Metres to the line, (ny, nx)."""
    away = np.ones(field.heights.shape, bool)
    away[_cells(line, field)] = False
    return np.asarray(ndimage.distance_transform_edt(away, sampling=(field.dy, field.dx)))


def nearness(line: Line, field: CostField) -> Array:
    """1 on a route's x and y, 0 from ``_near`` on, and 0 round its ends, which all routes share."""
    reach = _near(field)
    near = np.clip(1.0 - _distance(line, field) / reach, 0.0, 1.0)
    j, i = _cells(line, field)
    for a, b in ((j[0], i[0]), (j[-1], i[-1])):
        rows, columns = np.ogrid[: near.shape[0], : near.shape[1]]
        apart = np.hypot(field.dy * (rows - a), field.dx * (columns - b))
        near[apart < 2.0 * reach] = 0.0
    return near


def _overlap(route: Route, other: Route, field: CostField) -> float:
    """Share of a route's length that runs near another."""
    near = _distance(_line(other), field)[_cells(_line(route), field)] <= _near(field)
    lengths = np.diff(route.distance_m)
    return float((lengths * near[1:]).sum() / max(lengths.sum(), 1e-9))
