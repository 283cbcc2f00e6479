"""Speed along a track with known yaw, by dynamic programming.

Squared speed is on an even grid and acceleration constant between samples. The power model prices
every step with its acceleration, turning and bend: ramps at start, stop and corners are paid for,
and braking earns what it gives back. Limits hold at every step.

As in yaw_kernel, changes of speed are first estimated, here by even driving. Only those near the
best profile so far are priced, until that profile has exact prices alone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.motion_row import empty_block
from planner.search.conditions import OperatingConditions
from planner.search.kernel_arguments import B3, EAGER, F1, F3, MODEL_ARRAYS, Steps
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
from planner.search.trajectory.speed_prices import Block, correct, price_near
from planner.search.trajectory.track import Track
from planner.search.trajectory.yaw import YawProfile

LAZY_ROUNDS = 24
"""Rounds of pricing after which estimates no longer count."""
MOST_ROUNDS = 20 * LAZY_ROUNDS
"""Rounds at most, so that the loop ends."""
SAME_COST = 1e-9
"""J or s by which a level's cost may differ from that of the round before and count as the same."""


class KnownStretch(NamedTuple):
    """Costs that are known on a stretch of a track.

    Attributes:
        ends: its first and last sample, and its largest speed, m/s.
        expected: (steps, levels, 2·reach + 1) costs of changes of speed.
        exact: which of them are exact.
    """

    ends: tuple[int, int, float]
    expected: Array
    exact: NDArray[np.bool_]


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


@njit(types.boolean(BLOCK_KERNEL, MODEL_ARRAYS, STRETCH, F3, B3, types.int64, F1), **EAGER)
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
        price_near(
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
        correct(chosen, fresh, guess, exact, expected)
    return False


def speed_profile(
    conditions: OperatingConditions,
    track: Track,
    yaw: YawProfile,
    steps: Steps,
    beside: int,
    levels: int,
    fastest: Array,
    hardest: Array,
    known: list[KnownStretch] | None = None,
    changed: NDArray[np.bool_] | None = None,
) -> tuple[Array | None, int]:
    """Speed (n,) at every sample, or None and the sample where no speed leads further.

    Args:
        conditions: model and conditions.
        track, yaw, steps: samples of the path, yaw there, and the steps between.
        beside: levels to either side of the best ones that the power model prices as well.
        levels: of speed at most.
        fastest, hardest: (steps,) m/s and (steps, 2) m/s², speeding up and slowing down, at most.
        known: what an earlier call for the same track and yaw found, under limits no lower; this
            one adds to it.
        changed: (steps,) of these, where the yaw is another one and limits may be higher; None for
            nowhere.
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
    count = min(levels, level_count(conditions, track))
    surface = surface_lengths(track, steps.slopes)
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
        )
        at_most = fastest[part], hardest[part]
        if number < len(known) and known[number].ends != (first, last, top):
            del known[number:]
        if number == len(known):
            reach = reach_of(top, count, float(surface[part].max()), acceleration)
            expected = np.empty((last - first, count, 2 * reach + 1))
            estimate(kernel, arrays, stretch, *at_most, expected)
            exact = np.zeros(expected.shape, np.bool_)
            known.append(KnownStretch((first, last, top), expected, exact))
        else:
            _, expected, exact = known[number]
            if changed is not None and changed[part].any():
                again = np.flatnonzero(changed[part])
                anew = np.empty((len(again), *expected.shape[1:]))
                estimate(
                    kernel, arrays, stretch.some(again), at_most[0][again], at_most[1][again], anew
                )
                expected[again], exact[again] = anew, False
            forbid(stretch, top, *at_most, expected)
        if not _speeds(kernel, arrays, stretch, expected, exact, beside, speeds[first : last + 1]):
            return None, first + int(speeds[first])
    return speeds, -1
