"""Moves the waypoints of a path until it costs less: by the cost field, then by motions.

[(path, cost)] = refine(field, path, tolls=[toll], knot_cells=4.0)
better = polish(field, around, legs, yaws)               # Driven
"""

from planner.search.waypoints.path_smoothing import VARIANTS, even, refine
from planner.search.waypoints.waypoint_descent import (
    Driven,
    drive_roughly,
    hindered,
    polish,
    worth_polishing,
)

__all__ = [
    "VARIANTS",
    "Driven",
    "drive_roughly",
    "even",
    "hindered",
    "polish",
    "refine",
    "worth_polishing",
]
