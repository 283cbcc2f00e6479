"""How long jobs take, measured, and so when a full queue has room again."""

from __future__ import annotations

import math
from collections import deque

_REMEMBERED = 50
"""Jobs that the mean is over: enough to be steady, few enough to follow a change of load."""
_UNKNOWN_S = 1.0
"""What a job is taken to need before one was measured, s."""


class Pace:
    """Mean duration of the last jobs.

    Args:
        side_by_side: how many jobs run at the same time.
    """

    def __init__(self, side_by_side: int) -> None:
        self._side_by_side = side_by_side
        self._seconds: deque[float] = deque(maxlen=_REMEMBERED)

    def add(self, seconds: float) -> None:
        """Remember how long a job ran."""
        self._seconds.append(seconds)

    def retry_after_s(self, present: int) -> int:
        """Whole seconds, at least 1, after which so many jobs should be done."""
        taken = self._seconds
        mean = sum(taken) / len(taken) if taken else _UNKNOWN_S
        return max(1, math.ceil(mean * present / self._side_by_side))
