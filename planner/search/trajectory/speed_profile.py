"""Speed along a track with known yaw, by dynamic programming.

Squared speed is on an even grid and acceleration constant between stations; the power model prices
every step with its acceleration, turning and bend, so that ramps at start, stop and corners are
paid for, and what braking gives back is earned. Limits hold at every step.

As in yaw_kernel, changes of speed are first estimated, here by even
driving, and only those near the best way so far are priced, until that way has nothing but exact
prices.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planner.arrays import Array
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.limits import BRIEFLY, broken_in_block
from planner.power.motion_row import empty_block, put_row, set_acceleration, set_motion, set_wind
from planner.quantities import INDEX
from planner.search.conditions import Circumstances
from planner.search.resolution import EVENLY, LEVELS, STILL
from planner.search.trajectory.speed_estimate import REACH, estimate, levels
from planner.search.trajectory.track import Track
from planner.search.trajectory.yaw_profile import YawProfile

ROUNDS = 24
"""Rounds of pricing after which the best speeds among the exact prices will do."""
SAME = 1e-9
"""J or s by which a level's cost may differ from that of the round before and be the same."""
_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_B1 = types.Array(types.boolean, 1, "C")
_F3 = types.Array(types.float64, 3, "C")
_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]
_SLOPE_RATE = INDEX["slope_rate"]
# Gauss-Legendre nodes and weights on [0, 1], exact for cubics.
_TWO = ((0.5 - math.sqrt(3) / 6, 0.5), (0.5 + math.sqrt(3) / 6, 0.5))


@njit(cache=True, error_model="numpy")
def _put_ramp(
    columns: Any,
    place: int,
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
    shares: Any,
    eases: Any,
) -> int:
    """Rows of one step between two speeds, from ``place`` of a block on; their number, at most 3.

    None where the acceleration or the yaw rate is too large.

    Args:
        row: at the middle of the step.
        steepest: unless empty, at unit speed where its ground is steepest: only limits count there.
        unit: (2,) velocity at unit speed.
        shares: (BLOCK,) written: s that a row's power counts for.
        eases: (BLOCK,) written: what the continuous torque may be, as a factor.
    """
    acceleration = (speed_b * speed_b - speed_a * speed_a) / (2.0 * surface)
    if abs(acceleration) > most_acceleration * (1.0 + 1e-6):
        return 0
    time = 2.0 * surface / (speed_a + speed_b)
    faster = max(speed_a, speed_b)
    if abs(turn) * faster > limits[6] * surface * (1.0 + 1e-6):
        return 0
    if faster * faster * abs(curvature) > most_acceleration * 1.1:
        return 0
    brief = abs(turn) > STILL or curvature != 0.0 or abs(acceleration) > 0.05 * most_acceleration
    count = 0
    if steepest.shape[0]:
        vx, vy = steepest[_VX], steepest[_VY]
        steepest[_VX], steepest[_VY], steepest[_WZ] = vx * faster, vy * faster, turn / time
        set_acceleration(steepest, acceleration, faster * faster * curvature, vx, vy, 1.0)
        put_row(columns, place, steepest)
        steepest[_VX], steepest[_VY] = vx, vy
        shares[place] = 0.0
        count = 1
    row[_WZ] = turn / time
    row[_SLOPE_RATE] = slope_change / time
    for at, share in _TWO:
        if speed_a == speed_b and at > 0.5:
            shares[place + count - 1] = time  # at even speed both nodes see the same
            break
        speed = speed_a + (speed_b - speed_a) * at
        row[_VX], row[_VY] = unit[0] * speed, unit[1] * speed
        set_acceleration(row, acceleration, speed * speed * curvature, unit[0], unit[1], 1.0)
        put_row(columns, place + count, row)
        shares[place + count] = share * time
        count += 1
    for k in range(place, place + count):
        eases[k] = BRIEFLY if brief else 1.0
    return count


@njit(cache=True, error_model="numpy")
def _book(
    found: Any,
    size: int,
    limits: Any,
    objective: int,
    owners: Any,
    shares: Any,
    eases: Any,
    expected: Any,
) -> None:
    """Add what the model found for a block's rows to the costs of the steps that own them."""
    for k in range(size):
        j, a, at = owners[k]
        if broken_in_block(found, k, limits, eases[k]) >= 0:
            expected[j, a, at] = np.inf
        else:
            # Of ways that take as long, the one that needs less energy.
            expected[j, a, at] += (1e-6 if objective == 1 else 1.0) * (found[k] * shares[k])


@njit(cache=True, error_model="numpy")
def relax(expected: Any, exact: Any, only: bool, fresh: Any, cost: Any, came: Any) -> None:
    """Least cost of reaching every level at every station, over the least at that station.

    Where no step's costs are fresh, and those of the levels come out as before, all that follows
    stays as it is.

    Args:
        expected: (steps, LEVELS, 2·REACH + 1) cost of every change of level.
        exact: which of them the power model has priced.
        only: whether others are left out.
        fresh: (steps,) whose costs are not those of the call before.
        cost: (steps + 1, LEVELS), brought up to date.
        came: (steps + 1, LEVELS) level at the station before, brought up to date.
    """
    ahead = np.empty(LEVELS)
    same = True
    for j in range(expected.shape[0]):
        if same and not fresh[j]:
            continue
        ahead[:] = np.inf
        for a in range(LEVELS):
            if cost[j, a] == np.inf:
                continue
            for b in range(max(0, a - REACH), min(LEVELS, a + REACH + 1)):
                at = b - a + REACH
                total = cost[j, a] + expected[j, a, at]
                if total < ahead[b] and (exact[j, a, at] or not only):
                    ahead[b] = total
                    came[j + 1, b] = a
        least = ahead.min()
        same = True
        for b in range(LEVELS):
            over = ahead[b] - least if ahead[b] < np.inf else np.inf
            same &= over == cost[j + 1, b] or abs(over - cost[j + 1, b]) <= SAME
            cost[j + 1, b] = over


@njit(
    types.boolean(
        *(BLOCK_KERNEL, _F1, _F1, _F2, _F2, _F1, _F1),
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
) -> bool:
    """Whether there are speeds; the best are written to ``speeds``.

    Without any, speeds[0] is the station where none leads on. What ``expected`` of
    speed_estimate holds is replaced by exact costs as they are found.
    """
    columns, found = empty_block()
    shares, eases = np.empty(BLOCK), np.empty(BLOCK)
    owners = np.empty((BLOCK, 3), np.int64)
    steps = lengths.shape[0]
    cost = np.empty((steps + 1, LEVELS))
    came = np.empty((steps + 1, LEVELS), np.int64)
    chosen = np.empty(steps + 1, np.int64)
    exact = np.zeros(expected.shape, np.bool_)
    level = levels(limits[0])
    row, unit = np.empty(class_rows.shape[1]), np.empty(2)
    fresh, guess = np.empty(steps, np.bool_), np.empty(steps)
    cost[0] = np.inf
    cost[0, 0] = 0.0
    nothing = before = False
    fresh[:] = True  # steps whose costs the last round changed
    for attempt in range(20 * ROUNDS):
        only = attempt >= ROUNDS and not nothing
        if only != before:
            before, fresh[:] = only, True
        relax(expected, exact, only, fresh, cost, came)
        if cost[steps, 0] == np.inf:
            if only:
                nothing = True  # what is priced leads nowhere yet
                continue
            for j in range(steps + 1):
                if cost[j].min() < np.inf:
                    speeds[0] = j
            return False
        nothing = False
        q = 0
        for j in range(steps, 0, -1):
            chosen[j] = q
            speeds[j] = level[q]
            q = came[j, q]
        chosen[0] = 0
        new, size = 0, 0
        for j in range(steps):
            p, q = chosen[j], chosen[j + 1]
            fresh[j] = not exact[j, p, q - p + REACH]
            if not fresh[j]:
                continue
            new += 1
            guess[j] = expected[j, p, q - p + REACH]
            row[:] = class_rows[ground[j]]
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
                    if size + 3 > BLOCK:
                        kernel(columns, size, parameters, body, wheels, found)
                        _book(found, size, limits, objective, owners, shares, eases, expected)
                        size = 0
                    count = _put_ramp(
                        columns,
                        size,
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
                        shares,
                        eases,
                    )
                    expected[j, a, at] = np.inf
                    if count:
                        expected[j, a, at] = 0.0
                        if objective == 1:
                            expected[j, a, at] = 2.0 * lengths[j] * stretch / (level[a] + level[b])
                    for k in range(size, size + count):
                        owners[k] = j, a, at
                    size += count
        if new == 0:
            return True
        kernel(columns, size, parameters, body, wheels, found)
        _book(found, size, limits, objective, owners, shares, eases, expected)
        for j in range(steps):
            if not fresh[j]:
                continue
            # What this guess was off by, its neighbours are off by as well.
            p, q = chosen[j], chosen[j + 1]
            off = expected[j, p, q - p + REACH] - guess[j]
            if off < np.inf:
                for a in range(LEVELS):
                    for at in range(2 * REACH + 1):
                        if not exact[j, a, at]:
                            expected[j, a, at] += off
    return False


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
    middle = yaw.leaving[:-1] + 0.5 * turns
    for first, last, top in _stretches(around, track, slopes, stops, turns):
        steps, limits = slice(first, last), around.limits.copy()
        limits[0] = top
        task = (
            model.limits_kernel,
            model.parameters,
            model.body,
            model.wheels,
            around.class_rows,
            limits,
            around.wind,
            track.directions[steps],
            track.lengths[steps],
            track.curvatures[steps],
            slopes[steps],
            middle[steps],
            turns[steps],
            grounds[steps],
            stops[first : last + 1],
            model.vehicle.limits.acceleration,
            objective,
        )
        expected = np.empty((last - first, LEVELS, 2 * REACH + 1))
        estimate(*task, fastest[steps], hardest[steps], expected)
        if not _speeds(*task, expected, beside, speeds[first : last + 1]):
            return None, first + int(speeds[first])
    return speeds, -1


def _stretches(
    around: Circumstances,
    track: Track,
    slopes: Array,
    stops: NDArray[np.bool_],
    turns: Array,
) -> list[tuple[int, int, float]]:
    """Stretches of a track to find speeds for: first and last station, and the largest speed, m/s.

    Usually one. Between two stops too close for the even grid of speeds, the robot cannot become
    fast: such a stretch gets a grid of its own, up to the speed that it allows.
    """
    top, acceleration = float(around.limits[0]), around.model.vehicle.limits.acceleration
    along = slopes[:, 0] * np.cos(track.directions) + slopes[:, 1] * np.sin(track.directions)
    surface = track.lengths * np.sqrt(1.0 + along * along)
    ends = np.flatnonzero(stops)
    way = np.concatenate([[0.0], np.cumsum(surface)])
    # Half of the way to speed up, half of it to slow down.
    reached = np.sqrt(acceleration * np.diff(way[ends]))
    found: list[tuple[int, int, float]] = []
    begun = 0
    for k in np.flatnonzero(reached < EVENLY * top):
        first, last = int(ends[k]), int(ends[k + 1])
        if begun < first:
            found.append((begun, first, top))
        turning = np.abs(turns[first:last]) / surface[first:last]
        rate = float(around.limits[6]) / max(float(turning.max()), 1e-12)
        found.append((first, last, min(float(reached[k]), rate)))
        begun = last
    if begun < len(surface):
        found.append((begun, len(surface), top))
    return found
