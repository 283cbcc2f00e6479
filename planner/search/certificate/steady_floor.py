"""The least that a metre of steady driving dissipates, by slope: a table below the model.

    floor = steady_floor(conditions)
    floor.least[c, i, j]       # J per horizontal metre at slopes along and across the travel

For ground class c it is a lower bound of D = P·√(1 + m²)/v - M·g·m (planner.search.steady) over all
yaws and speeds within the limits, bilinear between the nodes. The planner's own tables are
interpolated, so they lie on either side of the model. Four reserves keep this one below:

    slopes   at one yaw and speed, D is convex in the slope: motors, gears and copper are. A chord
             is above a convex function by at most half of the larger second difference at its ends.
             That much is taken off, for both axes.
    limits   a yaw and speed counts where it keeps the limits at a node next to it, or more slowly.
             Of torque, only the peak is a limit: no average over time.
    yaws     evenly, and closely round the angles at which a rim or roller stands and its smooth
             sign lets friction hold the robot. ``YAW_RESERVE`` is for what lies between.
    speeds   evenly; ``YAW_RESERVE`` again, for D is flat where a speed below the largest is best.

tests/search/certificate compares with the model at random slopes, yaws and speeds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from planner.arrays import Array
from planner.cache import CACHE
from planner.compiled_code import njit
from planner.power.kernel_math import REST_SPEED
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.kinematics import RIM, ROLLER
from planner.power.limits import broken_in_block
from planner.power.model import PowerModel
from planner.power.motion_row import empty_block, put, put_row, set_motion
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.conditions import OperatingConditions
from planner.search.kernel_arguments import EAGER, F1, F2, F3
from planner.search.second_core import CORE
from planner.search.steady import kept_table

COARSE, FINER = 41, 4
"""Nodes along each axis at which all yaws are tried, and parts of a step between them."""
SLOPES = (COARSE - 1) * FINER + 1
"""Nodes of the table along each axis."""
SPEEDS = 8
"""Speeds up to the largest."""
EVEN_YAWS = 72
"""Yaws to the travel, evenly."""
STANDING = (0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 3.0, 4.5, 7.0, 10.0, 14.0)
"""Yaws off those at which a rim or roller stands, to both sides: its speed there in widths of the
smooth sign."""
YAW_RESERVE = 0.006
"""Share taken off for yaws and speeds between those of the table."""
STEEPEST_SPEED = 0.05
"""Share of full speed at which the steepest slope is looked for."""

_VX, _VY = INDEX["vx"], INDEX["vy"]
_B3, _B4 = (types.Array(types.boolean, n, "C") for n in (3, 4))


@dataclass(frozen=True)
class SteadyFloor:
    """Lower bounds by slope, see the module's head.

    Attributes:
        least: (classes, SLOPES, SLOPES) J per horizontal metre, by slope along and across.
        by_speed: (classes, SPEEDS, SLOPES, SLOPES) the same for each speed; infinite where none
            of its yaws keeps the limits.
        steepest: largest slope of the table: nothing steeper can be driven.
    """

    least: Array
    by_speed: Array
    steepest: float

    @property
    def nbytes(self) -> int:
        """Memory that the cache counts."""
        return self.least.nbytes + self.by_speed.nbytes

    @property
    def step(self) -> float:
        """Slope between two nodes."""
        return 2.0 * self.steepest / (SLOPES - 1)


def steady_floor(conditions: OperatingConditions) -> SteadyFloor | None:
    """The table of a model under its conditions; None where nothing can be driven."""
    return CACHE.get(("steady floor", conditions.key), lambda: _kept(conditions))


def _kept(conditions: OperatingConditions) -> SteadyFloor | None:
    steepest = _steepest(conditions)
    if steepest <= 0.0:
        return None
    key = __name__, *conditions.content
    return kept_table(key, SteadyFloor, lambda: _steady_floor(conditions, steepest))


def _steady_floor(conditions: OperatingConditions, steepest: float) -> SteadyFloor:
    yaws = tried_yaws(conditions.model, float(conditions.limits[0]))
    slopes = np.linspace(-steepest, steepest, COARSE)
    along, across = (axis.ravel() for axis in np.meshgrid(slopes, slopes, indexing="ij"))
    shares = np.arange(1, SPEEDS + 1) / SPEEDS
    classes = len(conditions.class_rows)
    least = np.full((classes, SLOPES, SLOPES), np.inf)
    by_speed = np.empty((classes, SPEEDS, COARSE, COARSE))
    for c in range(classes):
        grid = (len(yaws), SPEEDS, COARSE, COARSE)
        driven = _driven(conditions, c, along, across, yaws, shares)
        costs, kept = driven[0].reshape(grid), driven[1].reshape(grid)
        low = np.where(_near(kept), costs - _bend(costs), np.inf)
        by_speed[c] = low.min(axis=0)
        # Only what may be the best is looked at closely.
        asked = low <= np.where(kept, costs, np.inf).min(axis=(0, 1))
        _refine(conditions, c, steepest, yaws, asked & np.isfinite(low), least[c])
    least *= 1.0 - YAW_RESERVE
    by_speed *= 1.0 - YAW_RESERVE
    # Beyond what can be driven nothing counts, but cells that reach there are interpolated.
    least[~np.isfinite(least)] = least[np.isfinite(least)].max()
    return SteadyFloor(least, by_speed, steepest)


def _near(kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where the limits may be kept (yaws, speeds, slopes, slopes) near what was looked at."""
    near = maximum_filter(kept, size=(1, 1, 3, 3))
    near |= np.roll(near, 1, axis=0) | np.roll(near, -1, axis=0)
    # A speed between two counts as the faster one.
    near[:, 1:] |= near[:, :-1].copy()
    return near


def _bend(costs: Array) -> Array:
    """How far a convex function may be below its chords in the four cells round each node."""
    bend = np.zeros_like(costs)
    for axis in (2, 3):
        inner = [slice(None)] * 4
        inner[axis] = slice(1, -1)
        bend[tuple(inner)] += 0.5 * np.maximum(np.diff(costs, 2, axis=axis), 0.0)
    return np.asarray(maximum_filter(bend, size=(1, 1, 3, 3)))


def _refine(
    conditions: OperatingConditions,
    ground: int,
    steepest: float,
    yaws: Array,
    asked: NDArray[np.bool_],
    least: Array,
) -> None:
    """Lower ``least`` (SLOPES, SLOPES) to what the yaws asked for take, on both cores."""
    model = conditions.model
    numbers = model.parameters, model.body, model.wheels, conditions.class_rows[ground]
    parts = [least, least.copy()]

    def fill(first: int) -> None:
        there = yaws[first::2].copy(), np.ascontiguousarray(asked[first::2])
        _fill_closely(
            model.limits_kernel, *numbers, conditions.limits, steepest, *there, parts[first]
        )

    CORE.all([partial(fill, 0), partial(fill, 1)])
    np.minimum(parts[0], parts[1], out=least)


def _steepest(conditions: OperatingConditions) -> float:
    """Tan of the steepest slope that can be driven in any direction with any yaw."""
    azimuth = 2.0 * math.pi * np.arange(72) / 72
    yaws = 2.0 * math.pi * np.arange(64) / 64
    low, high = 0.0, float(conditions.limits[5])
    for _ in range(10):
        middle = 0.5 * (low + high)
        along, across = middle * np.cos(azimuth), middle * np.sin(azimuth)
        good = any(
            _driven(conditions, c, along, across, yaws, np.array([STEEPEST_SPEED]))[1].any()
            for c in range(len(conditions.class_rows))
        )
        low, high = (middle, high) if good else (low, middle)
    # The first slope that was refused everywhere.
    return high if low > 0.0 else 0.0


def tried_yaws(model: PowerModel, top: float) -> Array:
    """Yaws to the travel, rad; close round those at which a rim or roller stands."""
    found = [2.0 * math.pi * np.arange(EVEN_YAWS) / EVEN_YAWS]
    rest = REST_SPEED * model.vehicle.layout.radius / model.vehicle.gear_ratio
    for column, width in ((RIM, rest), (ROLLER, model.sliding_speed)):
        for along_x, along_y in model.wheels[:, column : column + 2]:
            reach = math.hypot(along_x, along_y) * top
            offsets = np.array(STANDING) * width / reach if reach > 0.0 else np.zeros(0)
            for still in math.atan2(along_x, along_y) + math.pi * np.arange(2):
                found.append(still + np.concatenate([-offsets, [0.0], offsets]))
    angles = np.sort(np.remainder(np.concatenate(found), 2.0 * math.pi))
    return np.asarray(angles[np.append(True, np.diff(angles) > 1e-9)])


@njit(types.void(BLOCK_KERNEL, F1, F1, F2, F1, F1, F1, F1, F1, F1, F3, _B3), **EAGER)
def _fill(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    class_row: Any,
    limits: Any,
    along: Any,
    across: Any,
    yaws: Any,
    speeds: Any,
    costs: Any,
    kept: Any,
) -> None:
    """J per horizontal metre (yaws, speeds, slopes), and whether all limits are kept."""
    columns, found = empty_block()
    places = np.empty((BLOCK, 3), np.int64)
    stretches = np.empty(BLOCK)
    row, size = class_row.copy(), 0
    last = yaws.shape[0] * along.shape[0] * speeds.shape[0] - 1
    for t in range(yaws.shape[0]):
        for n in range(along.shape[0]):
            stretch = set_motion(row, along[n], across[n], yaws[t], 0.0, 1.0)
            vx, vy = row[_VX], row[_VY]
            for v in range(speeds.shape[0]):
                put_row(columns, size, row)
                put(columns, size, _VX, vx * speeds[v])
                put(columns, size, _VY, vy * speeds[v])
                places[size, 0], places[size, 1], places[size, 2] = t, v, n
                stretches[size] = stretch
                size += 1
                if size < BLOCK and (t * along.shape[0] + n) * speeds.shape[0] + v < last:
                    continue
                kernel(columns, size, parameters, body, wheels, found)
                for k in range(size):
                    a, b, c = places[k]
                    climb = limits[4] * STANDARD_GRAVITY * along[c]
                    costs[a, b, c] = found[k] * stretches[k] / speeds[b] - climb
                    kept[a, b, c] = broken_in_block(found, k, limits) < 0
                size = 0


def _driven(
    conditions: OperatingConditions,
    ground: int,
    along: Array,
    across: Array,
    yaws: Array,
    shares: Array,
) -> tuple[Array, NDArray[np.bool_]]:
    """What ``_fill`` finds on slopes (n,) for shares of full speed, on both cores."""
    model = conditions.model
    costs = np.empty((len(yaws), len(shares), len(along)))
    kept = np.empty(costs.shape, bool)
    numbers = model.parameters, model.body, model.wheels, conditions.class_rows[ground]
    speeds = shares * float(conditions.limits[0])

    def fill(part: slice) -> None:
        there = along, across, np.ascontiguousarray(yaws[part]), speeds
        _fill(model.limits_kernel, *numbers, conditions.limits, *there, costs[part], kept[part])

    half = len(yaws) // 2
    CORE.all([partial(fill, slice(0, half)), partial(fill, slice(half, len(yaws)))])
    return costs, kept


@njit(types.void(BLOCK_KERNEL, F1, F1, F2, F1, F1, types.float64, F1, _B4, F2), **EAGER)
def _fill_closely(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    class_row: Any,
    limits: Any,
    steepest: float,
    yaws: Any,
    asked: Any,
    least: Any,
) -> None:
    """Lower bounds of what yaws take round the nodes asked for, into ``least`` (slopes, slopes).

    See ``_refine``.
    """
    columns, found = empty_block()
    row, count = class_row.copy(), least.shape[0]
    costs, bend = np.empty((count, count)), np.empty((count, count))
    wanted, inside = np.empty((count, count), np.bool_), np.empty((count, count), np.bool_)
    at = np.empty((count * count, 2), np.int64)
    stretches = np.empty(BLOCK)
    step, beyond = 2.0 * steepest / (count - 1), FINER + 2
    for t in range(yaws.shape[0]):
        for v in range(asked.shape[1]):
            if not asked[t, v].any():
                continue
            speed = limits[0] * (v + 1) / asked.shape[1]
            wanted[:], inside[:] = False, False
            for a in range(asked.shape[2]):
                for b in range(asked.shape[3]):
                    if asked[t, v, a, b]:
                        i, j = a * FINER, b * FINER
                        wanted[
                            max(i - beyond, 0) : i + beyond + 1, max(j - beyond, 0) : j + beyond + 1
                        ] = True
                        inside[
                            max(i - FINER, 0) : i + FINER + 1, max(j - FINER, 0) : j + FINER + 1
                        ] = True
            total = 0
            for i in range(count):
                for j in range(count):
                    bend[i, j], costs[i, j] = 0.0, np.inf
                    if wanted[i, j]:
                        at[total, 0], at[total, 1] = i, j
                        total += 1
            for first in range(0, total, BLOCK):
                size = min(BLOCK, total - first)
                for k in range(size):
                    i, j = at[first + k]
                    slopes = i * step - steepest, j * step - steepest
                    stretches[k] = set_motion(row, slopes[0], slopes[1], yaws[t], 0.0, speed)
                    put_row(columns, k, row)
                kernel(columns, size, parameters, body, wheels, found)
                for k in range(size):
                    i, j = at[first + k]
                    climb = limits[4] * STANDARD_GRAVITY * (i * step - steepest)
                    costs[i, j] = found[k] * stretches[k] / speed - climb
            for k in range(total):
                i, j = at[k]
                if 0 < i < count - 1:
                    second = costs[i - 1, j] - 2.0 * costs[i, j] + costs[i + 1, j]
                    bend[i, j] += 0.5 * max(0.0, second) if second < np.inf else 0.0
                if 0 < j < count - 1:
                    second = costs[i, j - 1] - 2.0 * costs[i, j] + costs[i, j + 1]
                    bend[i, j] += 0.5 * max(0.0, second) if second < np.inf else 0.0
            for k in range(total):
                i, j = at[k]
                if not inside[i, j]:
                    continue
                most = 0.0
                for a in range(max(i - 1, 0), min(i + 2, count)):
                    for b in range(max(j - 1, 0), min(j + 2, count)):
                        most = max(most, bend[a, b])
                least[i, j] = min(least[i, j], costs[i, j] - most)
