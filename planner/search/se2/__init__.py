"""Search in x, y and yaw at once: paths along which the body can turn in time.

path = pose_path(situation, field, "energy", start, goal, stop=stop)
"""

from planner.search.se2.hybrid_search import (
    PoseLimits,
    PosePath,
    keeping_yaw,
    pose_path,
)
from planner.search.se2.pose_costs import ANGLE

__all__ = [
    "ANGLE",
    "PoseLimits",
    "PosePath",
    "keeping_yaw",
    "pose_path",
]
