"""Estimated costs of changes of speed, by even driving, before the power model prices them.

estimate(kernel, arrays, stretch, fastest, hardest, expected)    # every change of level
forbid(stretch, top, fastest, hardest, expected)                 # those beyond lower limits
stretches_of(conditions, track, slopes, stops, turns)            # that get a grid each
levels(top, count)                                               # m/s, the speeds on the grid
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
from planner.power.motion_row import (
    empty_block,
    fill_row,
    put_row,
    set_acceleration,
    set_motion,
    set_wind,
    stretch_of,
)
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.kernel_arguments import (
    B1,
    EAGER,
    F1,
    F2,
    F3,
    MODEL_ARRAYS,
    STEPS,
    Steps,
    tuple_type,
)
from planner.search.resolution import CREEP, EVENLY, LEVELS, MORE_LEVELS
from planner.search.trajectory.track import Track

REACH = 0.45
"""Largest change of level on one step that is looked at, as a share of the even levels."""
ESTIMATED_LEVELS = 4
"""Even driving is priced at every so many levels for the estimates, and interpolated in between.
Exact prices replace estimates, so that this decides the time alone."""

_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]


@njit(cache=True)
def levels(top: float, count: int) -> Any:
    """Speeds (count,) in m/s: standstill, some to creep, and an even grid of the squared speed."""
    level = np.empty(count)
    for q in range(count):
        even = (q - len(CREEP) + 1) / (count - len(CREEP))
        level[q] = top * (CREEP[q] if q < len(CREEP) else math.sqrt(even))
    return level


def level_count(conditions: OperatingConditions, track: Track) -> int:
    """How many levels of speed a track gets."""
    limits = conditions.model.vehicle.limits
    to_full_speed = float(conditions.limits[0]) ** 2 / (2.0 * limits.acceleration)
    return MORE_LEVELS if float(np.median(track.lengths)) < to_full_speed else LEVELS


def reach_of(top: float, count: int, longest: float, acceleration: float) -> int:
    """Largest change of level on one step that is looked at: REACH, or all that is possible.

    Args:
        top: m/s, the largest level.
        count: levels.
        longest: m along the ground of the longest step.
        acceleration: m/s² at most.
    """
    even = count - len(CREEP)
    possible = math.floor(even * 2.0 * longest * acceleration / top**2 * (1.0 + 1e-5))
    # From standstill there are the levels to creep as well.
    return min(round(REACH * even), possible + len(CREEP) - 1)


class Stretch(NamedTuple):
    """A track with its yaw, for the search of the best speeds.

    Attributes:
        steps: between its samples.
        yaw: (n,) rad in the middle of every step.
        turns: (n,) rad by which the body turns on it.
        stops: (n + 1,) samples at which the robot stands.
        acceleration: m/s² at most.
    """

    steps: Steps
    yaw: Array
    turns: Array
    stops: NDArray[np.bool_]
    acceleration: float

    def some(self, chosen: NDArray[np.int64]) -> Stretch:
        """Some of the steps, one after the other."""
        return self._replace(
            steps=self.steps.some(chosen),
            yaw=self.yaw[chosen],
            turns=self.turns[chosen],
            stops=np.append(False, self.stops[chosen + 1]),
        )


STRETCH = tuple_type(Stretch, STEPS, F1, F1, B1, types.float64)


def stretches_of(
    conditions: OperatingConditions,
    track: Track,
    slopes: Array,
    stops: NDArray[np.bool_],
    turns: Array,
) -> list[tuple[int, int, float]]:
    """Stretches of a track to find speeds for: first and last sample, and the largest speed, m/s.

    Usually one. Between two stops too close for the even grid of speeds, the robot cannot become
    fast. Such a stretch gets a grid of its own, up to the speed that it allows.
    """
    top, acceleration = float(conditions.limits[0]), conditions.model.vehicle.limits.acceleration
    surface = surface_lengths(track, slopes)
    ends = np.flatnonzero(stops)
    travelled = np.concatenate([[0.0], np.cumsum(surface)])
    # Half of the way to speed up, half of it to slow down.
    reached = np.sqrt(acceleration * np.diff(travelled[ends]))
    found: list[tuple[int, int, float]] = []
    begun = 0
    for k in np.flatnonzero(reached < EVENLY * top):
        first, last = int(ends[k]), int(ends[k + 1])
        if begun < first:
            found.append((begun, first, top))
        turning = np.abs(turns[first:last]) / surface[first:last]
        rate = float(conditions.limits[6]) / max(float(turning.max()), 1e-12)
        found.append((first, last, min(float(reached[k]), rate)))
        begun = last
    if begun < len(surface):
        found.append((begun, len(surface), top))
    return found


def surface_lengths(track: Track, slopes: Array) -> Array:
    """(n,) m along the ground of every step of a track; ``slopes`` of its Steps."""
    along = slopes[:, 0] * np.cos(track.directions) + slopes[:, 1] * np.sin(track.directions)
    return np.asarray(track.lengths * np.sqrt(1.0 + along * along))


@njit(types.void(BLOCK_KERNEL, MODEL_ARRAYS, STRETCH, F1, F2, F3), **EAGER)
def estimate(
    kernel: Any, arrays: Any, stretch: Any, fastest: Any, hardest: Any, expected: Any
) -> None:
    """Cost of every change of level by even driving, (steps, levels, 2·reach + 1).

    A step costs the mean of even driving between its two speeds, and the cost of speeding up or
    slowing down at half speed. Infinite where it is impossible.

    Args:
        kernel, arrays: of the power model.
        stretch: Stretch.
        fastest, hardest: (steps,) m/s and (steps, 2) m/s², speeding up and slowing down, at most.
        expected: written; its shape gives the grid.
    """
    parameters, body, wheels, class_rows, limits, wind = arrays
    directions, lengths, curvatures, slopes, _, ground = stretch.steps
    yaw, turns, stops = stretch.yaw, stretch.turns, stretch.stops
    most_acceleration = stretch.acceleration
    columns, found = empty_block()
    count, reach = expected.shape[1], expected.shape[2] // 2
    level = levels(limits[0], count)
    evenly = np.arange(count)
    at = evenly[(evenly < len(CREEP)) | ((count - 1 - evenly) % ESTIMATED_LEVELS == 0)]
    row = np.empty(class_rows.shape[1])
    even = np.empty(count)  # W
    below = np.zeros(count)  # W·m/s, its integral over the speed up to a level
    pull, half = 0.5 * most_acceleration, 0.5 * limits[0]
    expected[:] = np.inf
    priced = len(at) + 5
    together = BLOCK // priced  # steps in a block
    for j in range(lengths.shape[0]):
        longer = stretch_of(slopes[j, 0], slopes[j, 1], directions[j])
        surface = lengths[j] * longer
        most = min(
            fastest[j],
            limits[6] * surface / max(abs(turns[j]), 1e-12),
            math.sqrt(most_acceleration / max(abs(curvatures[j]), 1e-12)),
        ) * (1.0 + 1e-6)
        if j % together == 0:
            size = 0
            for k in range(j, min(j + together, lengths.shape[0])):
                fill_row(row, class_rows[ground[k]])
                further = set_motion(row, slopes[k, 0], slopes[k, 1], yaw[k], directions[k], 1.0)
                vx, vy = row[_VX], row[_VY]
                set_wind(row, wind, yaw[k])
                for q in at:
                    speed = max(level[q], 0.5 * level[1])
                    row[_VX], row[_VY] = vx * speed, vy * speed
                    row[_WZ] = turns[k] * speed / (lengths[k] * further)
                    set_acceleration(row, 0.0, speed * speed * curvatures[k], vx, vy, 1.0)
                    put_row(columns, size, row)
                    size += 1
                row[_VX], row[_VY] = vx * half, vy * half
                row[_WZ] = 0.0
                for step in range(-2, 3):
                    set_acceleration(row, step * pull, 0.0, vx, vy, 1.0)
                    put_row(columns, size, row)
                    size += 1
            kernel(columns, size, parameters, body, wheels, found)
        first = j % together * priced
        before = -1
        for number in range(len(at)):
            q = at[number]
            even[q] = found[first + number]
            for r in range(before + 1, q):
                share = (level[r] - level[before]) / (level[q] - level[before])
                even[r] = even[before] + share * (even[q] - even[before])
            before = q
        for q in range(1, count):
            below[q] = below[q - 1] + 0.5 * (even[q - 1] + even[q]) * (level[q] - level[q - 1])
        # W at accelerations from braking hard to speeding up hard.
        drawn = found[first + len(at) : first + priced]
        faster, slower = (2.0 * surface * (1.0 + 1e-6)) * hardest[j]
        for a in range(count):
            if level[a] > most:
                break
            for b in range(max(0, a - reach), min(count, a + reach + 1)):
                change = level[b] * level[b] - level[a] * level[a]
                if a + b == 0 or (stops[j + 1] and b > 0) or not -slower <= change <= faster:
                    continue
                if level[b] > most:
                    break
                cost = time = 2.0 * surface / (level[a] + level[b])
                cost = time * even[a]
                if change != 0.0:
                    cost = time * (below[b] - below[a]) / (level[b] - level[a])
                    # Work goes with the speed, heat with the square of the acceleration.
                    side = 1 if change > 0.0 else -1
                    once = drawn[2 + side] - drawn[2]
                    bent = 0.5 * (drawn[2 + 2 * side] - drawn[2] - 2.0 * once)
                    cost += 0.5 * abs(change) * (once - bent) / (pull * half)
                    cost += bent * (change / (2.0 * surface * pull)) ** 2 * time
                expected[j, a, b - a + reach] = cost


@njit(types.void(STRETCH, types.float64, F1, F2, F3), **EAGER)
def forbid(stretch: Any, top: float, fastest: Any, hardest: Any, expected: Any) -> None:
    """Make changes of speed infinitely expensive that lower limits no longer allow.

    Args:
        stretch: Stretch.
        top: m/s, the largest level.
        fastest, hardest: (steps,) m/s and (steps, 2) m/s², speeding up and slowing down, at most.
        expected: as of ``estimate``, brought up to date.
    """
    directions, lengths, _, slopes, _, _ = stretch.steps
    count, reach = expected.shape[1], expected.shape[2] // 2
    level = levels(top, count)
    for j in range(lengths.shape[0]):
        if fastest[j] >= top and hardest[j].min() >= stretch.acceleration:
            continue  # as it was estimated
        surface = lengths[j] * stretch_of(slopes[j, 0], slopes[j, 1], directions[j])
        most = fastest[j] * (1.0 + 1e-6)
        faster, slower = (2.0 * surface * (1.0 + 1e-6)) * hardest[j]
        for a in range(count):
            for b in range(max(0, a - reach), min(count, a + reach + 1)):
                change = level[b] * level[b] - level[a] * level[a]
                if max(level[a], level[b]) > most or not -slower <= change <= faster:
                    expected[j, a, b - a + reach] = np.inf
