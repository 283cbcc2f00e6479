"""OMPL's planners over the cost field, in the plane.

    result = solve(Tube(field, path, cheapest), seed=0, seconds=2.0, ...)

OMPL is slow to import: import this room only where it is used.
"""

from planner.search.ompl.objective import DissipatedEnergy, Driveable, Plane, Tube, WholeMap
from planner.search.ompl.planner import solve

__all__ = [
    "DissipatedEnergy",
    "Driveable",
    "Plane",
    "Tube",
    "WholeMap",
    "solve",
]
