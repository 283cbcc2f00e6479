"""From a path to a trajectory within limits: corners, yaw profile, speed profile, in this order.

motion = move(field, conditions, legs, yaws, objective=0)    # Motion, or Infeasible that says where
"""

from planner.search.trajectory.drive import CLOSELY, ROUGHLY, Care, move
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.trajectory.motion import Motion, motion_rows
from planner.search.trajectory.turn_on_the_spot import Infeasible

__all__ = [
    "CLOSELY",
    "ROUGHLY",
    "Care",
    "Infeasible",
    "Motion",
    "broken_limits",
    "motion_rows",
    "move",
]
