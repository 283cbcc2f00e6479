"""Questions for OMPL's planners on small maps."""

from __future__ import annotations

from planner.search.ompl import EnergyProblem
from tests.search.maps import hills, terrain

ENDS = {"start": {"x": 3.0, "y": 3.0}, "goal": {"x": 20.0, "y": 18.0}}
RELIEF = terrain(hills(96, rms_degrees=5.0))


def problem(space: str = "plane", **fields) -> EnergyProblem:
    """From corner to corner over hills of 24 m."""
    return EnergyProblem(space, **{"terrain": RELIEF, **ENDS, **fields})
