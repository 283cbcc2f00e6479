"""Which limit a slope breaks, by how much, and what would keep it.

cause = limit_on_slope(conditions, kind, slope, x, y)
cause.what + remedy(conditions, cause)
"""

from __future__ import annotations

import math

import numpy as np

from planner.power.motion_row import set_motion
from planner.quantities import STANDARD_GRAVITY
from planner.search.conditions import OperatingConditions
from planner.search.limit_places import Infeasible
from planner.search.resolution import SLOPE_SPEED

YAW_TRIES = 64
"""Yaw angles over a full turn at which a slope is tried."""
_BY_COLUMN = ("wheel load", "current", "voltage", "torque peak", "traction")


def limit_on_slope(
    conditions: OperatingConditions, kind: int, slope: float, x: float, y: float
) -> Infeasible:
    """The limit that driving straight up a slope breaks most, with the yaw that breaks it least.

    Args:
        conditions: model and conditions.
        kind: ground class.
        slope: tan of the angle.
        x, y: m, of the place.
    """
    rows = np.repeat(conditions.class_rows[kind][None], YAW_TRIES, axis=0)
    crawl = SLOPE_SPEED * float(conditions.limits[0])
    for k, row in enumerate(rows):
        set_motion(row, slope, 0.0, 2.0 * math.pi * k / YAW_TRIES, 0.0, crawl)
    _, load, current, voltage, torque, grip = conditions.model.power_and_limits(rows).T
    own = conditions.mass * STANDARD_GRAVITY / len(conditions.model.wheels)
    values = np.column_stack([1.0 - load / own, current, voltage, torque, 1.0 - grip])
    allowed = np.array([1.0, *conditions.limits[1:4], 1.0])
    shares = values / allowed
    best = int(shares.max(axis=1).argmin())
    worst = int(shares[best].argmax())
    return Infeasible(
        x,
        y,
        f"a slope of {math.degrees(math.atan(slope)):.1f}°",
        limit=_BY_COLUMN[worst],
        value=float(values[best, worst]),
        allowed=float(allowed[worst]),
    )


def remedy(conditions: OperatingConditions, cause: Infeasible) -> str:
    """What would keep a limit, as a clause; empty where nothing simple would."""
    share = cause.value / cause.allowed if cause.allowed > 0.0 else math.nan
    if not (math.isfinite(share) and share > 1.0):
        return ""
    vehicle, mass = conditions.model.vehicle, conditions.mass
    # Torque, current and the pull of a slope go with the weight; the gear divides it by its ratio.
    lighter = f"{_below(mass / share)} kg instead of {mass:g}"
    times = f"{cause.limit} {_above(share)} times what is allowed"
    if cause.limit in ("torque peak", "torque rms", "current"):
        gear = vehicle.gear_ratio * share
        return f" ({times}; {lighter}, or a gear of {_above(gear, 1)} would do)"
    if cause.limit == "traction":
        return f" ({times}; a traction of {_above(vehicle.traction * share)} would do)"
    if cause.limit == "voltage":
        return f" ({times}; {_above(cause.value, 1)} V would do)"
    return f" ({times})"


def _above(value: float, digits: int = 2) -> str:
    """Rounded up: what is said to suffice does."""
    scale = 10.0**digits
    return f"{math.ceil(value * scale - 1e-9) / scale:.{digits}f}"


def _below(value: float) -> str:
    return f"{math.floor(value * 10.0 + 1e-9) / 10.0:.1f}"
