"""What is worked out once for each log, however often it is asked for.

    readings = per_log(log, "readings", lambda: worked_out(log))

A log does not change once it is made. What belongs to it goes when the log goes.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from planner.telemetry.logs import Telemetry

T = TypeVar("T")
_KEPT: WeakKeyDictionary[Telemetry, dict[Hashable, Any]] = WeakKeyDictionary()


def per_log(log: Telemetry, key: Hashable, work: Callable[[], T]) -> T:
    """What ``work`` gave when it was called for this log and key; it is not to be written to."""
    kept = _KEPT.setdefault(log, {})
    if key not in kept:
        kept[key] = work()
    found: T = kept[key]
    return found
