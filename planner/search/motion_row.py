"""Rows of the power model for a motion on a plane, and the limits that their accounts break.

stretch = set_motion(row, slope_x, slope_y, yaw, direction, speed)
set_acceleration(row, along, centripetal, vx, vy, speed)
set_wind(row, wind, yaw)
watts = kernel(row, ..., account, per_wheel)
broken_limit(account, limit_values(model, payload), 1.0)      # a number into LIMIT_NAMES, or -1
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.power.model import PowerModel
from planner.power.pipeline import ACCOUNT
from planner.quantities import INDEX, STANDARD_GRAVITY

BRIEFLY = 2.0
"""Share of the continuous torque allowed on bends and ramps: a motor warms up in a minute."""
LIMIT_NAMES = ("wheel load", "traction", "current", "voltage", "continuous torque")

_VX, _VY = INDEX["vx"], INDEX["vy"]
_AX, _AY = INDEX["ax"], INDEX["ay"]
_WIND_X, _WIND_Y = INDEX["wind_x"], INDEX["wind_y"]
_GX, _GY, _GN = INDEX["gravity_x"], INDEX["gravity_y"], INDEX["gravity_normal"]
_LOAD, _CURRENT, _VOLTAGE, _TORQUE, _GRIP = (
    ACCOUNT.index(name)
    for name in ("least_load", "current", "voltage", "motor_torque", "traction_left")
)


@njit(cache=True, error_model="numpy")
def set_motion(
    row: Any, slope_x: float, slope_y: float, yaw: float, direction: float, speed: float
) -> float:
    """Write velocity and gravity in the body frame for driving on a plane; exact for any slope.

    Args:
        row: one row of the power model, written in place.
        slope_x, slope_y: gradient of the height.
        yaw: rad, of the body, in the same frame.
        direction: rad, of the horizontal travel.
        speed: m/s along the surface.

    Returns:
        Metres driven along the surface for each horizontal metre.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    ux, uy = math.cos(direction), math.sin(direction)
    ahead = slope_x * c + slope_y * s
    left = slope_y * c - slope_x * s
    along = slope_x * ux + slope_y * uy
    stretch = math.sqrt(1.0 + along * along)
    length_x = math.sqrt(1.0 + ahead * ahead)
    normal = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    row[_GX] = -STANDARD_GRAVITY * ahead / length_x
    row[_GY] = -STANDARD_GRAVITY * left / (normal * length_x)
    row[_GN] = STANDARD_GRAVITY / normal
    row[_VX] = speed * (ux * c + uy * s + along * ahead) / (stretch * length_x)
    row[_VY] = (
        speed
        * (ux * (-slope_y * ahead - s) + uy * (c + slope_x * ahead) + along * left)
        / (stretch * normal * length_x)
    )
    return stretch


@njit(cache=True, error_model="numpy")
def set_acceleration(
    row: Any, along: float, centripetal: float, vx: float, vy: float, speed: float
) -> None:
    """Write accelerations along and across the direction (vx, vy)/speed into a row."""
    cx, cy = vx / speed, vy / speed
    row[_AX] = along * cx - centripetal * cy
    row[_AY] = along * cy + centripetal * cx


@njit(cache=True)
def set_wind(row: Any, wind: Any, yaw: float) -> None:
    """Write a wind given in the map's frame into a row, seen from the body."""
    c, s = math.cos(yaw), math.sin(yaw)
    row[_WIND_X] = c * wind[0] + s * wind[1]
    row[_WIND_Y] = c * wind[1] - s * wind[0]


@njit(cache=True)
def broken_limit(account: Any, limits: Any, ease: float) -> int:
    """Number of the first limit that an account breaks (LIMIT_NAMES), or -1.

    Args:
        account: what the power model wrote.
        limits: [speed, current, voltage, continuous torque, ...].
        ease: factor on the continuous torque, which is a thermal limit: 1 on the straight,
            BRIEFLY on what lasts a few seconds.
    """
    if account[_LOAD] <= 0.0:
        return 0
    if account[_GRIP] < 0.0:
        return 1
    if account[_CURRENT] > limits[1]:
        return 2
    if account[_VOLTAGE] > limits[2]:
        return 3
    if account[_TORQUE] > limits[3] * ease:
        return 4
    return -1


def limit_values(model: PowerModel, payload: float) -> NDArray[np.float64]:
    """[speed, current, voltage, continuous torque, mass with payload, largest tan(slope)]."""
    limits = model.vehicle.limits
    return np.array(
        [
            limits.speed,
            limits.current,
            limits.voltage,
            limits.continuous_torque,
            model.vehicle.mass + payload,
            math.tan(math.radians(60.0)),
        ]
    )
