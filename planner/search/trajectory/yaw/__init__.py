"""The best yaw along a track: where it is decided, which angles are free, what moves cost.

search = YawSearch(conditions, field, track, steps, ...)
search.best()                              # YawProfile, or the place that it does not pass
"""

from planner.search.trajectory.yaw.free_yaws import core_of, crowded_at
from planner.search.trajectory.yaw.yaw_moves import SURROUNDINGS, Surroundings
from planner.search.trajectory.yaw.yaw_profile import YawProfile, YawSearch, waypoints_along

__all__ = [
    "SURROUNDINGS",
    "Surroundings",
    "YawProfile",
    "YawSearch",
    "core_of",
    "crowded_at",
    "waypoints_along",
]
