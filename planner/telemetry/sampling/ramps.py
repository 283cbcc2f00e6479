"""Motion as straight ramps: the speeds of all axes bend at the same moments, and only there.

    log = with_ramps(log, smoothed)      # the same rows; outside of the motion as in ``smoothed``

Controllers drive speeds along ramps, so that accelerations jump. A parabola of some tenths of a
second blurs such a jump, and what it blurs looks like a filter of the meter or like an effect at
the ends of ramps. Here a run is divided into pieces in which every speed is a straight line. The
division is the likeliest one that a further piece would not improve by PIECE_GAIN. Each bend then
moves to where its two lines meet, and all lines are fitted together. Noise averages over a whole
piece. Lines that clearly do not meet are a change of speed from one row to the next.

Of a motion that bends all the time, pieces are as short as its noise permits. Which reading is the
robot's motion, held-out runs decide (planner.telemetry.diagnosis.best_reading).

Left out
    noise that lasts for some rows, behind a filter: it is divided as motion is. Rows that are
    exactly at rest take part in the fit and stay as they are.
Source
    the division: Killick, Fearnhead & Eckley, "Optimal detection of changepoints with a linear
    computational cost", Journal of the American Statistical Association 107(500), 2012;
    bends that move to where lines meet: Muggeo, "Estimating regression models with unknown
    break-points", Statistics in Medicine 22(19), 2003.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import solveh_banded

from planner.arrays import Array, Integers
from planner.compiled_code import njit
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry, pieces_of
from planner.telemetry.sampling.accelerations import (
    RATES,
    SPEEDS,
    felt_by_a_turning_body,
    moving,
)
from planner.telemetry.sampling.noisier_motion import noise_of_motion

PIECE_GAIN = 25.0
"""Variances of the noise by which a further piece must lower the sum of squares. A line of its own
in three axes has seven numbers. Pure noise begins one in some thousand rows."""
LEAST_PIECE_ROWS = 3
"""Rows of a piece, at least: two would be a line through any noise."""
MOST_PIECE_ROWS = 500
"""Rows of a piece, at most, which bounds the time of a division; longer ones go on as the next."""
ROUNDS = 4
"""Times that pieces move to where their lines meet; most stay after two."""
LEAST_NOISE = 0.1
"""Share of Telemetry.SPEED_ERROR that the noise of the speeds is taken for, at least. Logs without
noise would else have a piece wherever a speed is rounded."""
ROUNDED = math.sqrt(12.0)
"""Steps of a rounded value over its standard error."""
_SPEEDS = np.array([INDEX[name] for name in SPEEDS])
_RATES = np.array([INDEX[name] for name in RATES])


def with_ramps(log: Telemetry, elsewhere: Telemetry) -> Telemetry:
    """The log with speeds and accelerations of ramps.

    Args:
        log: the rows as read; their runs and times say which of them follow each other.
        elsewhere: the same rows in another reading, which gives all but speeds and accelerations.

    Returns:
        A log with the same rows. Accelerations that were not measured are slopes of the ramps;
        those that were are at their mean over each piece. Rows at rest are as ``elsewhere``, and
        so are stretches of less than two pieces.
    """
    rows = elsewhere.rows.copy()
    size = _noise(log)
    speeds = log.rows[:, _SPEEDS] / size
    ramps, slopes = speeds.copy(), np.zeros_like(speeds)
    # Measured accelerations of the body's speeds, without the turning of the frame.
    turning = felt_by_a_turning_body(log.rows, np.zeros_like(speeds))
    measured = log.rows[:, _RATES] - turning
    there = moving(log)
    for start, stop in log.segments():
        if stop - start < 2 * LEAST_PIECE_ROWS:
            there[start:stop] = False
            continue
        run = slice(start, stop)
        time = log.time[run] - log.time[start]
        ramps[run], slopes[run], begins = _ramps(time, np.ascontiguousarray(speeds[run]))
        counts = np.diff([*begins, stop - start])
        means = np.add.reduceat(measured[run], begins) / counts[:, None]
        measured[run] = np.repeat(means, counts, axis=0)
    slopes *= size
    for axis, name in enumerate(RATES):
        if name in log.present:
            slopes[:, axis] = measured[:, axis]
    rows[np.ix_(there, _SPEEDS)] = (ramps * size)[there]
    rows[np.ix_(there, _RATES)] = felt_by_a_turning_body(rows[there], slopes[there])
    return replace(elsewhere, rows=rows)


def _noise(log: Telemetry) -> Array:
    """(n, 3) m/s, m/s and rad/s, noise of the speeds in the run of each row.

    Every run has its own, so that a chunk of the log is divided as all of it. Encoders that count
    coarsely err by their steps, in which third differences see nothing. A step above the usual
    error of odometry is one of the motion.
    """
    usual = np.array(Telemetry.SPEED_ERROR)
    size = np.tile(LEAST_NOISE * usual, (len(log), 1))
    for start, stop in pieces_of(log.run):
        run = log.take(slice(start, stop))
        noise = noise_of_motion(run)
        for axis, (name, place) in enumerate(zip(SPEEDS, _SPEEDS, strict=True)):
            steps = np.abs(np.diff(run.rows[:, place]))
            step = float(np.min(steps, where=steps > 0.0, initial=np.inf))
            counted = step / ROUNDED if step <= usual[axis] else 0.0
            size[start:stop, axis] = max(size[start, axis], noise[name], counted)
    return size


def _ramps(time: Array, values: Array) -> tuple[Array, Array, Integers]:
    """Ramps through a stretch of rows, their slopes, and the first rows of the pieces.

    Args:
        time, values: (n,) s and (n, m), each of noise 1.
    """
    begins = straight_pieces(time, values)
    bends, meeting = _bends(time, values, begins)
    found = *_lines_through(time, values, bends), begins
    least = _cost(values, found[0], bends)
    for _ in range(ROUNDS):
        begins = _moved(begins, meeting, len(time))
        bends, meeting = _bends(time, values, begins)
        tried = *_lines_through(time, values, bends), begins
        if (cost := _cost(values, tried[0], bends)) >= least:
            break
        found, least = tried, cost
    return found


def _cost(values: Array, lines: Array, bends: Array) -> float:
    return float(np.sum((lines - values) ** 2)) + PIECE_GAIN * len(bends)


def _bends(time: Array, values: Array, begins: Integers) -> tuple[Array, Integers]:
    """Where lines bend, and the first rows after the moments where they would meet.

    Returns:
        (j,) s, the ends of the stretch, and between two pieces the moment where their lines come
        nearest to each other, or both rows beside the border if they clearly do not meet there;
        (k - 1,) numbers of rows.
    """
    rows = np.diff([*begins, len(time)])
    middle = np.add.reduceat(time, begins) / rows
    mean = np.add.reduceat(values, begins) / rows[:, None]
    away = time - np.repeat(middle, rows)
    spread = np.add.reduceat(away**2, begins)
    slope = np.add.reduceat(away[:, None] * values, begins) / spread[:, None]
    last, following = time[begins[1:] - 1], time[begins[1:]]
    border = 0.5 * (last + following)
    before, after = (border - middle[:-1])[:, None], (border - middle[1:])[:, None]
    apart = mean[1:] + slope[1:] * after - mean[:-1] - slope[:-1] * before
    turn = np.diff(slope, axis=0)
    square = np.sum(turn**2, axis=1)
    there = square > 0.0  # lines that are parallel never meet
    meet = border - np.sum(apart * turn, axis=1) / np.where(there, square, np.inf)
    error = 1.0 / rows[:-1] + before[:, 0] ** 2 / spread[:-1]
    error += 1.0 / rows[1:] + after[:, 0] ** 2 / spread[1:]
    jump = np.sum(apart**2, axis=1) / error > PIECE_GAIN
    jump &= ~there | (meet < last) | (meet > following)
    at = np.clip(meet, last, following)
    bends = [time[:1], np.where(jump, last, at), following[jump], time[-1:]]
    return np.unique(np.concatenate(bends)), np.searchsorted(time, meet)


def _moved(begins: Integers, meeting: Integers, count: int) -> Integers:
    """First rows of the pieces, moved to the rows where lines meet if no piece gets too short."""
    moved, ends = begins.copy(), np.append(begins, count)[2:]
    for k, (row, end) in enumerate(zip(meeting, ends, strict=True), 1):
        if row - moved[k - 1] >= LEAST_PIECE_ROWS and end - row >= LEAST_PIECE_ROWS:
            moved[k] = row
    return moved


def _lines_through(time: Array, values: Array, bends: Array) -> tuple[Array, Array]:
    """Values and slopes, (n, m) each, of the lines between bends (j,) that fit best.

    A row at a bend belongs to the line before it, as it stands for the time before it.
    """
    piece = np.maximum(np.searchsorted(bends, time) - 1, 0)
    length = np.diff(bends)
    after = ((time - bends[piece]) / length[piece])[:, None]
    before = 1.0 - after
    # Least squares over the values at the bends: each meets its neighbours only.
    banded = np.zeros((2, len(bends)))
    np.add.at(banded[1], piece, before[:, 0] ** 2)
    np.add.at(banded[1], piece + 1, after[:, 0] ** 2)
    np.add.at(banded[0], piece + 1, (before * after)[:, 0])
    right = np.zeros((len(bends), values.shape[1]))
    np.add.at(right, piece, before * values)
    np.add.at(right, piece + 1, after * values)
    at = solveh_banded(banded, right)
    slopes = np.diff(at, axis=0) / length[:, None]
    return before * at[piece] + after * at[piece + 1], slopes[piece]


@njit(cache=True, nogil=True)
def straight_pieces(time: Any, values: Any) -> Any:
    """(k,) first rows of the straight pieces of values (n, m), each of noise 1, at (n,) s.

    The sum of squares that lines leave, and PIECE_GAIN for each piece, is the least possible.
    """
    count, axes = values.shape
    cost = np.full(count + 1, np.inf)
    cost[0] = 0.0
    begin = np.zeros(count + 1, np.int64)
    # Pieces that may go on: their first rows, sums from there on, and when they lost.
    firsts, lost, going = np.zeros(count + 1, np.int64), np.zeros(count + 1, np.int64), 0
    sums = np.zeros((count + 1, 2 + 3 * axes))
    without = np.zeros(count + 1)
    for end in range(1, count + 1):
        if cost[end - 1] < np.inf:
            firsts[going], lost[going], sums[going] = end - 1, count + 1, 0.0
            going += 1
        for k in range(going):
            first = firsts[k]
            without[k] = np.inf
            misfit = _misfit(sums[k], end - first, time[end - 1] - time[first], values, first, end)
            if end - first >= LEAST_PIECE_ROWS:
                without[k] = cost[first] + misfit
                if without[k] + PIECE_GAIN < cost[end]:
                    cost[end], begin[end] = without[k] + PIECE_GAIN, first
        kept = 0
        for k in range(going):
            if lost[k] > end and end - firsts[k] >= LEAST_PIECE_ROWS and without[k] > cost[end]:
                lost[k] = end
            # One that lost by a whole piece never wins again once that piece is long enough.
            if end - lost[k] < LEAST_PIECE_ROWS - 1 and end - firsts[k] < MOST_PIECE_ROWS:
                firsts[kept], lost[kept], sums[kept] = firsts[k], lost[k], sums[k]
                kept += 1
        going = kept
    pieces, row = 0, count
    while row > 0:
        pieces, row = pieces + 1, begin[row]
    found, row = np.zeros(pieces, np.int64), count
    for k in range(pieces - 1, -1, -1):
        row = begin[row]
        found[k] = row
    return found


@njit(cache=True, nogil=True)
def _misfit(sums: Any, rows: int, time: float, values: Any, first: int, end: int) -> float:
    """Sum of squares that a line through a piece leaves; its last row joins ``sums`` here.

    Sums are of times and values from the first row on, so that they are exact in long runs.
    """
    sums[0] += time
    sums[1] += time**2
    spread = sums[1] - sums[0] ** 2 / rows
    left = 0.0
    for axis in range(values.shape[1]):
        value = values[end - 1, axis] - values[first, axis]
        k = 2 + 3 * axis
        sums[k] += value
        sums[k + 1] += time * value
        sums[k + 2] += value**2
        along = sums[k + 1] - sums[0] * sums[k] / rows
        left += sums[k + 2] - sums[k] ** 2 / rows
        left -= along**2 / spread if spread > 0.0 else 0.0
    return max(left, 0.0)
