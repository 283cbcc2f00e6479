"""Speed along a track with known yaw, by dynamic programming.

Squared speed is on an even grid and acceleration constant between stations; the power model prices
every step with its acceleration, turning and bend, so that ramps at start, stop and corners are
paid for, and what braking gives back is earned. Limits hold at every step.

As in planner.search.yaw_kernel, changes of speed are first estimated, here by even driving, and
only those near the best way so far are priced, until that way has nothing but exact prices.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planner.power.compile_kernel import KERNEL
from planner.power.pipeline import ACCOUNT_LENGTH, PER_WHEEL
from planner.quantities import INDEX
from planner.search.conditions import Circumstances
from planner.search.motion_row import BRIEFLY, broken_limit, set_acceleration, set_motion, set_wind
from planner.search.steady import SLOWEST
from planner.search.track import Track
from planner.search.yaw import YawProfile
from planner.search.yaw_kernel import STILL

Array = NDArray[np.float64]
_CREEP = (0.0, SLOWEST, 0.1, 0.16)
LEVELS = len(_CREEP) + 20
"""Standstill, three speeds to creep round corners, and an even grid of the squared speed."""
REACH = 9
"""Largest change of level between stations."""
ROUNDS = 24
"""Rounds of pricing after which the best speeds among the exact prices will do."""
ESTIMATED = 4
"""Even driving is priced at every so many levels for the estimates, and evenly in between."""

_WHEEL_COLUMNS = len(PER_WHEEL)
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_B1 = types.Array(types.boolean, 1, "C")
_F3 = types.Array(types.float64, 3, "C")
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
        *(KERNEL, _F1, _F1, _F2, _F1, _F1, _F1, _F1),
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
    steepest: Any,
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
    """Cost of one step between two speeds; infinity where a limit is broken.

    ``row`` is at the middle of the step; ``steepest``, unless empty, at unit speed where its ground
    is steepest.
    """
    acceleration = (speed_b * speed_b - speed_a * speed_a) / (2.0 * surface)
    if abs(acceleration) > most_acceleration * (1.0 + 1e-6):
        return np.inf
    time = 2.0 * surface / (speed_a + speed_b)
    faster = max(speed_a, speed_b)
    if abs(turn) * faster > limits[6] * surface * (1.0 + 1e-6):
        return np.inf
    if faster * faster * abs(curvature) > most_acceleration * 1.1:
        return np.inf
    brief = abs(turn) > STILL or curvature != 0.0 or abs(acceleration) > 0.05 * most_acceleration
    if steepest.shape[0]:
        vx, vy = steepest[_VX], steepest[_VY]
        steepest[_VX], steepest[_VY], steepest[_WZ] = vx * faster, vy * faster, turn / time
        set_acceleration(steepest, acceleration, faster * faster * curvature, vx, vy, 1.0)
        kernel(steepest, parameters, body, wheels, account, per_wheel)
        steepest[_VX], steepest[_VY] = vx, vy
        if broken_limit(account, limits, BRIEFLY if brief else 1.0) >= 0:
            return np.inf
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
    types.void(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1),
        *(_F1, _F1, _F1, _F2, _F1, _F1, _I1, _B1),
        *(types.float64, types.int64, _F1, _F1, _F3),
    ),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def _estimate(
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
    fastest: Any,
    hardest: Any,
    expected: Any,
) -> None:
    """Cost of every change of level by even driving, (steps, LEVELS, 2·REACH + 1).

    A step costs the mean of even driving between its two speeds, and for speeding up or slowing
    down what that takes or gives at half speed. Infinite where it cannot be.
    """
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    level = _levels(limits[0])
    unit = np.empty(2)
    even = np.empty(LEVELS)  # W
    below = np.zeros(LEVELS)  # W·m/s, its integral over the speed up to a level
    drawn = np.zeros(5)  # W, at accelerations from braking hard to speeding up hard
    pull, half = 0.5 * most_acceleration, 0.5 * limits[0]
    expected[:] = np.inf
    for j in range(lengths.shape[0]):
        row = class_rows[ground[j]].copy()
        stretch = set_motion(row, slopes[j, 0], slopes[j, 1], yaw[j], directions[j], 1.0)
        unit[0], unit[1] = row[_VX], row[_VY]
        set_wind(row, wind, yaw[j])
        surface = lengths[j] * stretch
        most = min(
            fastest[j],
            limits[6] * surface / max(abs(turns[j]), 1e-12),
            math.sqrt(1.1 * most_acceleration / max(abs(curvatures[j]), 1e-12)),
        ) * (1.0 + 1e-6)
        if objective != 1:
            before = -1
            for q in range(LEVELS):
                if (LEVELS - 1 - q) % ESTIMATED and q >= len(_CREEP):
                    continue
                speed = max(level[q], 0.5 * level[1])
                row[_VX], row[_VY] = unit[0] * speed, unit[1] * speed
                row[_WZ] = turns[j] * speed / surface
                across = speed * speed * curvatures[j]
                set_acceleration(row, 0.0, across, unit[0], unit[1], 1.0)
                even[q] = kernel(row, parameters, body, wheels, account, per_wheel)
                for r in range(before + 1, q):
                    share = (level[r] - level[before]) / (level[q] - level[before])
                    even[r] = even[before] + share * (even[q] - even[before])
                before = q
            for q in range(1, LEVELS):
                below[q] = below[q - 1] + 0.5 * (even[q - 1] + even[q]) * (level[q] - level[q - 1])
            row[_VX], row[_VY] = unit[0] * half, unit[1] * half
            row[_WZ] = 0.0
            for k in range(5):
                set_acceleration(row, (k - 2) * pull, 0.0, unit[0], unit[1], 1.0)
                drawn[k] = kernel(row, parameters, body, wheels, account, per_wheel)
        reached = 2.0 * surface * hardest[j] * (1.0 + 1e-6)
        for a in range(LEVELS):
            if level[a] > most:
                break
            for b in range(max(0, a - REACH), min(LEVELS, a + REACH + 1)):
                change = level[b] * level[b] - level[a] * level[a]
                if a + b == 0 or (stops[j + 1] and b > 0) or abs(change) > reached:
                    continue
                if level[b] > most:
                    break
                cost = time = 2.0 * surface / (level[a] + level[b])
                if objective != 1:
                    cost = time * even[a]
                    if change != 0.0:
                        cost = time * (below[b] - below[a]) / (level[b] - level[a])
                        # Work goes with the speed, heat with the square of the acceleration.
                        side = 1 if change > 0.0 else -1
                        once = drawn[2 + side] - drawn[2]
                        bent = 0.5 * (drawn[2 + 2 * side] - drawn[2] - 2.0 * once)
                        cost += 0.5 * abs(change) * (once - bent) / (pull * half)
                        cost += bent * (change / (2.0 * surface * pull)) ** 2 * time
                expected[j, a, b - a + REACH] = cost


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1),
        *(_F1, _F1, _F1, _F2, _F1, _F1, _I1, _B1),
        *(types.float64, types.int64, _F3, types.int64, _F1),
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
    expected: Any,
    beside: int,
    speeds: Any,
) -> Any:
    """Cost of the best speeds, written to ``speeds``; ``expected`` of ``_estimate`` is used up.

    Infinite without any; speeds[0] then is the station where none leads on.
    """
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    steps = lengths.shape[0]
    cost = np.empty((steps + 1, LEVELS))
    came = np.empty((steps + 1, LEVELS), np.int64)
    chosen = np.empty(steps + 1, np.int64)
    exact = np.zeros(expected.shape, np.bool_)
    level = _levels(limits[0])
    unit = np.empty(2)
    cost[0] = np.inf
    cost[0, 0] = 0.0
    nothing = before = False
    unchanged = 0  # steps up to which the costs of the round before hold
    for attempt in range(20 * ROUNDS):
        only = attempt >= ROUNDS and not nothing
        if only != before:
            before, unchanged = only, 0
        cost[unchanged + 1 :] = np.inf
        for j in range(unchanged, steps):
            for a in range(LEVELS):
                if cost[j, a] == np.inf:
                    continue
                for b in range(max(0, a - REACH), min(LEVELS, a + REACH + 1)):
                    at = b - a + REACH
                    total = cost[j, a] + expected[j, a, at]
                    if total < cost[j + 1, b] and (exact[j, a, at] or not only):
                        cost[j + 1, b] = total
                        came[j + 1, b] = a
        best = cost[steps, 0]
        if best == np.inf:
            if only:
                nothing = True  # what is priced leads nowhere yet
                continue
            for j in range(steps + 1):
                if cost[j].min() < np.inf:
                    speeds[0] = j
            return best
        nothing = False
        q = 0
        for j in range(steps, 0, -1):
            chosen[j] = q
            speeds[j] = level[q]
            q = came[j, q]
        chosen[0] = 0
        new = 0
        for j in range(steps):
            p, q = chosen[j], chosen[j + 1]
            if exact[j, p, q - p + REACH]:
                continue
            unchanged = j if new == 0 else unchanged
            new += 1
            guess = expected[j, p, q - p + REACH]
            row = class_rows[ground[j]].copy()
            stretch = set_motion(row, slopes[j, 0], slopes[j, 1], yaw[j], directions[j], 1.0)
            unit[0], unit[1] = row[_VX], row[_VY]
            set_wind(row, wind, yaw[j])
            steepest = row[:0]
            if slopes[j, 2] != slopes[j, 0] or slopes[j, 3] != slopes[j, 1]:
                steepest = row.copy()
                set_motion(steepest, slopes[j, 2], slopes[j, 3], yaw[j], directions[j], 1.0)
            change = 0.0
            if j + 1 < steps:
                change = math.hypot(
                    slopes[j + 1, 0] - slopes[j, 0], slopes[j + 1, 1] - slopes[j, 1]
                )
            for a in range(max(0, p - beside), min(LEVELS, p + beside + 1)):
                for b in range(max(0, q - beside), min(LEVELS, q + beside + 1)):
                    at = b - a + REACH
                    if at < 0 or at > 2 * REACH or exact[j, a, at] or expected[j, a, at] == np.inf:
                        continue
                    exact[j, a, at] = True
                    expected[j, a, at] = _ramp_cost(
                        kernel,
                        parameters,
                        body,
                        wheels,
                        row,
                        steepest,
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
            # What this guess was off by, its neighbours are off by as well.
            off = expected[j, p, q - p + REACH] - guess
            if off < np.inf:
                for a in range(LEVELS):
                    for at in range(2 * REACH + 1):
                        if not exact[j, a, at]:
                            expected[j, a, at] += off
        if new == 0:
            return best
    return np.inf


def speed_programme(
    around: Circumstances,
    track: Track,
    yaw: YawProfile,
    slopes: Array,
    grounds: NDArray[np.int64],
    objective: int,
    beside: int,
    fastest: Array,
    hardest: Array,
) -> tuple[Array | None, int]:
    """Speed (n,) at every station, or None and the station where no speed leads further.

    Levels up to ``beside`` from the best ones are priced by the power model as well; ``fastest``
    and ``hardest`` (steps,) are the largest speeds and accelerations.
    """
    stops = track.stops | (np.abs(yaw.leaving - yaw.arriving) > 1e-9)
    turns = yaw.arriving[1:] - yaw.leaving[:-1]
    speeds = np.zeros(len(track.points))
    model = around.model
    task = (
        model.kernel,
        model.parameters,
        model.body,
        model.wheels,
        around.class_rows,
        around.limits,
        around.wind,
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
    )
    expected = np.empty((len(track.lengths), LEVELS, 2 * REACH + 1))
    _estimate(*task, fastest, hardest, expected)
    cost = _speeds(*task, expected, beside, speeds)
    if not math.isfinite(cost):
        return None, int(speeds[0])
    return speeds, -1
