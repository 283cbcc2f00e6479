"""Work away from the event loop: worker processes, what runs in them, and jobs that take long."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from service.jobs.names import Names
    from service.jobs.pool import WorkerPool, Workers
    from service.jobs.runner import Runner

__all__ = ["Names", "Runner", "WorkerPool", "Workers"]


def __getattr__(name: str) -> Any:
    # Loaded when asked for: a fresh worker process loads service.jobs.process alone.
    if name == "Names":
        from service.jobs.names import Names

        return Names
    if name == "Runner":
        from service.jobs.runner import Runner

        return Runner
    if name in ("WorkerPool", "Workers"):
        from service.jobs import pool

        return getattr(pool, name)
    raise AttributeError(f"module 'service.jobs' has no attribute {name!r}")
