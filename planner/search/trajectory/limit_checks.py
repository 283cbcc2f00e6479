"""Checks of a finished motion against all limits, and lower caps where it breaks one.

    broken = broken_limits(field, conditions, motion)        # samples, fifteen a cell
    ease(broken, motion, track, fastest, hardest)        # caps for another speed profile

The yaw and speed profiles look at few points of every step. Ground between them may be steeper, and
at the faster end of a ramp a motor needs more voltage.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.limits import BRIEFLY, LIMIT_NAMES, broken_in_results
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.trajectory.motion import Motion, motion_rows
from planner.search.trajectory.track import Track

FINENESS, FINEST = 0.2, 0.05
"""Cells that three samples stand for: while motions are repaired, and for the answer."""
SPEED_FACTOR, ACCELERATION_FACTOR = 0.94, 0.75
"""Factors on the speed, and on the acceleration, where a limit was broken: with twelve repairs they
reach half the speed and a thirtieth of the acceleration."""
STEADY_SHARE = 0.02
"""Share of the largest acceleration below which the speed is eased instead."""


@dataclass(frozen=True)
class Broken:
    """Samples of a motion at which a limit is broken.

    Attributes:
        steps: (n,) of the motion.
        limits: (n,) numbers into LIMIT_NAMES.
    """

    steps: NDArray[np.int64]
    limits: NDArray[np.int64]

    def __bool__(self) -> bool:
        return len(self.steps) > 0

    @property
    def what(self) -> str:
        """The first broken limit in words."""
        return f"the limit of {LIMIT_NAMES[self.limits[0]]} is broken"


def broken_limits(
    field: CostField, conditions: OperatingConditions, motion: Motion, *, finely: bool = False
) -> Broken:
    """Where a motion breaks a limit; turns on the spot were checked when they were chosen.

    Args:
        field, conditions, motion: map, model and the motion.
        finely: as closely as the answer is checked.
    """
    fineness = FINEST if finely else FINENESS
    rows, _, owner = motion_rows(
        field, motion, conditions.class_rows, conditions.wind, fineness=fineness
    )
    found = conditions.model.power_and_limits(rows)
    changing = np.abs(np.diff(motion.speed)) > 1e-9
    brief = changing | (motion.curvatures != 0.0) | (np.abs(np.diff(motion.yaw)) > 1e-9)
    numbers = _numbers(found, conditions.limits, brief[owner])
    moving = np.hypot(np.diff(motion.x), np.diff(motion.y)) > 1e-9
    at = np.flatnonzero((numbers >= 0) & moving[owner])
    return Broken(owner[at], numbers[at])


@njit(cache=True, error_model="numpy", nogil=True)
def _numbers(found: Any, limits: Any, brief: Any) -> Any:
    numbers = np.empty(found.shape[0], np.int64)
    for k in range(found.shape[0]):
        numbers[k] = broken_in_results(found[k], limits, BRIEFLY if brief[k] else 1.0)
    return numbers


def ease(
    broken: Broken,
    motion: Motion,
    track: Track,
    fastest: Array,
    hardest: Array,
    eased: NDArray[np.int64],
) -> None:
    """Lower the speed where the voltage does not suffice, else the acceleration.

    Args:
        broken: of ``motion``.
        motion: along ``track``, perhaps with samples of its own.
        track: samples of the path.
        fastest, hardest: (steps of the track,) m/s and m/s², lowered in place.
        eased: (steps of the track,) repairs for other limits than the voltage, counted in place.
    """
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(motion.x), np.diff(motion.y)))])
    ends = np.cumsum(track.lengths)
    most = float(hardest.max())
    speed = np.maximum(motion.speed[1:], motion.speed[:-1])
    change = np.abs(np.diff(motion.speed)) / np.diff(motion.time)
    for step, limit in set(zip(broken.steps.tolist(), broken.limits.tolist(), strict=True)):
        place = int(np.searchsorted(ends, 0.5 * (along[step] + along[step + 1])))
        near = slice(max(0, place - 1), place + 2)
        eased[place] += LIMIT_NAMES[limit] != "voltage"
        if LIMIT_NAMES[limit] == "voltage" or change[step] < STEADY_SHARE * most:
            fastest[near] = np.minimum(fastest[near], SPEED_FACTOR * speed[step])
        else:
            hardest[near] = np.minimum(hardest[near], ACCELERATION_FACTOR * change[step])
