"""Speeds of steady drives, taken at their means.

    log = at_steady_speeds(log)     # the same rows; where steady, vx, vy and wz at their means

What the speed does by millimetres a second while a robot keeps its speed is the error of odometry,
or the answer of the speed controller to a bump: the robot slows down a little *because* it needs
more power. A fit that takes these wiggles for causes finds friction that falls with speed, as
stiction does, where there is none; and of a wheel or roller that nearly stands they decide the side
on which friction acts. So the speeds of a stretch of consecutive rows are replaced by their means
where

    range   each of them stays within what odometry usually errs by (SPEED_ERROR)
    drift   the means of the stretch's halves differ by no more than the scatter from row to row
            (von Neumann's mean square successive difference) makes them

Stretches that drift are halved until they hold or are shorter than SHORTEST rows; those keep their
speeds. Accelerations that were derived from the speeds are those of a steady drive in the inside of
a stretch; measured ones stay.

Source
    own; the estimate of a scatter that drift does not enlarge: von Neumann, "Distribution of the
    ratio of the mean square successive difference to the variance", Annals of Mathematical
    Statistics 12(4), 1941.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.quantities import INDEX
from planner.telemetry.log import Telemetry
from planner.telemetry.noise import segments
from planner.telemetry.sensitivity import SPEED_ERROR

SHORTEST = 4
"""Rows; fewer say nothing about drift."""
DRIFT_Z = 2.5
"""Standard errors by which the means of the halves of a stretch may differ."""
_SPEEDS = [INDEX[name] for name in ("vx", "vy", "wz")]


def at_steady_speeds(log: Telemetry) -> Telemetry:
    """The log with the speeds of steady stretches at their means.

    Args:
        log: the rows; their runs and times say which of them follow each other.

    Returns:
        A log with the same rows, of which only velocities and derived accelerations differ.
    """
    rows = log.rows.copy()
    speeds = np.ascontiguousarray(rows[:, _SPEEDS])
    ends = np.array([stop for _, stop in segments(log)], np.int64)
    inside = np.zeros(len(log), np.bool_)
    if len(log):
        _average(speeds, ends, np.array(SPEED_ERROR), inside)
    rows[:, _SPEEDS] = speeds
    vx, vy, wz = speeds[inside].T
    steady = {"ax": -wz * vy, "ay": wz * vx, "yaw_acceleration": 0.0}
    for name, value in steady.items():
        if name not in log.present:
            rows[inside, INDEX[name]] = value
    return replace(log, rows=rows)


def stretches(log: Telemetry) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which rows share their speeds: what odometry errs by is averaged over these.

    Returns:
        (n,) number of the stretch of every row, and (n,) how many rows it has; 1 outside of steady
        drives.
    """
    speeds = log.rows[:, _SPEEDS]
    begins = np.ones(len(log), np.bool_)
    begins[1:] = np.any(speeds[1:] != speeds[:-1], axis=1) | (log.run[1:] != log.run[:-1])
    number = np.cumsum(begins) - 1
    return number, np.bincount(number)[number]


@njit(cache=True, nogil=True)
def _average(speeds: Any, ends: Any, most: Any, inside: Any) -> None:
    """Average speeds (n, 3) over steady stretches, in place, and mark the rows inside of them.

    ``ends`` are those of the segments; ``most`` is how far a speed may range. A row beside another
    motion is not inside: it may have begun to change its own.
    """
    first = 0
    for last in ends:
        start = first
        while start < last:
            stop = _end_of_range(speeds, start, last, most)
            # Halves wait here; each is half as long as the one before it.
            waiting = [(start, stop)]
            while len(waiting) > 0:
                begin, end = waiting.pop()
                if end - begin < SHORTEST:
                    continue
                if _drifts(speeds[begin:end]):
                    middle = begin + (end - begin) // 2
                    waiting.append((middle, end))
                    waiting.append((begin, middle))
                    continue
                for j in range(speeds.shape[1]):
                    speeds[begin:end, j] = np.mean(speeds[begin:end, j])
                inside[begin if begin == first else begin + 1 : end if end == last else end - 1] = (
                    True
                )
            start = stop
        first = last


@njit(cache=True, nogil=True)
def _end_of_range(speeds: Any, start: int, last: int, most: Any) -> int:
    """End of the longest stretch from ``start`` on in which no speed ranges further than that."""
    low, high = speeds[start].copy(), speeds[start].copy()
    for k in range(start + 1, last):
        for j in range(speeds.shape[1]):
            low[j], high[j] = min(low[j], speeds[k, j]), max(high[j], speeds[k, j])
            if high[j] - low[j] > most[j]:
                return k
    return last


@njit(cache=True, nogil=True)
def _drifts(part: Any) -> bool:
    """Whether the halves of a stretch (n, 3) differ by more than its scatter from row to row."""
    count = part.shape[0]
    half = count // 2
    for j in range(part.shape[1]):
        apart = abs(np.mean(part[:half, j]) - np.mean(part[count - half :, j]))
        scatter = np.sqrt(0.5 * np.mean((part[1:, j] - part[:-1, j]) ** 2))
        if apart > DRIFT_Z * scatter * np.sqrt(2.0 / half):
            return True
    return False
