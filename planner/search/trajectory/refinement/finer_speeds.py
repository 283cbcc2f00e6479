"""Speeds of a driven motion, changed between the levels of the speed profile where that saves.

    finer = finer_speeds(field, conditions, motion)      # Motion, within all limits

The speed profile chooses among some dozen levels, and sees the ground in the middle of each step.
Here every sample's squared speed grows or falls by part of a level, or stays, and steps are priced
along their ground, as the account does. Dynamic programming chooses, first among large changes,
then among small ones. Path, yaw and stops stay, so that the body touches nothing new. Where a limit
breaks between the rows that were priced, the speeds stay, and the rest is chosen again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.motion_row import empty_block, put, put_row
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.kernel_arguments import B1, EAGER, F1, F2, F3, I1, MODEL_ARRAYS, tuple_type
from planner.search.resolution import CREEP, LEVELS, SLOWEST
from planner.search.trajectory.heat import overheated
from planner.search.trajectory.limit_checks import (
    NEAR_A_LIMIT,
    ROUNDING,
    Kept,
    broken_limits,
    coarse_pieces,
    limit_shares,
    rows_on_arcs,
)
from planner.search.trajectory.motion import Motion, motion_rows, pieces_of
from planner.search.trajectory.refinement.driven_samples import SAMPLED_CELLS
from planner.search.trajectory.refinement.yaw_refinement import BROKEN, CHANGES, cheapest

CHANGED_BY = (0.5, 0.2, 0.07)
"""Changes of the squared speed that are tried one after the other, in levels of the profile."""
EACH_TRIED = 6
"""Times at most that each change is tried; later ones look only at what changed before."""
RESERVE = 0.002
"""Share of every limit that stays, or what was left before: ends of steps are not among the rows,
and the answer is checked more closely."""
ATTEMPTS = 4
"""Choices at most until all limits are kept, each without the ends of steps that broke one."""
LEAST = 1e-12
"""m and m/s instead of none, to divide by."""
_VX, _VY, _AX, _AY = INDEX["vx"], INDEX["vy"], INDEX["ax"], INDEX["ay"]
_PACED = (_VX, _VY, INDEX["wz"], INDEX["slope_rate"])
"""Quantities that grow with the speed."""
_SIGNS = (-1.0, 1.0, 1.0, 1.0, -1.0)
"""Of the model's results behind the power: least load and traction left may fall to a limit."""
# By how many changes the speeds at both ends of a step differ, (changes, 1).
_BEFORE, _AFTER = np.array(CHANGES).T[:, :, None]


class Driven(NamedTuple):
    """Steps of a motion, and rows of the power model along them.

    Attributes:
        rows: (n, ROW_LENGTH), at 1 m/s.
        step: (n,) that each belongs to.
        at, share: (n,) part of the step's time until then, and that the row stands for.
        most: (n, limits) that the results times ``_SIGNS`` may come to.
        surface, curvatures, turns: (steps,) m along the ground, 1/m, and rad; no m on the spot.
    """

    rows: Array
    step: NDArray[np.int64]
    at: Array
    share: Array
    most: Array
    surface: Array
    curvatures: Array
    turns: Array


_DRIVEN = tuple_type(Driven, F2, I1, F1, F1, F2, F1, F1, F1)


def finer_speeds(field: CostField, conditions: OperatingConditions, motion: Motion) -> Motion:
    """A motion with other speeds, within all limits; the same one where there are none.

    Args:
        field, conditions: map, model and conditions.
        motion: within all limits.
    """
    driven = _driven(field, conditions, motion)
    top = _top_speeds(conditions, motion, driven.surface)
    free, kept = motion.speed > 0.0, Kept(motion, np.ones(len(motion.x) - 1, bool))
    for _ in range(ATTEMPTS):
        squared = motion.speed**2
        for levels in CHANGED_BY:
            _change(conditions, driven, free, top, levels, squared)
        finer = _at_speeds(motion, driven.surface, np.sqrt(squared))
        broken = broken_limits(field, conditions, finer, finely=True, kept=kept)
        if not broken:
            return motion if overheated(field, conditions, finer) else finer
        kept = Kept.by(finer, broken)
        free[broken.steps] = free[broken.steps + 1] = False
    return motion


def _top_speeds(conditions: OperatingConditions, motion: Motion, surface: Array) -> Array:
    """(samples,) m/s, the profile's largest level there: less between two close stops."""
    stops = np.flatnonzero(motion.speed == 0.0)
    travelled = np.append(0.0, np.cumsum(surface))
    reached = np.sqrt(conditions.model.vehicle.limits.acceleration * np.diff(travelled[stops]))
    after = np.clip(np.searchsorted(stops, np.arange(len(travelled))), 1, len(reached))
    return np.asarray(np.minimum(reached[after - 1], conditions.limits[0]))


def _driven(field: CostField, conditions: OperatingConditions, motion: Motion) -> Driven:
    """A motion's rows, and where a limit is near more of them, which stand for no time."""
    inputs = field, motion, conditions.class_rows, conditions.wind
    rows, seconds, step = motion_rows(*inputs, pieces_of(field, motion, SAMPLED_CELLS))
    pieces = coarse_pieces(field, motion)
    closer, _, close = motion_rows(*inputs, pieces)
    beside = conditions.model.power_and_limits(closer)
    used = limit_shares(conditions, beside).max(axis=1)
    asked = np.isin(np.arange(len(pieces)), close[used >= NEAR_A_LIMIT])
    bends, bent = rows_on_arcs(field, conditions, motion, np.where(asked, pieces, 0))
    driven, arcs = map(conditions.model.power_and_limits, (rows, bends))
    found = np.concatenate([driven, beside, arcs])
    rows, step = np.concatenate([rows, closer, bends]), np.concatenate([step, close, bent])
    seconds = np.append(seconds, np.zeros(len(close) + len(bent)))
    near = (limit_shares(conditions, found) >= NEAR_A_LIMIT).any(axis=1)
    chords = np.hypot(np.diff(motion.x), np.diff(motion.y))
    surface = np.where(chords > 1e-9, np.hypot(chords, np.diff(motion.heights)), 0.0)
    chosen = np.flatnonzero((near | (seconds > 0.0)) & (surface[step] > 0.0))
    chosen = chosen[np.argsort(step[chosen], kind="stable")]
    rows, step, used = rows[chosen], step[chosen], found[chosen, 1:] * _SIGNS
    own_load = conditions.mass * STANDARD_GRAVITY / len(conditions.model.wheels)
    most = [-RESERVE * own_load, *(1.0 - RESERVE) * conditions.limits[1:4], -RESERVE]
    rows[:, list(_PACED)] /= np.hypot(rows[:, _VX], rows[:, _VY])[:, None]
    lasting = np.diff(motion.time)[step]
    return Driven(
        *(rows, step, (rows[:, INDEX["time_since_start"]] - motion.time[step]) / lasting),
        *(seconds[chosen] / lasting, np.maximum(most, used)),
        *(surface, motion.curvatures, np.diff(motion.yaw)),
    )


def _change(
    conditions: OperatingConditions,
    driven: Driven,
    free: NDArray[np.bool_],
    top: Array,
    levels: float,
    squared: Array,
) -> None:
    """Change squared speeds (samples,) by some levels where they are free and that costs less."""
    by = levels * top**2 / (LEVELS - len(CREEP))
    stale = np.ones(len(driven.surface), bool)
    price, chosen = np.zeros((len(stale), 3, 3)), np.empty(len(squared), np.int64)
    for _ in range(EACH_TRIED):
        price[stale] = _prices(conditions, driven, squared, by, top, stale)[stale]
        if not cheapest(price, free, chosen):
            return
        squared += chosen * by
        stale = (chosen[1:] != 0) | (chosen[:-1] != 0)


def _prices(
    conditions: OperatingConditions,
    driven: Driven,
    squared: Array,
    by: Array,
    top: Array,
    stale: NDArray[np.bool_],
) -> Array:
    """Costs (steps, 3, 3) of stale steps with the squared speeds at their ends changed."""
    limits = conditions.model.vehicle.limits
    surface, price = np.maximum(driven.surface, LEAST), np.zeros((len(stale), 3, 3))
    # By change, one of CHANGES, and step.
    before, after = squared[:-1] + _BEFORE * by[:-1], squared[1:] + _AFTER * by[1:]
    slowest = (SLOWEST * top) ** 2
    broken = (before < slowest[:-1]) & (_BEFORE < 0) | (after < slowest[1:]) & (_AFTER < 0)
    faster, along = np.maximum(before, after), (after - before) / (2.0 * surface)
    broken |= faster > conditions.limits[0] ** 2
    before, after, faster = (np.sqrt(np.maximum(one, 0.0)) for one in (before, after, faster))
    acceleration = np.hypot(along, faster**2 * driven.curvatures)
    broken |= acceleration > limits.acceleration * (1.0 + ROUNDING)
    broken |= faster * np.abs(driven.turns) > limits.yaw_rate * surface * (1.0 + ROUNDING)
    # What is driven already keeps them, but for rounding.
    broken &= (driven.surface > 0.0) & ((_BEFORE != 0) | (_AFTER != 0))
    price[:, _BEFORE[:, 0] + 1, _AFTER[:, 0] + 1] = BROKEN * broken.T
    _add(conditions.model.limits_kernel, conditions.arrays, driven, before, after, stale, price)
    return price


@njit(types.void(BLOCK_KERNEL, MODEL_ARRAYS, _DRIVEN, F2, F2, B1, F3), **EAGER)
def _add(
    kernel: Any, arrays: Any, driven: Any, before: Any, after: Any, stale: Any, price: Any
) -> None:
    """Add what the rows of stale steps cost between speeds (changes, steps) to their prices."""
    rows, step, at, share, most, surface, curvatures, _ = driven
    columns, found = empty_block()
    chosen, seconds = np.empty(BLOCK, np.int64), np.empty(BLOCK)
    n = 0
    while n < len(step):
        size = 0
        while n < len(step) and size < BLOCK:
            if stale[step[n]]:
                put_row(columns, size, rows[n])
                chosen[size] = n
                size += 1
            n += 1
        for number in range(len(CHANGES)):
            for i in range(size):
                k, j = chosen[i], step[chosen[i]]
                begun, ended = before[number, j], after[number, j]
                speed = begun + (ended - begun) * at[k]
                along = (ended * ended - begun * begun) / (2.0 * surface[j])
                across = speed * speed * curvatures[j]
                put(columns, i, _AX, along * rows[k, _VX] - across * rows[k, _VY])
                put(columns, i, _AY, along * rows[k, _VY] + across * rows[k, _VX])
                for quantity in _PACED:
                    put(columns, i, quantity, rows[k, quantity] * speed)
                seconds[i] = share[k] * 2.0 * surface[j] / max(begun + ended, LEAST)
            kernel(columns, size, arrays.parameters, arrays.body, arrays.wheels, found)
            for i in range(size):
                k, (a, b) = chosen[i], CHANGES[number]
                broken = False
                for limit in range(len(_SIGNS)):
                    broken |= _SIGNS[limit] * found[(1 + limit) * BLOCK + i] > most[k, limit]
                broken &= a != 0 or b != 0
                price[step[k], a + 1, b + 1] += found[i] * seconds[i] + BROKEN * broken


def _at_speeds(motion: Motion, surface: Array, speed: Array) -> Motion:
    """A motion at other speeds (samples,); turns on the spot take as long as they did."""
    seconds = np.diff(motion.time)
    moving = surface > 0.0
    seconds[moving] = 2.0 * surface[moving] / (speed[1:] + speed[:-1])[moving]
    return replace(motion, speed=speed, time=motion.time[0] + np.append(0.0, np.cumsum(seconds)))
