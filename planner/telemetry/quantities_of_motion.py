"""Quantities of motion of a log's rows: speed, heading, slope along the travel, braking, load.

    axes = motion_axes(log.rows)       # {"speed": (n,), "heading": (n,), ...}, SI and rad
    axes = all_axes(log.rows)          # also wind, place of the load, ground …

These are the axes on which residuals are looked at: regimes, curves and shapes outside the
catalogue all use these names.

    u            = v / √(|v|² + STANDSTILL²)      direction of travel, fading out at standstill
    slope_along  = asin(-g·u / |g|)               > 0 climbs
    slope_across = asin(-g·n / |g|)               n = u turned 90° left; > 0 is higher on the left
    acceleration = a·u                            > 0 speeds up, < 0 brakes

Left out
    a robot that stands on a slope has slope_along = slope_across = 0, because it has no direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.arrays import Array
from planner.quantities import INDEX

STANDSTILL = 0.02
"""m/s below which a robot is taken to have no heading: ten times the usual error of odometry."""
STEADY_YAW = 0.03
"""rad/s below which a robot is taken not to turn: ten times the usual error. What works in turns
does nothing without one; else a formula would take the place of the electronics' power."""


@dataclass(frozen=True)
class Axis:
    """One quantity that a residual is looked at over.

    Attributes:
        name: as in ``outside_catalogue.quantities``.
        unit: of its values, SI; angles in rad.
        meaning: what a positive value is.
        signed: both signs occur and mean opposite things.
    """

    name: str
    unit: str
    meaning: str
    signed: bool = False


AXES: dict[str, Axis] = {
    axis.name: axis
    for axis in (
        Axis("heading", "rad", "direction of travel in the body frame; 0 forward, π/2 left"),
        Axis("speed", "m/s", "magnitude of the velocity of the centre"),
        Axis("slope_along", "rad", "slope of the ground along the travel; > 0 climbs", True),
        Axis("slope_across", "rad", "slope across the travel; > 0 is higher on the left", True),
        Axis("yaw_rate", "rad/s", "yaw rate; > 0 turns left", True),
        Axis("acceleration", "m/s²", "acceleration along the travel; < 0 brakes", True),
        Axis("load", "kg", "payload"),
        Axis("temperature", "°C", "temperature of the motors, or of the air where that is unknown"),
        Axis("time_since_start", "s", "time since the run began"),
    )
}
"""The axes of ``outside_catalogue.quantities``."""

FURTHER: dict[str, Axis] = {
    axis.name: axis
    for axis in (
        Axis("headwind", "m/s", "wind against the travel; < 0 comes from behind", True),
        Axis("sensor_rate", "Hz", "samples taken per second"),
        Axis("com_x", "m", "centre of mass forward of the centre", True),
        Axis("com_y", "m", "centre of mass left of the centre", True),
        Axis("slope_rate", "rad/s", "how fast the slope under the robot changes"),
        Axis("odometer", "m", "distance driven since the log began"),
        Axis("predicted_power", "W", "power that the model predicts; < 0 flows back"),
    )
}
"""Axes that only regimes use: the catalogue has effects of its own for them, or, for the
predicted power, many: whatever depends on the direction in which power flows."""


def motion_axes(rows: Array, *, temperature: str | None = None) -> dict[str, Array]:
    """Values of every axis of AXES.

    Args:
        rows: (n, ROW_LENGTH) rows of the power model.
        temperature: the quantity that stands for it; None takes ``motor_temp`` where one of these
            rows has it and ``ambient_temp`` otherwise. Pieces of one log need the same.

    Returns:
        name → (n,); NaN where not known. ``heading`` is NaN below STANDSTILL.
    """
    speed, forward, left = _direction(rows)
    gx, gy, gz = (rows[:, INDEX[f"gravity_{axis}"]] for axis in ("x", "y", "normal"))
    gravity = np.sqrt(gx * gx + gy * gy + gz * gz)
    if temperature is None:
        temperature = temperature_of(rows)
    heading = np.arctan2(rows[:, INDEX["vy"]], rows[:, INDEX["vx"]])
    return {
        "heading": np.where(speed < STANDSTILL, np.nan, heading),
        "speed": speed,
        "slope_along": np.arcsin(np.clip(-(gx * forward + gy * left) / gravity, -1.0, 1.0)),
        "slope_across": np.arcsin(np.clip(-(gy * forward - gx * left) / gravity, -1.0, 1.0)),
        "yaw_rate": rows[:, INDEX["wz"]].copy(),
        "acceleration": rows[:, INDEX["ax"]] * forward + rows[:, INDEX["ay"]] * left,
        "load": rows[:, INDEX["payload"]].copy(),
        "temperature": rows[:, INDEX[temperature]].copy(),
        "time_since_start": rows[:, INDEX["time_since_start"]].copy(),
    }


def temperature_of(rows: Array) -> str:
    """The quantity that gives the temperature in these rows, (n, ROW_LENGTH)."""
    known = np.isfinite(rows[:, INDEX["motor_temp"]]).any()
    return "motor_temp" if known else "ambient_temp"


def further_axes(rows: Array) -> dict[str, Array]:
    """Values of the axes of FURTHER that rows know, name → (n,); NaN where not known.

    Args:
        rows: (n, ROW_LENGTH) rows of the power model.
    """
    _, forward, left = _direction(rows)
    wind = rows[:, INDEX["wind_x"]] * forward + rows[:, INDEX["wind_y"]] * left
    plain = ("sensor_rate", "com_x", "com_y", "slope_rate", "odometer")
    return {"headwind": -wind, **{name: rows[:, INDEX[name]].copy() for name in plain}}


def all_axes(
    rows: Array, *, watts: Array | None = None, temperature: str | None = None
) -> dict[str, Array]:
    """Values of every axis of AXES and FURTHER and of the ground, name → (n,).

    Args:
        rows: (n, ROW_LENGTH) rows of the power model.
        watts: (n,) W, modelled; None leaves ``predicted_power`` unknown, NaN.
        temperature: see motion_axes.
    """
    motion = motion_axes(rows, temperature=temperature)
    power = np.full(len(rows), np.nan) if watts is None else watts
    further = {**further_axes(rows), "predicted_power": power}
    return {**motion, **further, "surface": rows[:, INDEX["surface"]]}


def _direction(rows: Array) -> tuple[Array, Array, Array]:
    """Speed and the direction of travel, forward and left, fading out at standstill."""
    vx, vy = rows[:, INDEX["vx"]], rows[:, INDEX["vy"]]
    speed = np.hypot(vx, vy)
    length = np.hypot(speed, STANDSTILL)
    return speed, vx / length, vy / length
