"""Linear algebra on one core, while a log is examined.

    @single_core()
    def diagnose(...): ...

Matrices of a log are tall and narrow. A library of linear algebra starts a thread per core for each
product, and these threads wait longer than they work. The cores are worth more to whole predictions
(planner.telemetry.prediction) and to other processes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def single_core() -> Iterator[None]:
    """One core inside, as many as before outside. Of several threads inside, the first decides."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield
