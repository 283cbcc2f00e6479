"""Search in x, y and yaw at once: paths along which the body can turn in time.

path = pose_path(situation, field, "energy", start, goal, stop=stop)
"""

from planner.search.se2.hybrid_search import MOST_EXPANDED, PosePath, keeping_yaw, pose_path

__all__ = [
    "MOST_EXPANDED",
    "PosePath",
    "keeping_yaw",
    "pose_path",
]
