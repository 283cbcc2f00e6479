"""Areas that a route keeps out of, put on the map as if something stood there.

    terrain = without_areas(terrain, request)

No part of the body enters such an area, nor of its clearance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rasterio import Affine
from rasterio.features import geometry_mask

from planner.errors import RequestError
from planner.search.requests import SituationRequest
from planner.terrain.heightmap import Terrain


def without_areas(terrain: Terrain, request: SituationRequest) -> Terrain:
    """The terrain with the cells that areas touch as obstacles.

    Args:
        terrain: a map.
        request: with circles and polygons to avoid, in the map's frame, m.

    Raises:
        RequestError: an area has no extent, or lies beside the map altogether.
    """
    obstacles = terrain.obstacles
    (x0, y0), (dx, dy) = terrain.origin, terrain.cell
    place = Affine(dx, 0.0, x0 - 0.5 * dx, 0.0, dy, y0 - 0.5 * dy)
    for number, area in enumerate(request.avoid):
        shape = {"type": "Polygon", "coordinates": [area.ring()]}
        covered = geometry_mask([shape], obstacles.shape, place, all_touched=True, invert=True)
        if not covered.any():
            raise RequestError(
                f"avoid[{number}]",
                "covers nothing of the map",
                accepted="a circle or a polygon on the map, in metres",
            )
        obstacles = obstacles | covered
    return replace(terrain, obstacles=np.ascontiguousarray(obstacles))
