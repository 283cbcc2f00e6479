"""Yaw asked for at a place of a route: free, one angle, or several one after the other.

wanted = as_wanted([0.0, 1.5])          # arrive with the first, leave with the last
arriving(wanted), leaving(wanted)
"""

from __future__ import annotations

from collections.abc import Sequence

Wanted = float | tuple[float, ...] | None
"""Yaw asked for at a place, rad: None is free; of several, one after the other on the spot."""


def as_wanted(yaws: Sequence[float]) -> Wanted:
    """The yaw angles asked for at one place, in rad and in this order, as ``move`` takes them."""
    if len(yaws) > 1:
        return tuple(yaws)
    return yaws[0] if yaws else None


def arriving(wanted: Wanted) -> float | None:
    """Yaw to arrive with, rad."""
    return wanted[0] if isinstance(wanted, tuple) else wanted


def leaving(wanted: Wanted) -> float | None:
    """Yaw to go on with, rad."""
    return wanted[-1] if isinstance(wanted, tuple) else wanted
