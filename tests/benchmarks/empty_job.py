"""A worker that has all of the planner loaded, and a job in which nothing is done."""

from __future__ import annotations

import time

import service.jobs.worker

__all__ = ["cpu_s", "service"]


def cpu_s() -> float:
    """CPU seconds that this process took until its job began."""
    return time.process_time()
