"""Areas that a route keeps out of, put on the map as if something stood there.

    terrain = without_areas(terrain, request)

No part of the body enters such an area, nor of its clearance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

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
    for number, area in enumerate(request.avoid):
        covered = terrain.cells_in([area.ring()], touched=True)
        if not covered.any():
            raise RequestError(
                f"avoid[{number}]",
                "covers nothing of the map",
                accepted="a circle or a polygon on the map, in metres",
            )
        obstacles = obstacles | covered
    return replace(terrain, obstacles=np.ascontiguousarray(obstacles))
