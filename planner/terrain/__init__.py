"""Terrain: heights with their gradient, obstacles, ground classes, file formats, the catalogue.

terrain = open_map("cone")                       # or a path to a heightmap
terrain.height(3.0, 4.0), terrain.gradient(3.0, 4.0)
"""

from planner.terrain.catalogue import list_maps, open_map

__all__ = ["list_maps", "open_map"]
