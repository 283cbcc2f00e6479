"""Names, units and possible values of the columns of a telemetry log.

The names are those of planner.quantities and of ``LOG_ONLY``. A value outside ``POSSIBLE`` is not a
measurement of a ground robot but a fault or another unit.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable

from planner.quantities import QUANTITIES

LOG_ONLY: dict[str, str] = {
    "run": "text",
    "time": "s",
    "power": "W",
    "roll": "rad",
    "pitch": "rad",
    "battery_current": "A",
}
UNITS: dict[str, str] = {
    **{quantity.name: quantity.unit for quantity in QUANTITIES},
    **LOG_ONLY,
    "surface": "text",
}
TEXT = ("run", "surface")
REQUIRED = ("run", "time", "vx", "vy", "wz", "power")
MAY_BE_UNKNOWN = ("com_x", "com_y", "motor_temp", "ambient_temp", "battery_voltage", "sensor_rate")
"""Quantities that a row may leave unknown (NaN)."""

POSSIBLE: dict[str, tuple[float, float]] = {
    **dict.fromkeys(("vx", "vy", "wz"), (-50.0, 50.0)),
    **dict.fromkeys(("ax", "ay"), (-200.0, 200.0)),
    "yaw_acceleration": (-2000.0, 2000.0),
    **dict.fromkeys(("roll", "pitch"), (-0.5 * math.pi, 0.5 * math.pi)),
    **dict.fromkeys(("gravity_x", "gravity_y", "com_x", "com_y"), (-10.0, 10.0)),
    "gravity_normal": (0.0, 10.0),
    "power": (-1e6, 1e6),
    "payload": (0.0, 1e5),
    "motor_temp": (-80.0, 250.0),  # 293 is room temperature in K
    "ambient_temp": (-90.0, 100.0),
    "battery_voltage": (0.0, 2000.0),
    "battery_current": (-1e4, 1e4),
    **dict.fromkeys(("wind_x", "wind_y"), (-100.0, 100.0)),
    "sensor_rate": (0.0, 1e7),
    "traction_factor": (0.0, 1e2),
    **dict.fromkeys(("rolling_factor", "slope_rate"), (0.0, 1e3)),
}
OFTEN_MISTAKEN: dict[str, str] = {
    **dict.fromkeys(("vx", "vy"), "mm/s, cm/s or km/h"),
    "wz": "deg/s",
    **dict.fromkeys(("roll", "pitch"), "degrees"),
    "power": "mW",
    "motor_temp": "kelvin",
    "ambient_temp": "kelvin or °F",
    **dict.fromkeys(("com_x", "com_y"), "mm"),
    "battery_voltage": "mV",
    "battery_current": "mA",
}
OTHER_NAMES: dict[str, tuple[str, ...]] = {
    "run": ("trial", "trial_id", "run_id", "drive", "session", "experiment", "test"),
    "time": ("t", "stamp", "timestamp", "times", "seconds", "elapsed", "time_ms", "epoch"),
    "vx": ("linear.x", "vel_x", "x_vel", "velocity_x", "twist.linear.x", "twist.twist.linear.x"),
    "vy": ("linear.y", "vel_y", "y_vel", "velocity_y", "twist.linear.y", "twist.twist.linear.y"),
    "wz": ("angular.z", "yaw_rate", "twist.angular.z", "twist.twist.angular.z", "gyro_z"),
    "power": ("p", "p_w", "watts", "watt", "p_bat", "p_elec", "power_total", "battery_power"),
}
"""What other logs call the required columns; only asked about, never taken."""
_WHEEL_CURRENT = re.compile(r"wheel_current_([1-9][0-9]?)")
_WHEEL_SPEED = re.compile(r"wheel_speed_[1-9][0-9]?")


def wheel_number(name: str) -> int | None:
    """The n of "wheel_current_n", None for any other name."""
    match = _WHEEL_CURRENT.fullmatch(name)
    return int(match[1]) if match else None


def is_wheel_speed(name: object) -> bool:
    """True for "wheel_speed_1", "wheel_speed_2", …, which files have that are to be joined."""
    return isinstance(name, str) and _WHEEL_SPEED.fullmatch(name) is not None


def is_quantity(name: str) -> bool:
    """True for a name that a column of a log may have."""
    return name in UNITS or wheel_number(name) is not None


def unit_of(name: str) -> str:
    """SI unit of a log's quantity ("text" for labels)."""
    if is_wheel_speed(name):
        return "rad/s"
    return "A" if wheel_number(name) else UNITS[name]


def closest(name: str, known: Iterable[str]) -> str | None:
    """The known name that a misspelt one most likely stands for."""
    known = list(known)
    folded = {_fold(candidate): candidate for candidate in known}
    if _fold(name) in folded:
        return folded[_fold(name)]
    for other in OTHER_NAMES.get(name, ()):
        if _fold(other) in folded:
            return folded[_fold(other)]
    found = difflib.get_close_matches(_fold(name), list(folded), n=1, cutoff=0.7)
    return folded[found[0]] if found else None


def suggestion(name: object, known: Iterable[str]) -> str:
    """The end of a sentence that asks for the closest known name; "" when none is close."""
    near = closest(name, known) if isinstance(name, str) else None
    return f"; did you mean {near!r}?" if near else ""


def _fold(name: str) -> str:
    return re.sub(r"\[.*?\]|\(.*?\)|[^a-z0-9]", "", name[:80].lower())
