"""Rows of the power model for a motion on a plane, one at a time or in blocks.

fill_row(row, class_rows[ground])
stretch = set_motion(row, slope_x, slope_y, yaw, direction, speed)
set_acceleration(row, along, centripetal, vx, vy, speed)
set_wind(row, wind, yaw)
watts = kernel(row, ..., account, per_wheel)

columns, found = empty_block()                                # many rows at once, up to BLOCK
put_row(columns, k, row); put(columns, k, INDEX["vx"], 0.5)
kernel(columns, count, ..., found)                            # power of row k: found[k]
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner.compiled_code import njit
from planner.power.account import LIMITS
from planner.power.kernels import BLOCK
from planner.quantities import INDEX, ROW_LENGTH, STANDARD_GRAVITY

_VX, _VY = INDEX["vx"], INDEX["vy"]
_AX, _AY = INDEX["ax"], INDEX["ay"]
_WIND_X, _WIND_Y = INDEX["wind_x"], INDEX["wind_y"]
_RESULTS = 1 + len(LIMITS)
_GX, _GY, _GN = INDEX["gravity_x"], INDEX["gravity_y"], INDEX["gravity_normal"]


@njit(cache=True, error_model="numpy")
def fill_row(row: Any, source: Any) -> None:
    """Copy a row of the power model.

    ``row[:] = source`` would compile the text of an error for other shapes, for a second or two.
    """
    for quantity in range(ROW_LENGTH):
        row[quantity] = source[quantity]


@njit(cache=True, error_model="numpy")
def stretch_of(slope_x: float, slope_y: float, direction: float) -> float:
    """Metres driven along a plane for each horizontal metre in a direction (rad)."""
    along = slope_x * math.cos(direction) + slope_y * math.sin(direction)
    return math.sqrt(1.0 + along * along)


@njit(cache=True, error_model="numpy", inline="always")
def motion_on_plane(
    slope_x: float, slope_y: float, c: float, s: float, ux: float, uy: float
) -> tuple[float, float, float, float, float, float]:
    """Velocity at 1 m/s, gravity and ``stretch_of`` in the body frame; exact for any slope.

    Args:
        slope_x, slope_y: gradient of the height.
        c, s: cosine and sine of the yaw.
        ux, uy: the same of the direction of the horizontal travel.
    """
    ahead = slope_x * c + slope_y * s
    left = slope_y * c - slope_x * s
    along = slope_x * ux + slope_y * uy
    stretch = math.sqrt(1.0 + along * along)
    length_x = math.sqrt(1.0 + ahead * ahead)
    normal = math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    vx = (ux * c + uy * s + along * ahead) / (stretch * length_x)
    vy = ux * (-slope_y * ahead - s) + uy * (c + slope_x * ahead) + along * left
    vy /= stretch * normal * length_x
    gx = -STANDARD_GRAVITY * ahead / length_x
    gy = -STANDARD_GRAVITY * left / (normal * length_x)
    return vx, vy, gx, gy, STANDARD_GRAVITY / normal, stretch


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
    vx, vy, gx, gy, gn, stretch = motion_on_plane(
        slope_x, slope_y, c, s, math.cos(direction), math.sin(direction)
    )
    row[_GX], row[_GY], row[_GN] = gx, gy, gn
    row[_VX], row[_VY] = speed * vx, speed * vy
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
def empty_block() -> Any:
    """Arrays for BLOCK rows, quantity by quantity, and for what the model finds for them."""
    return np.zeros(ROW_LENGTH * BLOCK), np.empty(_RESULTS * BLOCK)


@njit(cache=True, inline="always")
def put_row(columns: Any, k: int | np.int64, row: Any) -> None:
    """Copy a row to place ``k`` of a block."""
    for quantity in range(ROW_LENGTH):
        columns[quantity * BLOCK + k] = row[quantity]


@njit(cache=True, inline="always")
def put(columns: Any, k: int | np.int64, quantity: int, value: float) -> None:
    """One quantity of the row at place ``k`` of a block."""
    columns[quantity * BLOCK + k] = value
