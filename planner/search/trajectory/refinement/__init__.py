"""Refinement of a motion that keeps all limits: its yaw in rounds, then its speeds.

motion = refined_motion(field, conditions, track, steps, yaw, motion, fixed, at_speed, rounds=6)
"""

from planner.search.trajectory.refinement.rounds import refined_motion

__all__ = ["refined_motion"]
