"""Rows at the moments they were measured, where a log has only the moments at which they arrived.

    log = with_even_clock(log)      # the same rows; time, interval and accelerations differ

A driver samples at an even rate. A serial port, a queue or a busy computer hands several samples
over at once, and a recorder that has no stamps of the sensor writes down when each one came: some
rows are 1 ms apart, and the next is late by several intervals. A change of speed over such an
interval is no acceleration, and a stretch of rows seems to end at every late one.

No sample arrives before it was measured, and samples are one period apart. So the delay of a row is
at least that by which it is later than an even row of some sample that comes soon after it:

    t_k = min over j = k … k + w of (arrival_j - (j - k)·period)

The period follows from the median of what w rows last. Where rows are lost, the time jumps for
good, and so does the even one.

Left out
    accelerations that were measured. A queue that is late for longer than w rows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from planner.arrays import Array
from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling.accelerations import SPEEDS, put_accelerations, slopes_of

AHEAD = 50
"""Rows among which one comes without delay, and so shows when those before it were measured."""
GAP = 1.2
"""Factor on the usual time of so many rows above which rows are missing among them."""


def with_even_clock(log: Telemetry) -> Telemetry | None:
    """The log with the times at which its rows were measured, if these were even.

    Args:
        log: the rows as read.

    Returns:
        A log with the same rows; time, interval and accelerations that were not measured differ.
        None if all runs are as short as AHEAD rows.
    """
    if not any(stop - start > AHEAD for start, stop in log.run_pieces()):
        return None
    time = log.time.copy()
    pieces = [slice(*piece) for piece in log.run_pieces()]
    lasted = np.concatenate([log.time[one][AHEAD:] - log.time[one][:-AHEAD] for one in pieces])
    without_gap = lasted < GAP * np.median(lasted)
    period = float(np.median(lasted[without_gap])) / AHEAD
    for one in pieces:
        time[one] = _measured(log.time[one], period)
    even = replace(log, time=time, rows=log.rows.copy())
    interval = np.diff(time, prepend=0.0)
    interval[[start for start, _ in even.segments()]] = period
    even = replace(even, interval=interval)
    speeds = log.rows[:, [INDEX[name] for name in SPEEDS]]
    put_accelerations(even, even.rows, np.arange(len(log)), slopes_of(even, speeds))
    return even


def _measured(arrival: Array, period: float) -> Array:
    """Times (n,) of samples, one period apart, that arrived at ``arrival`` (n,)."""
    even = period * np.arange(len(arrival))
    late = np.concatenate([arrival - even, np.full(AHEAD, np.inf)])
    return np.asarray(even + sliding_window_view(late, AHEAD + 1).min(axis=1))
