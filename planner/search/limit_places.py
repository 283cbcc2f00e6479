"""Where a motion uses a limit most, and where a limit leaves no motion."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class LimitUse:
    """One limit: the largest share used, and where and when; m and s."""

    limit: str
    share: float
    x: float
    y: float
    t: float

    def to_json(self) -> dict[str, Any]:
        """One entry of ``limits``."""
        return asdict(self)


@dataclass(frozen=True)
class Infeasible:
    """Where along a path the robot cannot go on, and why.

    Attributes:
        x, y: m.
        what: in words.
        for_want_of_room: whether a path with more clearance may help.
        limit: by the names that routes give their limits; empty where none is measured.
        value, allowed: what is reached there, and the limit; SI.
        others: x and y of further places on the same path where the robot cannot go on.
    """

    x: float
    y: float
    what: str
    for_want_of_room: bool = False
    limit: str = ""
    value: float = math.nan
    allowed: float = math.nan
    others: tuple[tuple[float, float], ...] = ()

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """All places known."""
        return ((self.x, self.y), *self.others)

    @property
    def too_warm(self) -> bool:
        """Whether motors give too much torque for too long."""
        return self.limit == "torque rms"

    def to_json(self) -> dict[str, Any]:
        """``cause`` of an answer without a route; null where nothing is measured."""
        numbers = {"value": self.value, "allowed": self.allowed, "x": self.x, "y": self.y}
        return {
            "limit": self.limit or None,
            **{name: value if math.isfinite(value) else None for name, value in numbers.items()},
        }
