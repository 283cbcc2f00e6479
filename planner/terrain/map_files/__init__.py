"""Maps in several files: a floor plan, heights beside it, ramps and ground as polygons.

read_map_toml(Path("hall/map.toml"), load_terrain)     # what `load_terrain` calls for a .toml
"""

from planner.terrain.map_files.description import describe_map
from planner.terrain.map_files.map_toml import read_map_toml

__all__ = ["describe_map", "read_map_toml"]
