"""joulepath: routes that cost a wheeled robot least energy, with the account by physical effect.

from planner import plan_route, Telemetry, compare, diagnose, adopt
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any

from planner import compiled_code as _compiled_code
from planner import shown as _shown

if TYPE_CHECKING:
    from planner.power.model import PowerModel
    from planner.search.front import Front, energy_time_front
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
    "energy_matrix",
    "energy_time_front",
    "plan_route",
    "reachable_area",
    "revert",
]
__version__ = "0.1.0"

_compiled_code.settle()


def _report() -> _shown.Renderer:
    from planner import report

    return report


_shown.register(_report)


def __getattr__(name: str) -> Any:
    home = _home(name)
    if home is None:
        raise AttributeError(f"module 'planner' has no attribute {name!r}")
    return getattr(home, name)


def _home(name: str) -> ModuleType | None:
    # Loaded when asked for: a command that only lists maps need not load numba and OMPL.
    if name == "plan_route":
        from planner.search import plan

        return plan
    if name in ("Front", "energy_time_front"):
        from planner.search import front

        return front
    if name in ("Matrix", "energy_matrix"):
        from planner.search import matrix

        return matrix
    if name in ("Reach", "reachable_area"):
        from planner.search import reach

        return reach
    if name == "PlanRequest":
        from planner.search import requests

        return requests
    if name in ("Answer", "Route"):
        from planner.search import results

        return results
    if name == "PowerModel":
        from planner.power import model

        return model
    if name == "Telemetry":
        from planner.telemetry import logs

        return logs
    if name in ("Comparison", "compare"):
        from planner.telemetry import comparison

        return comparison
    if name in ("Diagnosis", "diagnose"):
        from planner.telemetry import diagnosis

        return diagnosis
    if name in ("Adoption", "adopt", "revert"):
        from planner.telemetry import adoption

        return adoption
    return None
