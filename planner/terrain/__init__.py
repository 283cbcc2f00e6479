"""Terrain: heights with their gradient, obstacles, ground classes, file formats, the catalogue.

terrain = open_map("cone")                       # or a path to a heightmap
terrain.height(3.0, 4.0), terrain.gradient(3.0, 4.0)

Eight names rather than six, because compiled loops call ``interpolate``, ``interpolate_many`` and
``rectangle_free`` themselves.
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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


def __getattr__(name: str) -> Any:
    home: ModuleType
    # Loaded when asked for: a list of maps needs no compiler.
    match name:
        case "list_maps" | "open_map":
            from planner.terrain import catalogue as home
        case "Terrain":
            from planner.terrain import heightmap as home
        case "interpolate" | "interpolate_many":
            from planner.terrain import interpolation as home
        case "rectangle_free" | "yaw_mask":
            from planner.terrain import obstacles as home
        case "GroundClass":
            from planner.terrain import surface as home
        case _:
            raise AttributeError(f"module 'planner.terrain' has no attribute {name!r}")
    return getattr(home, name)
