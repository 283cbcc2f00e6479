"""Terrain: heights with their gradient, obstacles, ground classes, file formats, the catalogue."""

from planner.terrain.catalogue import list_maps, open_map
from planner.terrain.formats import load_terrain
from planner.terrain.heightmap import Terrain, interpolate
from planner.terrain.obstacles import blocked_cells, rectangle_free, why_blocked, yaw_mask
from planner.terrain.surface import GroundClass

__all__ = [
    "GroundClass",
    "Terrain",
    "blocked_cells",
    "interpolate",
    "list_maps",
    "load_terrain",
    "open_map",
    "rectangle_free",
    "why_blocked",
    "yaw_mask",
]
