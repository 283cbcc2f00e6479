"""joulepath: routes that cost a wheeled robot least energy, with the account by physical effect.

from planner import plan_route, Telemetry, compare, diagnose, adopt
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any

from planner import shown as _shown

if TYPE_CHECKING:
    from planner.power.model import PowerModel
    from planner.search.front import Front, energy_time_front
    from planner.search.graph import EnergyGraph, energy_graph
    from planner.search.matrix import Matrix, energy_matrix
    from planner.search.plan import plan_route
    from planner.search.reach import Reach, reachable_area
    from planner.search.requests import PlanRequest
    from planner.search.results import Answer, Route
    from planner.telemetry.adoption import Adoption, adopt, revert
    from planner.telemetry.comparison import Comparison, compare
    from planner.telemetry.diagnosis import Diagnosis, diagnose
    from planner.telemetry.logs import Telemetry

__all__ = [
    "Adoption",
    "Answer",
    "Comparison",
    "Diagnosis",
    "EnergyGraph",
    "Front",
    "Matrix",
    "PlanRequest",
    "PowerModel",
    "Reach",
    "Route",
    "Telemetry",
    "adopt",
    "compare",
    "diagnose",
    "energy_graph",
    "energy_matrix",
    "energy_time_front",
    "plan_route",
    "reachable_area",
    "revert",
]
__version__ = "0.1.0"


def _report() -> _shown.Renderer:
    from planner import report

    return report


_shown.register(_report)


def __getattr__(name: str) -> Any:
    home: ModuleType
    # Loaded when asked for: a command that only lists maps need not load numba and OMPL.
    match name:
        case "plan_route":
            from planner.search import plan as home
        case "Front" | "energy_time_front":
            from planner.search import front as home
        case "EnergyGraph" | "energy_graph":
            from planner.search import graph as home
        case "Matrix" | "energy_matrix":
            from planner.search import matrix as home
        case "Reach" | "reachable_area":
            from planner.search import reach as home
        case "PlanRequest":
            from planner.search import requests as home
        case "Answer" | "Route":
            from planner.search import results as home
        case "PowerModel":
            from planner.power import model as home
        case "Telemetry":
            from planner.telemetry import logs as home
        case "Comparison" | "compare":
            from planner.telemetry import comparison as home
        case "Diagnosis" | "diagnose":
            from planner.telemetry import diagnosis as home
        case "Adoption" | "adopt" | "revert":
            from planner.telemetry import adoption as home
        case _:
            raise AttributeError(f"module 'planner' has no attribute {name!r}")
    return getattr(home, name)
