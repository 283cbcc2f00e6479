"""Energies of many routes between places, for matrices and reachable areas.

leg = driven_leg(situation, field, path, yaws, token=token)
"""

from planner.search.legs.reach_calibration import EdgeRoutes
from planner.search.legs.single_leg import driven_leg

__all__ = [
    "EdgeRoutes",
    "driven_leg",
]
