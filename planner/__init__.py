"""joulepath: routes that cost a wheeled robot least energy, with the account by physical effect.

from planner import plan_route
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner import compiled_code as _compiled_code

if TYPE_CHECKING:
    from planner.search.plan import plan_route
    from planner.search.request import PlanRequest
    from planner.search.route import Answer, Route

__all__ = ["Answer", "PlanRequest", "Route", "plan_route"]
__version__ = "0.1.0"

_compiled_code.settle()

_HOMES = {
    "plan_route": "planner.search.plan",
    "PlanRequest": "planner.search.request",
    "Answer": "planner.search.route",
    "Route": "planner.search.route",
}


def __getattr__(name: str) -> Any:
    # Loaded when asked for: a command that only lists maps need not load numba and OMPL.
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'planner' has no attribute {name!r}")
