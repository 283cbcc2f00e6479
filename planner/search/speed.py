"""Speed along a track with known yaw, by dynamic programming.

Squared speed is on an even grid and acceleration constant between stations; the power model prices
every step with its acceleration, turning and bend, so that ramps at start, stop and corners are
paid for, and what braking gives back is earned. Limits hold at every step.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planner.power.compile_kernel import KERNEL
from planner.power.model import PowerModel
from planner.power.pipeline import ACCOUNT_LENGTH, PER_WHEEL
from planner.quantities import INDEX
from planner.search.steady import (
    BRIEFLY,
    SLOWEST,
    broken_limit,
    set_acceleration,
    set_motion,
    set_wind,
)
from planner.search.track import Track
from planner.search.yaw import YawProfile

Array = NDArray[np.float64]
_CREEP = (0.0, SLOWEST, 0.1, 0.16)
LEVELS = len(_CREEP) + 20
"""Standstill, three speeds to creep round corners, and an even grid of the squared speed."""
REACH = 9
"""Largest change of level between stations."""

_WHEEL_COLUMNS = len(PER_WHEEL)
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_B1 = types.Array(types.boolean, 1, "C")
_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]
_SLOPE_RATE = INDEX["slope_rate"]
# Gauss-Legendre nodes and weights on [0, 1], exact for cubics.
_TWO = ((0.5 - math.sqrt(3) / 6, 0.5), (0.5 + math.sqrt(3) / 6, 0.5))


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F1, _F1, _F1),
        *(types.float64,) * 8,
        *(types.int64, _F1, _F2),
    ),
    cache=True,
    error_model="numpy",
)
def _ramp_cost(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    row: Any,
    unit: Any,
    limits: Any,
    surface: float,
    turn: float,
    curvature: float,
    speed_a: float,
    speed_b: float,
    slope_change: float,
    most_acceleration: float,
    weight_of_time: float,
    objective: int,
    account: Any,
    per_wheel: Any,
) -> float:
    """Cost of one step between two speeds; infinity where a limit is broken."""
    acceleration = (speed_b * speed_b - speed_a * speed_a) / (2.0 * surface)
    if abs(acceleration) > most_acceleration * (1.0 + 1e-6):
        return np.inf
    time = 2.0 * surface / (speed_a + speed_b)
    faster = max(speed_a, speed_b)
    if abs(turn) * faster > limits[6] * surface * (1.0 + 1e-6):
        return np.inf
    if faster * faster * abs(curvature) > most_acceleration * 1.1:
        return np.inf
    brief = turn != 0.0 or curvature != 0.0 or abs(acceleration) > 0.05 * most_acceleration
    row[_WZ] = turn / time
    row[_SLOPE_RATE] = slope_change / time
    total = 0.0
    for at, share in _TWO:
        if speed_a == speed_b and at > 0.5:
            total *= 2.0  # at even speed both nodes see the same
            break
        speed = speed_a + (speed_b - speed_a) * at
        row[_VX], row[_VY] = unit[0] * speed, unit[1] * speed
        set_acceleration(row, acceleration, speed * speed * curvature, unit[0], unit[1], 1.0)
        watts = kernel(row, parameters, body, wheels, account, per_wheel)
        if broken_limit(account, limits, BRIEFLY if brief else 1.0) >= 0:
            return np.inf
        total += share * watts * time
    if objective == 1:
        return time + 1e-6 * total
    return total + weight_of_time * time


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1),
        *(_F1, _F1, _F1, _F2, _F1, _F1, _I1, _B1),
        *(types.float64, types.int64, _F1),
    ),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def _speeds(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    class_rows: Any,
    limits: Any,
    wind: Any,
    directions: Any,
    lengths: Any,
    curvatures: Any,
    slopes: Any,
    yaw: Any,
    turns: Any,
    ground: Any,
    stops: Any,
    most_acceleration: float,
    objective: int,
    speeds: Any,
) -> Any:
    """Cost of the best speeds; without any, speeds[0] is the station where none leads on."""
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    steps = lengths.shape[0]
    cost = np.full((steps + 1, LEVELS), np.inf)
    came = np.full((steps + 1, LEVELS), -1, np.int64)
    level = np.empty(LEVELS)
    for q in range(LEVELS):
        even = (q - len(_CREEP) + 1) / (LEVELS - len(_CREEP))
        level[q] = limits[0] * (_CREEP[q] if q < len(_CREEP) else math.sqrt(even))
    cost[0, 0] = 0.0
    lag = 4.0 * limits[4] * limits[0] * limits[0]
    if objective == 1:
        lag = 4.0 * limits[0] / most_acceleration
    unit = np.empty(2)
    for j in range(steps):
        row = class_rows[ground[j]].copy()
        stretch = set_motion(row, slopes[j, 0], slopes[j, 1], yaw[j], directions[j], 1.0)
        unit[0], unit[1] = row[_VX], row[_VY]
        set_wind(row, wind, yaw[j])
        change = 0.0
        if j + 1 < steps:
            change = math.hypot(slopes[j + 1, 0] - slopes[j, 0], slopes[j + 1, 1] - slopes[j, 1])
        # Over steps longer than a whole ramp every third level will do.
        long = lengths[j] * most_acceleration > limits[0] * limits[0] and not stops[j + 1]
        # A speed that is behind by more than any change of speed costs cannot catch up again.
        hopeless = cost[j].min() + lag
        for a in range(LEVELS):
            if cost[j, a] > hopeless or cost[j, a] == np.inf:
                continue
            for b in range(max(0, a - REACH), min(LEVELS, a + REACH + 1)):
                if a + b == 0 or (stops[j + 1] and b > 0):
                    continue
                if long and b > 0 and (LEVELS - 1 - b) % 3:
                    continue
                c = cost[j, a] + _ramp_cost(
                    kernel,
                    parameters,
                    body,
                    wheels,
                    row,
                    unit,
                    limits,
                    lengths[j] * stretch,
                    turns[j],
                    curvatures[j],
                    level[a],
                    level[b],
                    change,
                    most_acceleration,
                    0.0,
                    objective,
                    account,
                    per_wheel,
                )
                if c < cost[j + 1, b]:
                    cost[j + 1, b] = c
                    came[j + 1, b] = a
    best = cost[steps, 0]
    if best < np.inf:
        q = 0
        for j in range(steps, 0, -1):
            speeds[j] = level[q]
            q = came[j, q]
    else:
        furthest = 0
        for j in range(steps + 1):
            if cost[j].min() < np.inf:
                furthest = j
        speeds[0] = furthest
    return best


def speed_programme(
    model: PowerModel,
    track: Track,
    yaw: YawProfile,
    slopes: Array,
    grounds: NDArray[np.int64],
    class_rows: Array,
    limits: Array,
    wind: Array,
    objective: int,
) -> tuple[Array | None, int]:
    """Speed (n,) at every station, or None and the station where no speed leads further."""
    stops = track.stops | (np.abs(yaw.leaving - yaw.arriving) > 1e-9)
    turns = yaw.arriving[1:] - yaw.leaving[:-1]
    speeds = np.zeros(len(track.points))
    cost = _speeds(
        model.kernel,
        model.parameters,
        model.body,
        model.wheels,
        class_rows,
        limits,
        wind,
        track.directions,
        track.lengths,
        track.curvatures,
        slopes,
        yaw.leaving[:-1] + 0.5 * turns,
        turns,
        grounds,
        stops,
        model.vehicle.limits.acceleration,
        objective,
        speeds,
    )
    if not math.isfinite(cost):
        return None, int(speeds[0])
    return speeds, -1
