"""Steady-state segments: speeds are taken at their means.

    log = at_steady_speeds(log)     # the same rows; vx, vy and wz each at its mean where steady
    log = at_steady_speeds(log, 10)                  # where it is so for ten rows or more
    log = at_steady_speeds(log, 16, apart=4)         # noise lasts for up to four rows

While a robot keeps its speed, changes by millimetres a second are errors of odometry, or the speed
controller's answer to a bump: the robot slows down a little *because* it needs more power. A fit
that takes these changes for causes finds friction that falls with speed where there is none. For a
wheel or roller that nearly stands they decide the side on which friction acts. Rollers nearly stand
in all forward travel, also while it speeds up, so vx, vy and wz are treated one by one. In a
stretch of consecutive rows a speed is replaced by its mean where

    range   it ranges over no more than what odometry usually errs by (Telemetry.SPEED_ERROR), or
            stays within as much of zero
    drift   the means of the stretch's halves differ by no more than the scatter from row to row
            (von Neumann's mean square successive difference) makes them
    scatter it is scatter: rows differ from the next one as much as from the mean, or nearly so.
            Of a motion that swings or that a simulator logs without noise they do not

A mean that does not differ significantly from zero is zero: even its error would give a roller that
hardly turns friction one way and the other, and so next to none. Stretches that drift are halved
until they hold or have fewer than LEAST_SEGMENT_ROWS rows; those keep their speeds. Inside a
stretch the acceleration is that of a constant speed, also where it was measured: an accelerometer's
noise is larger than the change that odometry leaves possible, and would send the rollers of a
straight drive to and fro within every row.

Fused odometry filters its noise, so next rows differ less than the noise is, as they do in a swing.
Rows that are some time apart show it as it is: with ``apart``, only so many rows on is noise a new
one, and both tests go by that.
Source
    own; the estimate of a scatter that drift does not enlarge: von Neumann, "Distribution of the
    ratio of the mean square successive difference to the variance", Annals of Mathematical
    Statistics 12(4), 1941.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from planner.arrays import Integers, Mask
from planner.compiled_code import njit
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry

LEAST_SEGMENT_ROWS = 4
"""Rows of a segment, at least; fewer say nothing about drift."""
DRIFT_Z = 2.5
"""Standard errors by which the means of the halves of a stretch may differ."""
SMOOTH_Z = 1.64
"""Standard errors by which the scatter may fall short of the stretch's variance (von Neumann)."""
REST_Z = 4.0
"""Standard errors from zero that a mean must have to be a motion."""
_SPEEDS = [INDEX[name] for name in ("vx", "vy", "wz")]
_RATES = [INDEX[name] for name in ("ax", "ay", "yaw_acceleration")]


def at_steady_speeds(
    log: Telemetry,
    least: int = LEAST_SEGMENT_ROWS,
    elsewhere: Telemetry | None = None,
    apart: int = 1,
) -> Telemetry:
    """The log with the speeds of steady stretches at their means.

    Args:
        log: the rows; their runs and times say which of them follow each other.
        least: rows of a stretch, at least.
        elsewhere: the same rows in another reading, which stands outside of steady stretches.
        apart: rows from which on the noise is independent; ``least`` is several times as many.

    Returns:
        A log with the same rows, of which only velocities and accelerations differ; from
        ``elsewhere``, also what else its reading changes.
    """
    rows = (log if elsewhere is None else elsewhere).rows.copy()
    rate = rows[:, _RATES]  # of the body's speeds, without the turning of the frame
    vx, vy, wz = rows[:, _SPEEDS].T
    rate[:, 0] += wz * vy
    rate[:, 1] -= wz * vx
    ends = np.array([stop for _, stop in log.segments()], np.int64)
    for axis, (place, most) in enumerate(zip(_SPEEDS, Telemetry.SPEED_ERROR, strict=True)):
        speed = log.rows[:, place].copy()
        steady, inside = np.zeros((2, len(log)), np.bool_)
        if len(log):
            _average(speed, ends, most, least, apart, steady, inside)
        rows[steady, place] = speed[steady]
        rate[inside, axis] = 0.0
    vx, vy, wz = rows[:, _SPEEDS].T
    rate[:, 0] -= wz * vy
    rate[:, 1] += wz * vx
    rows[:, _RATES] = rate
    return replace(log, rows=rows)


def stretches(log: Telemetry, speed: str) -> tuple[Integers, Integers, Mask]:
    """Which rows share a speed: what odometry errs by is averaged over these.

    Args:
        log: the rows, at steady speeds.
        speed: "vx", "vy" or "wz".

    Returns:
        (n,) number of the stretch of every row; (n,) how many rows it has, 1 where the speed
        changes; and (n,) whether these are enough for a steady drive.
    """
    values = log.rows[:, INDEX[speed]]
    begins = np.ones(len(log), np.bool_)
    begins[1:] = (np.diff(values) != 0.0) | (np.diff(log.run) != 0)
    number = np.cumsum(begins) - 1
    count = np.bincount(number)[number]
    return number, count, count >= LEAST_SEGMENT_ROWS


@njit(cache=True, nogil=True)
def _average(
    speed: Any, ends: Any, most: float, least: int, apart: int, steady: Any, inside: Any
) -> None:
    """Average a speed (n,) over steady stretches, in place; mark their rows and those inside.

    ``ends`` are those of the segments; ``most`` is how far the speed may range, over ``least`` rows
    or more. A row beside another motion is not inside: it may have begun to change its own.
    """
    first = 0
    for last in ends:
        start = first
        while start < last:
            stop = _end_of_range(speed, start, last, most)
            # Halves wait here; each is half as long as the one before it.
            waiting = [(start, stop)]
            while len(waiting) > 0:
                begin, end = waiting.pop()
                if end - begin < least:
                    continue
                if _drifts(speed[begin:end], apart):
                    middle = begin + (end - begin) // 2
                    waiting.append((middle, end))
                    waiting.append((begin, middle))
                    continue
                speed[begin:end] = _steady(speed[begin:end], apart)
                steady[begin:end] = True
                inside[begin if begin == first else begin + 1 : end if end == last else end - 1] = (
                    True
                )
            start = stop
        first = last


@njit(cache=True, nogil=True)
def _end_of_range(speed: Any, start: int, last: int, most: float) -> int:
    """End of the longest stretch from ``start`` on that ranges, or leaves zero, by no more."""
    low = high = speed[start]
    for k in range(start + 1, last):
        low, high = min(low, speed[k]), max(high, speed[k])
        if high - low > most and max(high, -low) > most:
            return k
    return last


@njit(cache=True, nogil=True)
def _drifts(part: Any, apart: int) -> bool:
    """Whether the halves of a stretch (n,) differ by more than its scatter, or that is smooth."""
    count, scatter = part.shape[0], _scatter(part, apart)
    half = count // 2
    differ = abs(np.mean(part[:half]) - np.mean(part[count - half :]))
    smooth = scatter**2 < (1.0 - SMOOTH_Z / np.sqrt(count / apart + 1.0)) * np.var(part)
    return bool(smooth or differ > DRIFT_Z * scatter * np.sqrt(2.0 * apart / half))


@njit(cache=True, nogil=True)
def _steady(part: Any, apart: int) -> float:
    """Mean of a stretch (n,), or zero where it does not differ from zero by REST_Z."""
    mean = float(np.mean(part))
    error = _scatter(part, apart) / np.sqrt(part.shape[0] / apart)
    return 0.0 if abs(mean) < REST_Z * error else mean


@njit(cache=True, nogil=True)
def _scatter(part: Any, apart: int) -> float:
    return float(np.sqrt(0.5 * np.mean((part[apart:] - part[:-apart]) ** 2)))
