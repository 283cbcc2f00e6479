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
from planner.search.yaw import YawProfile, cost_of_a_stop

Array = NDArray[np.float64]
_CREEP = (0.0, SLOWEST, 0.1, 0.16)
LEVELS = len(_CREEP) + 20
"""Standstill, three speeds to creep round corners, and an even grid of the squared speed."""
REACH = 9
"""Largest change of level between stations."""
NEAR = 0.001
"""Share of the best cost by which speeds in the outline may be dearer and still be looked at."""
NEAR_RAMPS = 0.05
"""The same, as a share of what standing still and starting again costs."""

FORWARDS, BACKWARDS, MARK = 0, 1, 2
"""Phases of the outline."""

_WHEEL_COLUMNS = len(PER_WHEEL)
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_B1 = types.Array(types.boolean, 1, "C")
_B3 = types.Array(types.boolean, 3, "C")
_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]
_SLOPE_RATE = INDEX["slope_rate"]
# Gauss-Legendre nodes and weights on [0, 1], exact for cubics.
_TWO = ((0.5 - math.sqrt(3) / 6, 0.5), (0.5 + math.sqrt(3) / 6, 0.5))


@njit(cache=True)
def _levels(top: float) -> Any:
    """Speeds in m/s: standstill, some to creep, and an even grid of the squared speed."""
    level = np.empty(LEVELS)
    for q in range(LEVELS):
        even = (q - len(_CREEP) + 1) / (LEVELS - len(_CREEP))
        level[q] = top * (_CREEP[q] if q < len(_CREEP) else math.sqrt(even))
    return level


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F1, _F1, _F1),
        *(types.float64,) * 7,
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
    return total


@njit(
    types.boolean(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1),
        *(_F1, _F1, _F1, _F2, _F1, _F1, _I1, _B1),
        *(types.float64, types.int64, types.float64, _B3),
    ),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def _outline(
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
    ramp: float,
    near: Any,
) -> bool:
    """Mark the changes of level near the best speeds by even driving; False if there are none.

    A step costs the mean of even driving at its two speeds, and for speeding up or slowing down
    what that takes or gives at half speed. The programme proper then prices what is near.
    """
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    steps = lengths.shape[0]
    level = _levels(limits[0])
    unit = np.empty(2)
    even = np.full((steps, LEVELS), np.inf)  # W
    up, down = np.empty(steps), np.empty(steps)
    surface = np.empty(steps)
    for j in range(steps):
        row = class_rows[ground[j]].copy()
        stretch = set_motion(row, slopes[j, 0], slopes[j, 1], yaw[j], directions[j], 1.0)
        unit[0], unit[1] = row[_VX], row[_VY]
        set_wind(row, wind, yaw[j])
        surface[j] = lengths[j] * stretch
        for q in range(LEVELS):
            speed = max(level[q], 0.5 * level[1])
            if speed * speed * abs(curvatures[j]) > most_acceleration * 1.1:
                break
            if abs(turns[j]) * speed > limits[6] * surface[j] * (1.0 + 1e-6):
                break
            row[_VX], row[_VY] = unit[0] * speed, unit[1] * speed
            row[_WZ] = turns[j] * speed / surface[j]
            set_acceleration(row, 0.0, speed * speed * curvatures[j], unit[0], unit[1], 1.0)
            even[j, q] = kernel(row, parameters, body, wheels, account, per_wheel)
        speed, pull = 0.5 * limits[0], 0.5 * most_acceleration
        row[_VX], row[_VY] = unit[0] * speed, unit[1] * speed
        row[_WZ] = 0.0
        set_acceleration(row, 0.0, 0.0, unit[0], unit[1], 1.0)
        watts = kernel(row, parameters, body, wheels, account, per_wheel)
        set_acceleration(row, pull, 0.0, unit[0], unit[1], 1.0)
        up[j] = kernel(row, parameters, body, wheels, account, per_wheel) - watts
        set_acceleration(row, -pull, 0.0, unit[0], unit[1], 1.0)
        down[j] = watts - kernel(row, parameters, body, wheels, account, per_wheel)
        # J for each m²/s² of the squared speed
        up[j], down[j] = 0.5 * up[j] / (pull * speed), 0.5 * down[j] / (pull * speed)
    come = np.full((steps + 1, LEVELS), np.inf)
    ahead = np.full((steps + 1, LEVELS), np.inf)
    come[0, 0] = ahead[steps, 0] = 0.0
    most = np.inf
    for phase in (FORWARDS, BACKWARDS, MARK):
        for n in range(steps):
            j = steps - 1 - n if phase == BACKWARDS else n
            reached = 2.0 * surface[j] * most_acceleration * (1.0 + 1e-6)
            for a in range(LEVELS):
                if (phase != BACKWARDS and come[j, a] == np.inf) or even[j, a] == np.inf:
                    continue
                for b in range(max(0, a - REACH), min(LEVELS, a + REACH + 1)):
                    change = level[b] * level[b] - level[a] * level[a]
                    if a + b == 0 or (stops[j + 1] and b > 0) or abs(change) > reached:
                        continue
                    cost = 2.0 * surface[j] / (level[a] + level[b])
                    if objective != 1:
                        cost *= 0.5 * (even[j, a] + even[j, b])
                        cost += change * (up[j] if change > 0.0 else down[j])
                    if phase == FORWARDS:
                        come[j + 1, b] = min(come[j + 1, b], cost + come[j, a])
                    elif phase == BACKWARDS:
                        ahead[j, a] = min(ahead[j, a], cost + ahead[j + 1, b])
                    else:
                        near[j, a, b] = come[j, a] + cost + ahead[j + 1, b] <= most
        if phase == FORWARDS:
            best = come[steps, 0]
            if best == np.inf:
                return False
            most = best + NEAR * abs(best) + NEAR_RAMPS * ramp
    return True


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1),
        *(_F1, _F1, _F1, _F2, _F1, _F1, _I1, _B1),
        *(types.float64, types.int64, types.float64, _B3, _F1),
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
    ramp: float,
    near: Any,
    speeds: Any,
) -> Any:
    """Cost of the best speeds among changes ``near`` the outline, (steps + 1, LEVELS, LEVELS).

    Without any, speeds[0] is the station where none leads on.
    """
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    steps = lengths.shape[0]
    cost = np.full((steps + 1, LEVELS), np.inf)
    came = np.full((steps + 1, LEVELS), -1, np.int64)
    level = _levels(limits[0])
    cost[0, 0] = 0.0
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
        hopeless = cost[j].min() + 4.0 * ramp
        for a in range(LEVELS):
            if cost[j, a] > hopeless or cost[j, a] == np.inf:
                continue
            for b in range(max(0, a - REACH), min(LEVELS, a + REACH + 1)):
                if a + b == 0 or (stops[j + 1] and b > 0) or not near[j, a, b]:
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


def _ramp(model: PowerModel, class_rows: Array, limits: Array, objective: int) -> float:
    """What standing still and starting again costs at most, in J or s."""
    stop = cost_of_a_stop(model, class_rows, limits, objective)
    # With a price of time the seconds of a stop may cost more than all kinetic energy.
    return stop if objective == 1 else max(float(limits[4] * limits[0] * limits[0]), stop)


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
    task = (
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
        _ramp(model, class_rows, limits, objective),
    )
    near = np.zeros((len(speeds), LEVELS, LEVELS), np.bool_)
    cost = math.inf
    if _outline(*task, near):
        cost = _speeds(*task, near, speeds)
    if not math.isfinite(cost):
        near[:] = True
        speeds[:] = 0.0
        cost = _speeds(*task, near, speeds)
    if not math.isfinite(cost):
        return None, int(speeds[0])
    return speeds, -1
