"""Accelerations as slopes of lines through neighbouring rows.

    log = with_local_slopes(log)     # the same rows; derived accelerations over 0.2 s

At short rows, differences of neighbouring speeds are noise of the odometry. A line through the m
rows within SLOPE_TIME has √(12/(m·(m² - 1))) of it per row. It also blurs what really changes
within that time, so held-out runs decide which reading is the robot's motion
(planner.telemetry.diagnosis.best_reading).
Source
    least squares; Savitzky & Golay, "Smoothing and differentiation of data by simplified least
    squares procedures", Analytical Chemistry 36(8), 1964.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.arrays import Array, Integers
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry

SLOPE_TIME = 0.1
"""s on either side of a row. Wheels and bodies hardly change their acceleration within it."""
MOST_SLOPE_ROWS = 25
"""Rows on either side that a line is drawn through; of more, so many evenly chosen ones."""
_REACH = SLOPE_TIME * (1.0 + 1e-6)
"""s, with room for rounding: ten rows of 10 ms are within a tenth of a second."""


def has_local_slopes(log: Telemetry) -> bool:
    """Whether any row has neighbours enough, and an acceleration that was not measured."""
    return "ax" not in log.present and bool((_neighbours(log) > 1).any())


def with_local_slopes(log: Telemetry) -> Telemetry:
    """The log with derived accelerations as slopes of lines.

    Args:
        log: the rows; their runs and times say which of them follow each other.

    Returns:
        A log with the same rows, of which only accelerations differ that were not measured. Rows
        with fewer than two neighbours on either side within SLOPE_TIME keep theirs.
    """
    reach = _neighbours(log)
    wide = np.flatnonzero(reach > 1)
    if not len(wide):
        return log
    rows = log.rows.copy()
    vx, vy, wz = (log.rows[:, INDEX[name]] for name in ("vx", "vy", "wz"))
    frame = {"ax": -wz * vy, "ay": wz * vx, "yaw_acceleration": np.zeros(len(log))}
    for (name, turning), speed in zip(frame.items(), (vx, vy, wz), strict=True):
        if name not in log.present:
            rows[wide, INDEX[name]] = turning[wide] + _slopes(log.time, speed, wide, reach[wide])
    return replace(log, rows=rows)


def _neighbours(log: Telemetry) -> Integers:
    """(n,) rows within SLOPE_TIME on either side, in the same stretch of consecutive rows."""
    reach = np.zeros(len(log), np.int64)
    for start, stop in log.segments():
        time, number = log.time[start:stop], np.arange(stop - start)
        after = np.searchsorted(time, time + _REACH, side="right") - 1 - number
        before = number - np.searchsorted(time, time - _REACH, side="left")
        reach[start:stop] = np.minimum(before, after)
    return reach


def _slopes(time: Array, speed: Array, at: Integers, reach: Integers) -> Array:
    """Slope of a line around each of the rows ``at``, through ``reach`` rows on either side."""
    rows = np.minimum(reach, MOST_SLOPE_ROWS)
    sums = np.zeros((4, len(at)))
    for k in range(-int(rows.max()), int(rows.max()) + 1):
        # Rows with fewer neighbours add zeros.
        offset = np.where(np.abs(k) <= rows, np.rint(reach * (k / rows)), 0.0)
        row = at + offset.astype(np.int64)
        t, y = time[row] - time[at], speed[row] - speed[at]
        sums += [t, y, t * t, t * y]
    t, y, tt, ty = sums / (2 * rows + 1)
    return np.asarray((ty - t * y) / (tt - t * t))
