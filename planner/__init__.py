"""joulepath: routes that cost a wheeled robot least energy, with the account by physical effect.

from planner import plan_route, Telemetry, compare, diagnose, adopt
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner import compiled_code as _compiled_code

if TYPE_CHECKING:
    from planner.power.model import PowerModel
    from planner.search.front import Front, energy_time_front
    from planner.search.matrix import Matrix, energy_matrix
    from planner.search.plan import plan_route
    from planner.search.reach import Reach, reachable_area
    from planner.search.request import PlanRequest
    from planner.search.route import Answer, Route
    from planner.telemetry.adopt import Adoption, adopt, revert
    from planner.telemetry.compare import Comparison, compare
    from planner.telemetry.diagnosis import Diagnosis
    from planner.telemetry.log import Telemetry
    from planner.telemetry.rank_effects import diagnose

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

_HOMES = {
    "plan_route": "planner.search.plan",
    "Front": "planner.search.front",
    "energy_time_front": "planner.search.front",
    "Matrix": "planner.search.matrix",
    "energy_matrix": "planner.search.matrix",
    "Reach": "planner.search.reach",
    "reachable_area": "planner.search.reach",
    "PlanRequest": "planner.search.request",
    "Answer": "planner.search.route",
    "Route": "planner.search.route",
    "PowerModel": "planner.power.model",
    "Telemetry": "planner.telemetry.log",
    "Comparison": "planner.telemetry.compare",
    "compare": "planner.telemetry.compare",
    "Diagnosis": "planner.telemetry.diagnosis",
    "diagnose": "planner.telemetry.rank_effects",
    "Adoption": "planner.telemetry.adopt",
    "adopt": "planner.telemetry.adopt",
    "revert": "planner.telemetry.adopt",
}


def __getattr__(name: str) -> Any:
    # Loaded when asked for: a command that only lists maps need not load numba and OMPL.
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'planner' has no attribute {name!r}")
