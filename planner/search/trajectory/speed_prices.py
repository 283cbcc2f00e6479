"""Prices of changes of speed near the best profile so far, out of the power model.

    price_near(kernel, arrays, stretch, block, ...)     # exact costs where estimates stood
    correct(chosen, fresh, guess, exact, expected)      # the other estimates, by the same error

speed_profile chooses among them. A step between two speeds is priced with its acceleration, turning
and bend, at two points of its time.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.kernels import BLOCK
from planner.power.limits import broken_in_block
from planner.power.motion_row import fill_row, put_row, set_acceleration, set_motion, set_wind
from planner.quantities import INDEX
from planner.search.trajectory.speed_estimate import Stretch

_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]
_SLOPE_RATE = INDEX["slope_rate"]
# Gauss-Legendre nodes and weights on [0, 1], exact for cubics.
_TWO = ((0.5 - math.sqrt(3) / 6, 0.5), (0.5 + math.sqrt(3) / 6, 0.5))


class Block(NamedTuple):
    """Rows that the power model prices together.

    Attributes:
        columns, found: values of the rows and results, as the kernel takes them.
        shares: (BLOCK,) s that a row's power counts for.
        owners: (BLOCK, 3) step, level at its start, and change of level.
    """

    columns: Array
    found: Array
    shares: Array
    owners: NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def _put_ramp(
    columns: Any,
    place: int | np.int64,
    row: Any,
    steepest: Any,
    unit: Any,
    bend: tuple[float, float, float, float],
    speeds: tuple[float, float],
    limits: Any,
    most_acceleration: float,
    shares: Any,
) -> int:
    """Rows of one step between two speeds, from ``place`` of a block on; their number, at most 3.

    None where the acceleration or the yaw rate is too large.

    Args:
        columns: of the block, written.
        place: row of the block.
        row: at the middle of the step.
        steepest: unless empty, at unit speed where its ground is steepest: only limits count there.
        unit: (2,) velocity at unit speed.
        bend: m along the ground, rad of turn, 1/m of the arc, and change of slope to the next step.
        speeds: m/s at both ends.
        limits: of OperatingConditions.
        most_acceleration: m/s².
        shares: of the Block, written.
    """
    surface, turn, curvature, slope_change = bend
    speed_a, speed_b = speeds
    acceleration = (speed_b * speed_b - speed_a * speed_a) / (2.0 * surface)
    time = 2.0 * surface / (speed_a + speed_b)
    faster = max(speed_a, speed_b)
    if abs(turn) * faster > limits[6] * surface * (1.0 + 1e-6):
        return 0
    sideways = faster * faster * curvature
    if math.hypot(acceleration, sideways) > most_acceleration * (1.0 + 1e-6):
        return 0
    count = 0
    if steepest.shape[0]:
        vx, vy = steepest[_VX], steepest[_VY]
        steepest[_VX], steepest[_VY] = vx * faster, vy * faster
        steepest[_WZ] = turn * faster / surface
        set_acceleration(steepest, acceleration, sideways, vx, vy, 1.0)
        put_row(columns, place, steepest)
        steepest[_VX], steepest[_VY] = vx, vy
        shares[place] = 0.0
        count = 1
    row[_SLOPE_RATE] = slope_change / time
    for at, share in _TWO:
        if speed_a == speed_b and at > 0.5:
            shares[place + count - 1] = time  # at even speed both nodes see the same
            break
        speed = speed_a + (speed_b - speed_a) * at
        row[_VX], row[_VY] = unit[0] * speed, unit[1] * speed
        row[_WZ] = turn * speed / surface
        set_acceleration(row, acceleration, speed * speed * curvature, unit[0], unit[1], 1.0)
        put_row(columns, place + count, row)
        shares[place + count] = share * time
        count += 1
    return count


@njit(cache=True, error_model="numpy")
def _book(
    found: Any,
    size: int | np.int64,
    limits: Any,
    owners: Any,
    shares: Any,
    expected: Any,
) -> None:
    """Add the model's results for a block's rows to the costs of the steps that own them."""
    for k in range(size):
        j, a, at = owners[k]
        if broken_in_block(found, k, limits) >= 0:
            expected[j, a, at] = np.inf
        else:
            expected[j, a, at] += found[k] * shares[k]


@njit(cache=True, error_model="numpy")
def price_near(
    kernel: Any,
    arrays: Any,
    stretch: Stretch,
    block: Block,
    level: Any,
    chosen: Any,
    fresh: Any,
    beside: int,
    below: Any,
    exact: Any,
    expected: Any,
) -> None:
    """Price the fresh steps of the best profile, at levels up to ``beside`` from its own.

    Where the profile's own change of level breaks a limit, twice as many further levels below it
    are priced the next time: one level a round would take a round for each.

    Args:
        kernel, arrays, stretch: of the power model, and what is driven.
        block: scratch.
        level: (levels,) m/s.
        chosen: (steps + 1,) the profile's levels.
        fresh: (steps,) whether a step is to be priced.
        beside: levels to either side.
        below: (steps,) further levels below the profile's own, brought up to date.
        exact, expected: which costs are exact, and the costs; brought up to date.
    """
    # Arrays by names of their own: taking them out of a tuple costs more than a look-up.
    parameters, body, wheels, class_rows, limits, wind = arrays
    directions, lengths, curvatures, slopes, steep, ground = stretch.steps
    yaw, turns = stretch.yaw, stretch.turns
    most = stretch.acceleration
    columns, found, shares, owners = block
    row, unit = np.empty(class_rows.shape[1]), np.empty(2)
    count, reach = expected.shape[1], expected.shape[2] // 2
    size = 0
    for j in range(fresh.shape[0]):
        if not fresh[j]:
            continue
        p, q = chosen[j], chosen[j + 1]
        fill_row(row, class_rows[ground[j]])
        longer = set_motion(row, slopes[j, 0], slopes[j, 1], yaw[j], directions[j], 1.0)
        unit[0], unit[1] = row[_VX], row[_VY]
        set_wind(row, wind, yaw[j])
        steepest = row[:0]
        if steep[j]:
            steepest = row.copy()
            set_motion(steepest, slopes[j, 2], slopes[j, 3], yaw[j], directions[j], 1.0)
        change = 0.0
        if j + 1 < fresh.shape[0]:
            change = math.hypot(slopes[j + 1, 0] - slopes[j, 0], slopes[j + 1, 1] - slopes[j, 1])
        bend = lengths[j] * longer, turns[j], curvatures[j], change
        lowest = beside + below[j]
        for a in range(max(0, p - lowest), min(count, p + beside + 1)):
            for b in range(max(0, q - lowest), min(count, q + beside + 1)):
                at = b - a + reach
                if at < 0 or at > 2 * reach or exact[j, a, at] or expected[j, a, at] == np.inf:
                    continue
                exact[j, a, at] = True
                if size + 3 > BLOCK:
                    kernel(columns, size, parameters, body, wheels, found)
                    _book(found, np.int64(size), limits, owners, shares, expected)
                    size = 0
                # Written out: a tuple of arrays on every call costs more than the call.
                rows = _put_ramp(
                    columns,
                    np.int64(size),  # or it is compiled for a literal, too
                    row,
                    steepest,
                    unit,
                    bend,
                    (level[a], level[b]),
                    limits,
                    most,
                    shares,
                )
                expected[j, a, at] = np.inf
                if rows:
                    expected[j, a, at] = 0.0
                for k in range(size, size + rows):
                    owners[k, 0], owners[k, 1], owners[k, 2] = j, a, at
                size += rows
    kernel(columns, size, parameters, body, wheels, found)
    _book(found, np.int64(size), limits, owners, shares, expected)
    for j in range(fresh.shape[0]):
        p, q = chosen[j], chosen[j + 1]
        if fresh[j] and expected[j, p, q - p + reach] == np.inf:
            below[j] = min(max(1, 2 * below[j]), count)


@njit(cache=True, error_model="numpy")
def correct(chosen: Any, fresh: Any, guess: Any, exact: Any, expected: Any) -> None:
    """Correct the estimates of every fresh step by the error of the one that was priced."""
    reach = expected.shape[2] // 2
    for j in range(fresh.shape[0]):
        if not fresh[j]:
            continue
        p, q = chosen[j], chosen[j + 1]
        off = expected[j, p, q - p + reach] - guess[j]
        if off < np.inf:
            _shift(expected[j].reshape(-1), exact[j].reshape(-1), off)


@njit(cache=True, error_model="numpy")
def _shift(costs: Any, exact: Any, off: float) -> None:
    """Add ``off`` to all costs that are not exact, in the processor's vector units."""
    for n in range(costs.shape[0]):
        costs[n] += 0.0 if exact[n] else off
