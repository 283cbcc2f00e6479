"""Areas that a route keeps out of, put on the map as if something stood there.

    terrain = without_areas(terrain, request.avoid)

No part of the body enters such an area, nor of its clearance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from rasterio import Affine
from rasterio.features import geometry_mask

from planner.errors import RequestError
from planner.search.situation_request import Area
from planner.terrain.heightmap import Terrain

CORNERS = 64
"""Corners of the polygon round a circle."""


def without_areas(terrain: Terrain, areas: Sequence[Area]) -> Terrain:
    """The terrain with the cells that areas touch as obstacles.

    Args:
        terrain: a map.
        areas: circles and polygons in the map's frame, m.

    Raises:
        RequestError: an area has no extent, or lies beside the map altogether.
    """
    obstacles = terrain.obstacles
    (x0, y0), (dx, dy) = terrain.origin, terrain.cell
    place = Affine(dx, 0.0, x0 - 0.5 * dx, 0.0, dy, y0 - 0.5 * dy)
    for number, area in enumerate(areas):
        shape = {"type": "Polygon", "coordinates": [_ring(area)]}
        covered = geometry_mask([shape], obstacles.shape, place, all_touched=True, invert=True)
        if not covered.any():
            raise RequestError(
                f"avoid[{number}]",
                "covers nothing of the map",
                accepted="a circle or a polygon on the map, in metres",
            )
        obstacles = obstacles | covered
    return replace(terrain, obstacles=np.ascontiguousarray(obstacles))


def _ring(area: Area) -> list[tuple[float, float]]:
    """Corners of an area, the first one again at the end."""
    if area.polygon is not None:
        corners = [(float(x), float(y)) for x, y in area.polygon]
    else:
        assert area.x is not None  # checked with the request
        assert area.y is not None
        assert area.radius is not None
        # Round the circle, so that nothing of it is left out.
        reach = area.radius / math.cos(math.pi / CORNERS)
        angles = 2.0 * math.pi * (np.arange(CORNERS) + 0.5) / CORNERS
        corners = [
            (area.x + reach * math.cos(angle), area.y + reach * math.sin(angle)) for angle in angles
        ]
    return [*corners, corners[0]]
