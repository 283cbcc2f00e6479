"""Energies of many routes between places, for matrices and reachable areas.

leg = LegPlanner(situation, field, token).near(path, yaws)
"""

from planner.search.legs.reach_calibration import EdgeRoutes
from planner.search.legs.single_leg import LegPlanner

__all__ = [
    "EdgeRoutes",
    "LegPlanner",
]
