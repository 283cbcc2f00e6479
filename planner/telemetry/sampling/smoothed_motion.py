"""Motion as a parabola through neighbouring rows: speeds, slopes of the ground, accelerations.

    log = with_smoothed_motion(log, 0.2)     # the same rows; parabolas over 0.2 s on either side

At short rows, differences of neighbouring speeds are noise of the odometry, and so is what tilt
sensors and accelerometers show from row to row. A prediction from them scatters, and a meter that
averages seems to be there because it takes this scatter away. A parabola through the m rows around
one has √(12/(m·(m² - 1))) of the noise per row in its slope, and about 1.5/√m of it in its value.
It also blurs what really changes within that time, so held-out runs decide which reading is the
robot's motion (planner.telemetry.diagnosis.best_reading).

Left out
    rows that are exactly at rest, which encoders know for certain.
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
from planner.telemetry.sampling.accelerations import RATES, SPEEDS, moving, put_accelerations

LEAST_NEIGHBOURS = 3
"""Rows on either side, at least: a parabola through five leaves 70 % of a value's noise."""
MOST_FITTED_ROWS = 25
"""Rows on either side that a parabola is drawn through; of more, so many evenly chosen ones."""
ROUNDING = 1e-6
"""Share of a time that rounding adds: ten rows of 10 ms are within a tenth of a second."""
_MEASURED = (*SPEEDS, *RATES, "gravity_x", "gravity_y", "gravity_normal")


def can_be_smoothed(log: Telemetry, half_width: float) -> bool:
    """Whether any row has neighbours enough within ``half_width`` s."""
    return bool((_neighbours(log, half_width) >= LEAST_NEIGHBOURS).any())


def with_smoothed_motion(log: Telemetry, half_width: float) -> Telemetry:
    """The log with speeds, accelerations and gravity from parabolas through neighbouring rows.

    Args:
        log: the rows; their runs and times say which of them follow each other.
        half_width: s on either side of a row.

    Returns:
        A log with the same rows. Accelerations that were not measured are slopes of the speeds.
        Rows with fewer than LEAST_NEIGHBOURS on either side stay, as do those at rest.
    """
    reach = _neighbours(log, half_width)
    wide = np.flatnonzero((reach >= LEAST_NEIGHBOURS) & moving(log))
    if not len(wide):
        return log
    places = np.array([INDEX[name] for name in _MEASURED])
    values, slopes = _parabolas(log.time, log.rows[:, places], wide, reach[wide])
    rows = log.rows.copy()
    rows[np.ix_(wide, places)] = values
    put_accelerations(log, rows, wide, slopes[:, : len(SPEEDS)])
    return replace(log, rows=rows)


def _neighbours(log: Telemetry, half_width: float) -> Integers:
    """(n,) rows within a time on either side, in the same stretch of consecutive rows."""
    within = half_width * (1.0 + ROUNDING)
    reach = np.zeros(len(log), np.int64)
    for start, stop in log.segments():
        time, number = log.time[start:stop], np.arange(stop - start)
        after = np.searchsorted(time, time + within, side="right") - 1 - number
        before = number - np.searchsorted(time, time - within, side="left")
        reach[start:stop] = np.minimum(before, after)
    return reach


def _parabolas(time: Array, columns: Array, at: Integers, reach: Integers) -> tuple[Array, Array]:
    """Values and slopes, (k, m) each, of least-squares parabolas around the rows ``at`` (k,).

    Args:
        time, columns: (n,) s and (n, m), of all rows.
        at: rows in the middle.
        reach: (k,) rows on either side that each parabola takes.
    """
    rows = np.minimum(reach, MOST_FITTED_ROWS)
    powers = np.zeros((len(at), 5))
    sums = np.zeros((len(at), 3, columns.shape[1]))
    for k in range(-int(rows.max()), int(rows.max()) + 1):
        near = np.abs(k) <= rows
        row = at[near] + np.rint(reach[near] * (k / rows[near])).astype(np.int64)
        power = np.power.outer(time[row] - time[at[near]], np.arange(5))
        powers[near] += power
        sums[near] += power[:, :3, None] * columns[row, None, :]
    # In units of the window, so that the three coefficients are of one size.
    size = np.sqrt(powers[:, 2] / powers[:, 0])
    powers /= np.power.outer(size, np.arange(5))
    sums /= np.power.outer(size, np.arange(3))[:, :, None]
    gram = powers[:, np.add.outer(np.arange(3), np.arange(3))]
    value, slope, _ = np.moveaxis(np.linalg.solve(gram, sums), 1, 0)
    return value, slope / size[:, None]
