"""Work away from the event loop: worker processes, what runs in them, and jobs that take long."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from service.jobs.names import Names
    from service.jobs.outcomes import Catalogues
    from service.jobs.pool import WorkerPool, Workers
    from service.jobs.runner import Runner

__all__ = ["Catalogues", "Names", "Runner", "WorkerPool", "Workers"]


def __getattr__(name: str) -> Any:
    home: ModuleType
    # Loaded when asked for: a fresh worker process loads service.jobs.process alone.
    match name:
        case "Catalogues":
            from service.jobs import outcomes as home
        case "Names":
            from service.jobs import names as home
        case "Runner":
            from service.jobs import runner as home
        case "WorkerPool" | "Workers":
            from service.jobs import pool as home
        case _:
            raise AttributeError(f"module 'service.jobs' has no attribute {name!r}")
    return getattr(home, name)
