"""Speed along a track with known yaw, by dynamic programming.

Squared speed is on an even grid and acceleration constant between samples. The power model prices
every step with its acceleration, turning and bend: ramps at start, stop and corners are paid for,
and braking earns what it gives back. Limits hold at every step.

As in yaw_kernel, changes of speed are first estimated, here by even driving. Only those near the
best profile so far are priced, until that profile has exact prices alone.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.limits import broken_in_block
from planner.power.motion_row import empty_block, put_row, set_acceleration, set_motion, set_wind
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.kernel_arguments import B3, F1, F3, MODEL_ARRAYS, Steps
from planner.search.trajectory.speed_estimate import (
    STRETCH,
    Stretch,
    estimate,
    forbid,
    level_count,
    levels,
    reach_of,
    stretches_of,
    surface_lengths,
)
from planner.search.trajectory.track import Track
from planner.search.trajectory.yaw_profile import YawProfile

LAZY_ROUNDS = 24
"""Rounds of pricing after which estimates no longer count."""
MOST_ROUNDS = 20 * LAZY_ROUNDS
"""Rounds at most, so that the loop ends."""
SAME_COST = 1e-9
"""J or s by which a level's cost may differ from that of the round before and count as the same."""
_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]
_SLOPE_RATE = INDEX["slope_rate"]
# Gauss-Legendre nodes and weights on [0, 1], exact for cubics.
_TWO = ((0.5 - math.sqrt(3) / 6, 0.5), (0.5 + math.sqrt(3) / 6, 0.5))


KnownCosts = list[tuple[Array, NDArray[np.bool_]]]
"""By stretch of a track, costs of changes of speed (steps, levels, 2·reach + 1), and which of them
are exact."""


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
    place: int,
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
        steepest[_VX], steepest[_VY], steepest[_WZ] = vx * faster, vy * faster, turn / time
        set_acceleration(steepest, acceleration, sideways, vx, vy, 1.0)
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
    return count


@njit(cache=True, error_model="numpy")
def _book(
    found: Any,
    size: int,
    limits: Any,
    objective: int,
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
            # Of profiles that take as long, the one that needs less energy.
            expected[j, a, at] += (1e-6 if objective == 1 else 1.0) * (found[k] * shares[k])


@njit(cache=True, error_model="numpy")
def relax(expected: Any, exact: Any, only: bool, fresh: Any, cost: Any, came: Any) -> None:
    """Least cost of reaching every level at every sample, over the least at that sample.

    Where no step's costs are fresh and those of the levels come out as before, the rest stays.

    Args:
        expected: (steps, levels, 2·reach + 1) cost of every change of level.
        exact: which of them the power model has priced.
        only: whether others are left out.
        fresh: (steps,) whose costs changed since the call before.
        cost: (steps + 1, levels), brought up to date.
        came: (steps + 1, levels) level at the sample before, brought up to date.
    """
    count, wide = expected.shape[1], expected.shape[2]
    reach = wide // 2
    # With room for changes beyond the grid: the inner loop runs in the processor's vector units.
    # There, numbers of levels are floats as costs are.
    next_cost, origin = np.empty(count + 2 * reach), np.empty(count + 2 * reach)
    within = next_cost[reach : reach + count]
    same = True
    for j in range(expected.shape[0]):
        if same and not fresh[j]:
            continue
        next_cost[:] = np.inf
        for a in range(count):
            here, number = cost[j, a], float(a)
            if here == np.inf:
                continue
            if only:
                for k in range(wide):
                    if exact[j, a, k] and here + expected[j, a, k] < next_cost[a + k]:
                        next_cost[a + k], origin[a + k] = here + expected[j, a, k], number
                continue
            for k in range(wide):
                total = here + expected[j, a, k]
                better = total < next_cost[a + k]
                next_cost[a + k] = total if better else next_cost[a + k]
                origin[a + k] = number if better else origin[a + k]
        least = within.min()
        same = True
        for b in range(count):
            over = np.inf
            if within[b] < np.inf:
                over, came[j + 1, b] = within[b] - least, int(origin[b + reach])
            same &= over == cost[j + 1, b] or abs(over - cost[j + 1, b]) <= SAME_COST
            cost[j + 1, b] = over


@njit(cache=True, error_model="numpy")
def _price_near(
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
    objective, most = stretch.objective, stretch.acceleration
    columns, found, shares, owners = block
    row, unit = np.empty(class_rows.shape[1]), np.empty(2)
    count, reach = expected.shape[1], expected.shape[2] // 2
    size = 0
    for j in range(fresh.shape[0]):
        if not fresh[j]:
            continue
        p, q = chosen[j], chosen[j + 1]
        row[:] = class_rows[ground[j]]
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
                    _book(found, size, limits, objective, owners, shares, expected)
                    size = 0
                # Written out: a tuple of arrays on every call costs more than the call.
                rows = _put_ramp(
                    columns,
                    size,
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
                    if objective == 1:
                        expected[j, a, at] = 2.0 * bend[0] / (level[a] + level[b])
                for k in range(size, size + rows):
                    owners[k] = j, a, at
                size += rows
    kernel(columns, size, parameters, body, wheels, found)
    _book(found, size, limits, objective, owners, shares, expected)
    for j in range(fresh.shape[0]):
        p, q = chosen[j], chosen[j + 1]
        if fresh[j] and expected[j, p, q - p + reach] == np.inf:
            below[j] = min(max(1, 2 * below[j]), count)


@njit(cache=True, error_model="numpy")
def _correct(chosen: Any, fresh: Any, guess: Any, exact: Any, expected: Any) -> None:
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


@njit(
    types.boolean(BLOCK_KERNEL, MODEL_ARRAYS, STRETCH, F3, B3, types.int64, F1),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def _speeds(
    kernel: Any,
    arrays: Any,
    stretch: Stretch,
    expected: Any,
    exact: Any,
    beside: int,
    speeds: Any,
) -> bool:
    """Whether a profile exists; the best one is written to ``speeds``.

    Without any, speeds[0] is the last sample that can be reached. The estimates in ``expected``
    are replaced by exact costs as they are found, as ``exact`` says.
    """
    columns, found = empty_block()
    owners = np.empty((BLOCK, 3), np.int64)
    block = Block(columns, found, np.empty(BLOCK), owners)
    steps = stretch.yaw.shape[0]
    count, reach = expected.shape[1], expected.shape[2] // 2
    cost = np.empty((steps + 1, count))
    came = np.empty((steps + 1, count), np.int64)
    chosen = np.zeros(steps + 1, np.int64)
    level = levels(arrays.limits[0], count)
    fresh, guess = np.empty(steps, np.bool_), np.empty(steps)
    below = np.zeros(steps, np.int64)
    cost[0] = np.inf
    cost[0, 0] = 0.0
    nothing = before = False
    fresh[:] = True  # steps whose costs the last round changed
    for attempt in range(MOST_ROUNDS):
        only = attempt >= LAZY_ROUNDS and not nothing
        if only != before:
            before, fresh[:] = only, True
        relax(expected, exact, only, fresh, cost, came)
        nothing = cost[steps, 0] == np.inf
        if nothing:
            if only:
                continue  # exact prices lead nowhere yet: estimates count again
            for j in range(steps + 1):
                if cost[j].min() < np.inf:
                    speeds[0] = j
            return False
        q = 0
        for j in range(steps, 0, -1):
            chosen[j] = q
            speeds[j] = level[q]
            q = came[j, q]
        for j in range(steps):
            p, at = chosen[j], chosen[j + 1] - chosen[j] + reach
            fresh[j] = not exact[j, p, at]
            guess[j] = expected[j, p, at]
        if not fresh.any():
            return True
        _price_near(
            kernel,
            arrays,
            stretch,
            block,
            level,
            chosen,
            fresh,
            beside,
            below,
            exact,
            expected,
        )
        _correct(chosen, fresh, guess, exact, expected)
    return False


def speed_profile(
    conditions: OperatingConditions,
    track: Track,
    yaw: YawProfile,
    steps: Steps,
    objective: int,
    beside: int,
    fastest: Array,
    hardest: Array,
    known: KnownCosts | None = None,
) -> tuple[Array | None, int]:
    """Speed (n,) at every sample, or None and the sample where no speed leads further.

    Args:
        conditions: model and conditions.
        track, yaw, steps: samples of the path, yaw there, and the steps between.
        objective: 1 minimises time, anything else energy.
        beside: levels to either side of the best ones that the power model prices as well.
        fastest, hardest: (steps,) m/s and (steps, 2) m/s², speeding up and slowing down, at most.
        known: what an earlier call for the same track and yaw found, under limits no lower; this
            one adds to it.
    """
    known = [] if known is None else known
    stops = track.stops | (np.abs(yaw.leaving - yaw.arriving) > 1e-9)
    turns = yaw.arriving[1:] - yaw.leaving[:-1]
    speeds = np.zeros(len(track.points))
    kernel, acceleration = (
        conditions.model.limits_kernel,
        conditions.model.vehicle.limits.acceleration,
    )
    middle = yaw.leaving[:-1] + 0.5 * turns
    count, surface = level_count(conditions, track), surface_lengths(track, steps.slopes)
    pieces = stretches_of(conditions, track, steps.slopes, stops, turns)
    for number, (first, last, top) in enumerate(pieces):
        part, limits = slice(first, last), conditions.limits.copy()
        limits[0] = top
        arrays = conditions.arrays._replace(limits=limits)
        stretch = Stretch(
            steps.part(first, last),
            middle[part],
            turns[part],
            stops[first : last + 1],
            acceleration,
            objective,
        )
        if number == len(known):
            reach = reach_of(top, count, float(surface[part].max()), acceleration)
            expected = np.empty((last - first, count, 2 * reach + 1))
            estimate(kernel, arrays, stretch, fastest[part], hardest[part], expected)
            known.append((expected, np.zeros(expected.shape, np.bool_)))
        else:
            forbid(stretch, top, fastest[part], hardest[part], known[number][0])
        if not _speeds(kernel, arrays, stretch, *known[number], beside, speeds[first : last + 1]):
            return None, first + int(speeds[first])
    return speeds, -1
