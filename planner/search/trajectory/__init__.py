"""From a path to a trajectory within limits: corners, yaw profile, speed profile, in this order.

motion = move(field, conditions, legs, yaws)    # Motion, or Infeasible that says where
"""

from planner.search.trajectory.drive import CLOSELY, ROUGHLY, move, moved_alike
from planner.search.trajectory.limit_use import limits_used
from planner.search.trajectory.motion import Motion, motion_rows, shares_driven

__all__ = [
    "CLOSELY",
    "ROUGHLY",
    "Motion",
    "limits_used",
    "motion_rows",
    "move",
    "moved_alike",
    "shares_driven",
]
