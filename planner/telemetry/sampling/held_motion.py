"""Motion between the updates of a sensor that is slower than the log.

    log = with_motion_between_updates(log)      # None where no channel is held

A recorder with one row for all channels repeats the last value of a slower one. A speed of 10 Hz in
rows of 40 Hz stands still for three rows and then jumps: its change seems to be four times as large
in one row, and none in the others. Between two updates the motion went from one to the other.

Channels that come in one message are held together: the speeds of odometry, pitch and roll of an
inertial sensor. A channel is held where it changes once in so many rows, always about as many.
Set-points change when the operator wants it, and a steady drive of coarse values when it does.

Left out
    the age of a value when its first row was written, which is less than a row.
Source
    Akima, "A new method of interpolation and smooth curve fitting based on local procedures",
    Journal of the ACM 17(4), 1970: the curve between updates.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from planner.arrays import Array, Integers
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling.accelerations import SPEEDS, put_accelerations, slopes_of

ATTITUDE = "gravity_x", "gravity_y", "gravity_normal"
SLOWEST_SENSOR = 0.5
"""s between updates; what is slower than that is no sensor of the motion, but a set-point."""
ALIKE_HOLDS = 0.8
"""Share of the updates that come a usual number of rows after the last, or one more or less."""
FEWEST_UPDATES = 20
"""Updates that say how regular they are."""


def with_motion_between_updates(log: Telemetry) -> Telemetry | None:
    """The log with speeds and angles that go from one update to the next.

    Args:
        log: the rows as read.

    Returns:
        A log with the same rows; held speeds, accelerations that follow from them and were not
        measured, and held angles differ. None where no channel is held.
    """
    rows, found = log.rows.copy(), False
    for group in (SPEEDS, ATTITUDE):
        columns = [INDEX[name] for name in group]
        updates = _updates(log, rows[:, columns])
        if updates is not None:
            found = True
            rows[:, columns] = _between(log, rows[:, columns], updates)
    if not found:
        return None
    log = replace(log, rows=rows)
    slopes = slopes_of(log, rows[:, [INDEX[name] for name in SPEEDS]])
    put_accelerations(log, rows, np.arange(len(log)), slopes)
    return log


def _updates(log: Telemetry, values: Array) -> Integers | None:
    """Rows of updates, and first rows of stretches; None where each row may be one."""
    changed = np.any(values[1:] != values[:-1], axis=1)
    begins = np.zeros(len(log), np.bool_)
    begins[[start for start, _ in log.segments()]] = True
    new = np.flatnonzero(np.append(False, changed) & ~begins)
    number = np.cumsum(begins)
    # Only between two changes of one stretch is a hold seen from its beginning to its end.
    holds = np.diff(new)[number[new[1:]] == number[new[:-1]]]
    if len(holds) < FEWEST_UPDATES:
        return None
    usual = np.median(holds)
    lasts = usual * float(np.median(log.interval))
    alike = np.mean(np.abs(holds - usual) <= (1.0 if usual > 2.0 else 0.0))
    if usual < 2.0 or lasts > SLOWEST_SENSOR or alike < ALIKE_HOLDS:
        return None
    seen = np.union1d(new, np.flatnonzero(begins))
    return np.sort(np.concatenate([seen, *_unseen(seen, len(log), int(usual))]))


def _unseen(seen: Integers, rows: int, usual: int) -> list[Integers]:
    """Rows of updates that brought the same value again, as at rest: the usual number apart."""
    ends = np.append(seen[1:], rows)
    return [np.arange(a + usual, b - usual // 2, usual) for a, b in zip(seen, ends, strict=True)]


def _between(log: Telemetry, values: Array, updates: Integers) -> Array:
    """Values (n, k) between the updates of each stretch; after its last one they are held."""
    between = values.copy()
    for start, stop in log.segments():
        known = updates[(updates >= start) & (updates < stop)]
        if len(known) > 1:
            time = log.time[start : known[-1] + 1]
            # It keeps a stand a stand, where a spline would swing before and after.
            curve = Akima1DInterpolator(log.time[known], values[known])
            between[start : known[-1] + 1] = curve(time)
    return between
