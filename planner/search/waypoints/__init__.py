"""Moves the waypoints of a path until it costs less: by the cost field, then by motions.

[(path, cost)] = refine(field, path, tolls=[toll], waypoint_cells=4.0)
better = optimise_waypoints(field, conditions, legs, yaws)               # Driven
"""

from planner.search.waypoints.path_smoothing import VARIANTS, even, refine
from planner.search.waypoints.waypoint_descent import (
    Driven,
    drive_roughly,
    optimise_waypoints,
    suggests_detour,
    worth_optimising,
)

__all__ = [
    "VARIANTS",
    "Driven",
    "drive_roughly",
    "even",
    "optimise_waypoints",
    "refine",
    "suggests_detour",
    "worth_optimising",
]
