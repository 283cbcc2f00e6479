"""Yaw of a driven motion, turned by some degrees wherever that costs less at its own speeds.

    finer = refined_yaw(field, conditions, track, steps, yaw, motion, fixed)     # YawProfile

The yaw profile prices straight steps at the largest speed, with angles 5.6° apart. The motion is
slower at corners, speeds up and bends, and there another yaw costs less. So every sample of the
motion is priced again with the body turned a little. Dynamic programming chooses the turns at
waypoints along the track, first far apart, then close. The motion's cost at its speeds only falls.

At tight corners the largest yaw rate holds the speed down. There, a body that turns more evenly can
be driven faster, which costs at the same speeds do not show. ``evenly`` stands in for that.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.account import LIMITS
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.limits import LIMIT_NAMES, broken_in_block
from planner.power.motion_row import empty_block, put, put_row
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.kernel_arguments import B1, EAGER, F1, F2, I1, MODEL_ARRAYS, Steps, tuple_type
from planner.search.resolution import WIDTH
from planner.search.trajectory.motion import Motion
from planner.search.trajectory.refinement.driven_samples import driven_samples
from planner.search.trajectory.track import Track
from planner.search.trajectory.yaw import (
    SURROUNDINGS,
    Surroundings,
    YawProfile,
    crowded_at,
    waypoints_along,
)
from planner.terrain.footprint import touches

TURNED_AT = ((0.5, (1.0, 0.5)), (0.1, (1.0, 0.5, 0.25, 0.1)), (0.03, (0.25, 0.1, 0.03)))
"""m between waypoints, and the turns that are tried there, in states of the yaw profile (5.6°).

On a side slope, rollers that turn downhill help to hold the robot, those that turn uphill drag.
Between the two lies a fraction of a degree, and so small turns save much.
"""
NO_FURTHER = 1.1
"""Waypoints of the second distance per waypoint of the first, below which the first is left out:
where samples of the track lie further apart, the second tries the same turns at the same places."""
FAST_TURN, FAST_PENALTY = 0.8, 0.2
"""Share of the largest yaw rate from which a sample gets a penalty where the body is to turn
evenly, and that penalty at the rate itself, as a share of what the sample costs."""
REPEATS = 3
"""Times at most that each turn is tried."""
BROKEN = 1e6
"""J that a sample counts for at which a limit is broken. No motion takes as much, so that yaws
which keep the limits come first."""
MOST_REFUSED = 24
"""Times at most that turns which touch something are left out."""
_SIDES = (-1, 0, 1)
"""A waypoint turns to one side, stays, or turns to the other."""
CHANGES = tuple((a, b) for a in _SIDES for b in _SIDES if abs(a - b) <= 1)
"""Turns of the waypoints before and after a piece, in multiples of the turn that is tried."""
_VX, _VY, _AX, _AY = INDEX["vx"], INDEX["vy"], INDEX["ax"], INDEX["ay"]
_GX, _GY, _GN = INDEX["gravity_x"], INDEX["gravity_y"], INDEX["gravity_normal"]
_WIND_X, _WIND_Y, _WZ = INDEX["wind_x"], INDEX["wind_y"], INDEX["wz"]
_LEAST_LOAD, _CURRENT, _, _TORQUE, _TRACTION_LEFT = range(1, 1 + len(LIMITS))
"""Results of the power model for a row, behind the power."""
_TRACTION = LIMIT_NAMES.index("traction")
_TURNED = ((_VX, _VY), (_AX, _AY), (_GX, _GY), (_WIND_X, _WIND_Y))


class Samples(NamedTuple):
    """Samples of a motion, and where they lie between waypoints.

    Attributes:
        rows: (n, ROW_LENGTH) of the power model.
        seconds: (n,) that each stands for.
        piece: (n,) the waypoint before it, ascending.
        share: (n,) of the way to the next waypoint.
        pace: (n,) 1/s, by which that share grows.
        torque: (n,) N·m, the most that a motor may give: for good, or what it gave before.
        grip: (n,) least share of the traction that has to stay: TRACTION_RESERVE, or what was left
            before.
    """

    rows: Array
    seconds: Array
    piece: NDArray[np.int64]
    share: Array
    pace: Array
    torque: Array
    grip: Array


class Places(NamedTuple):
    """Places at which the turns are chosen.

    Attributes:
        at: (waypoints,) samples of the track.
        free: (waypoints,) whether the yaw may change there.
        along: (samples,) m from the start to each sample of the track.
        arriving, leaving: (samples,) rad, yaw before and after turning there on the spot.
    """

    at: NDArray[np.int64]
    free: NDArray[np.bool_]
    along: Array
    arriving: Array
    leaving: Array


_SAMPLES = tuple_type(Samples, F2, F1, I1, F1, F1, F1, F1)
_PLACES = tuple_type(Places, I1, B1, F1, F1, F1)


@njit(cache=True, error_model="numpy")
def turned_on_ground(row: Any) -> float:
    """By how much the body turns on its ground when its yaw grows by 1.

    Yaw is an azimuth, an angle on the map. The ground is inclined against that.
    """
    x, y, n = row[_GX] * row[_GX], row[_GY] * row[_GY], row[_GN] * row[_GN]
    if x + y == 0.0:
        return 1.0
    steepness = n / (x + y + n)  # squared cosine of the slope
    return float((x * steepness + y) / ((x + y) * math.sqrt(steepness)))


@njit(cache=True, error_model="numpy")
def _price(
    kernel: Any,
    arrays: Any,
    samples: Any,
    stale: Any,
    block: Any,
    turn: float,
    penalty: float,
    price: Any,
) -> None:
    """Cost of stale pieces with their waypoints turned, into ``price`` (pieces, 3, 3).

    Samples go through the model side by side; of each, only what a turn changes is written again.
    """
    parameters, body, wheels, _, limits, _ = arrays
    rows, seconds, piece, share, pace, torque, grip = samples
    columns, found = block
    chosen, on_slope = np.empty(BLOCK, np.int64), np.empty(BLOCK)
    for k in range(stale.shape[0]):
        if stale[k]:
            price[k] = 0.0
    n = 0
    while n < rows.shape[0]:
        size = 0
        while n < rows.shape[0] and size < BLOCK:
            if stale[piece[n]]:
                put_row(columns, size, rows[n])
                chosen[size] = n
                on_slope[size] = turned_on_ground(rows[n])
                size += 1
            n += 1
        for a, b in CHANGES:
            for i in range(size):
                j = chosen[i]
                w = share[j]
                # Exact to 1e-9 for turns of less than six degrees.
                angle = on_slope[i] * turn * ((1.0 - w) * a + w * b)
                squared = angle * angle
                c = 1.0 - 0.5 * squared * (1.0 - squared / 12.0)
                s = angle * (1.0 - squared / 6.0 * (1.0 - squared / 20.0))
                for x, y in _TURNED:
                    forward, left = rows[j, x], rows[j, y]
                    put(columns, i, x, c * forward + s * left)
                    put(columns, i, y, c * left - s * forward)
                put(columns, i, _WZ, rows[j, _WZ] + turn * (b - a) * pace[j])
            kernel(columns, size, parameters, body, wheels, found)
            for i in range(size):
                j = chosen[i]
                rate = rows[j, _WZ] + turn * (b - a) * pace[j]
                fast = max(0.0, abs(rate) / limits[6] - FAST_TURN) / (1.0 - FAST_TURN)
                cost = found[i] * seconds[j]
                cost += penalty * fast * abs(cost)
                number = broken_in_block(found, i, limits)
                broken = number >= 0 and number != _TRACTION
                broken |= found[_TRACTION_LEFT * BLOCK + i] < grip[j]
                broken |= found[_TORQUE * BLOCK + i] > torque[j]
                broken |= abs(rate) > limits[6] * (1.0 + 1e-6)
                cost += BROKEN * broken
                price[piece[j], a + 1, b + 1] += cost


@njit(cache=True, error_model="numpy")
def cheapest(price: Any, free: Any, chosen: Any) -> bool:
    """Choose a turn, or another change, -1, 0 or 1, at every waypoint; whether any is not 0."""
    waypoints = free.shape[0]
    cost = np.full((waypoints, 3), np.inf)
    came = np.zeros((waypoints, 3), np.int64)
    for a in _SIDES:
        if a == 0 or free[0]:
            cost[0, a + 1] = 0.0
    for k in range(waypoints - 1):
        for a, b in CHANGES:
            total = cost[k, a + 1] + price[k, a + 1, b + 1]
            if (b == 0 or free[k + 1]) and total < cost[k + 1, b + 1]:
                cost[k + 1, b + 1], came[k + 1, b + 1] = total, a
    at = int(np.argmin(cost[waypoints - 1])) - 1
    if cost[waypoints - 1, at + 1] >= cost[waypoints - 1, 1]:
        at = 0  # of equal ones, what is there
    turns = False
    for k in range(waypoints - 1, -1, -1):
        chosen[k] = at
        turns |= at != 0
        at = came[k, at + 1]
    return turns


@njit(cache=True, error_model="numpy")
def _touching(conditions: Any, waypoints: Any, k: int, before: float, after: float) -> bool:
    """Whether the body touches something on piece ``k`` with its ends turned by these angles."""
    blocked, frame, points, crowded = conditions
    at, _, along, arriving, leaving = waypoints
    first, last = at[k], at[k + 1]
    growth = (after - before) / (along[last] - along[first])
    for j in range(first, last):
        if not (crowded[j] or crowded[j + 1]):
            continue
        begun = leaving[j] + before + growth * (along[j] - along[first])
        turn = arriving[j + 1] - leaving[j] + growth * (along[j + 1] - along[j])
        x, y, to_x, to_y = points[j, 0], points[j, 1], points[j + 1, 0], points[j + 1, 1]
        if touches(blocked, frame, x, y, to_x, to_y, begun, turn):
            return True
    return False


@njit(
    types.void(BLOCK_KERNEL, MODEL_ARRAYS, _SAMPLES, _PLACES, SURROUNDINGS, F1, types.float64, F1),
    **EAGER,
)
def _turned(
    kernel: Any,
    arrays: Any,
    samples: Any,
    waypoints: Any,
    conditions: Any,
    turns: Any,
    penalty: float,
    total: Any,
) -> None:
    """Turn the motion where that costs less: its rows, and every waypoint's turn, in ``total``.

    Args:
        kernel, arrays: of the power model.
        samples: Samples; the rows are turned.
        waypoints: Places.
        conditions: Surroundings of the track.
        turns: rad, tried one after the other.
        penalty: share by which a sample costs more at the largest yaw rate.
        total: written.
    """
    rows, _, piece, share, pace, _, _ = samples
    count = total.shape[0]
    block = empty_block()
    price = np.empty((count - 1, 3, 3))
    stale, known = np.empty(count - 1, np.bool_), np.empty((count - 1, 3, 3), np.bool_)
    chosen = np.empty(count, np.int64)
    total[:] = 0.0
    for turn in turns:
        stale[:] = True
        for _ in range(REPEATS):
            _price(kernel, arrays, samples, stale, block, turn, penalty, price)
            known[:] = False
            moved = False
            for _ in range(MOST_REFUSED):
                moved = cheapest(price, waypoints.free, chosen)
                touched = False
                for k in range(count - 1):
                    a, b = chosen[k], chosen[k + 1]
                    if (a == 0 and b == 0) or known[k, a + 1, b + 1]:
                        continue
                    known[k, a + 1, b + 1] = True
                    before, after = total[k] + a * turn, total[k + 1] + b * turn
                    if _touching(conditions, waypoints, k, before, after):
                        price[k, a + 1, b + 1] = np.inf
                        touched = True
                if not touched:
                    break
                moved = False
            if not moved:
                break
            for k in range(count):
                total[k] += chosen[k] * turn
            for k in range(count - 1):
                stale[k] = chosen[k] != 0 or chosen[k + 1] != 0
            for n in range(rows.shape[0]):
                a, b = chosen[piece[n]], chosen[piece[n] + 1]
                if a == 0 and b == 0:
                    continue
                angle = turned_on_ground(rows[n]) * turn * ((1.0 - share[n]) * a + share[n] * b)
                c, s = math.cos(angle), math.sin(angle)
                for x, y in _TURNED:
                    forward, left = rows[n, x], rows[n, y]
                    rows[n, x], rows[n, y] = c * forward + s * left, c * left - s * forward
                rows[n, _WZ] += turn * (b - a) * pace[n]


def refined_yaw(
    field: CostField,
    conditions: OperatingConditions,
    track: Track,
    steps: Steps,
    yaw: YawProfile,
    motion: Motion,
    fixed: NDArray[np.bool_],
    *,
    evenly: bool = False,
) -> YawProfile:
    """The yaw of a motion, turned where that costs less at its speeds.

    Args:
        field: map and costs.
        conditions: model and conditions.
        track, steps, yaw: samples of the path, the steps between, and yaw there.
        motion: along them.
        fixed: (samples,) where the yaw stays as it is.
        evenly: whether turning near the largest yaw rate gets a penalty.
    """
    fixed = fixed | (np.abs(yaw.leaving - yaw.arriving) > 1e-9)
    driven = driven_samples(field, conditions, track, steps, yaw, motion)
    rows, seconds, place, speed, torque, grip = driven
    along = np.concatenate([[0.0], np.cumsum(track.lengths)])
    surroundings = Surroundings(
        field.blocked, field.body_frame(), track.points, crowded_at(field, track.points)
    )
    arriving, leaving = yaw.arriving, yaw.leaving
    levels = [(waypoints_along(along, spacing, fixed), turns) for spacing, turns in TURNED_AT]
    if len(levels[1][0]) < NO_FURTHER * len(levels[0][0]):
        del levels[0]
    for at, turns in levels:
        piece = np.clip(np.searchsorted(along[at], place, side="right") - 1, 0, len(at) - 2)
        span = np.diff(along[at])[piece]
        share = (place - along[at][piece]) / span
        total = np.empty(len(at))
        _turned(
            *(conditions.model.limits_kernel, conditions.arrays),
            Samples(rows, seconds, piece, share, speed / span, torque, grip),
            Places(at, ~fixed[at], along, arriving, leaving),
            surroundings,
            WIDTH * np.array(turns),
            FAST_PENALTY if evenly else 0.0,
            total,
        )
        added = np.interp(along, along[at], total)
        arriving, leaving = arriving + added, leaving + added
    return YawProfile(arriving, leaving, yaw.cost)
