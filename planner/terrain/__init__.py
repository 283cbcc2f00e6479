"""Terrain: heights with their gradient, obstacles, ground classes, file formats, the catalogue.

terrain = open_map("cone")                       # or a path to a heightmap
terrain.height(3.0, 4.0), terrain.gradient(3.0, 4.0)

Eight names rather than six, because compiled loops call ``interpolate``, ``interpolate_many`` and
``rectangle_free`` themselves.
"""

from planner.terrain.catalogue import list_maps, open_map
from planner.terrain.heightmap import Terrain
from planner.terrain.interpolation import interpolate, interpolate_many
from planner.terrain.obstacles import rectangle_free, yaw_mask
from planner.terrain.surface import GroundClass

__all__ = [
    "GroundClass",
    "Terrain",
    "interpolate",
    "interpolate_many",
    "list_maps",
    "open_map",
    "rectangle_free",
    "yaw_mask",
]
