"""Motion between the updates of a sensor that is slower than the log.

    holds = holds_of(log)                            # rows of speeds and angles, 0 where not held
    log = with_motion_between_updates(log, holds)    # the same rows; held channels differ

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

from collections.abc import Sequence
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
"""Share of the updates that come about a usual number of rows after the last: 2.5 are 2 and 3."""
FEWEST_UPDATES = 20
"""Updates that say how regular they are."""
GROUPS = SPEEDS, ATTITUDE
Holds = tuple[float, float]
"""Rows between updates of the speeds and of the angles; 0 where each row may have one."""


def holds_of(log: Telemetry) -> Holds:
    """How many rows a recorder repeats speeds and angles for."""
    speeds, angles = (_rows_of(log, _values(log, group)) for group in GROUPS)
    return speeds, angles


def with_motion_between_updates(log: Telemetry, holds: Holds) -> Telemetry:
    """The log with speeds and angles that go from one update to the next.

    Args:
        log: the rows as read.
        holds: from ``holds_of``.

    Returns:
        A log with the same rows. Held speeds and held angles differ, and what follows from them
        and was not measured: accelerations, and changes of the slope.
    """
    rows = log.rows.copy()
    for group, usual in zip(GROUPS, holds, strict=True):
        values = _values(log, group)
        if usual and np.isfinite(values).all():
            rows[:, [INDEX[name] for name in group]] = _between(log, values, int(usual))
    log = replace(log, rows=rows)
    if holds[0]:
        put_accelerations(log, rows, np.arange(len(log)), slopes_of(log, _values(log, SPEEDS)))
    if holds[1] and "slope_rate" not in log.present:
        x, y, normal = _values(log, ATTITUDE).T
        slope = np.arctan2(np.hypot(x, y), normal)
        rows[:, INDEX["slope_rate"]] = np.abs(slopes_of(log, slope[:, None])[:, 0])
    return log


def _values(log: Telemetry, group: Sequence[str]) -> Array:
    return log.rows[:, [INDEX[name] for name in group]]


def _rows_of(log: Telemetry, values: Array) -> float:
    """Rows between updates of channels (n, k) that are held; 0 where they are not."""
    new, number = _changes(log, values)
    # Only between two changes of one stretch is a hold seen from its beginning to its end.
    holds = np.diff(new)[number[new[1:]] == number[new[:-1]]]
    if len(holds) < FEWEST_UPDATES or not np.isfinite(values).all():
        return 0.0
    usual = float(np.median(holds))
    alike = np.mean((np.abs(holds - usual) <= 1.0) & (holds > 1))
    slow = usual * float(np.median(log.interval)) > SLOWEST_SENSOR
    return 0.0 if usual < 2.0 or slow or alike < ALIKE_HOLDS else usual


def _changes(log: Telemetry, values: Array) -> tuple[Integers, Integers]:
    """Rows that differ from the one before in their stretch, and (n,) number of every stretch."""
    begins = np.zeros(len(log), np.bool_)
    begins[[start for start, _ in log.segments()]] = True
    changed = np.append(False, np.any(values[1:] != values[:-1], axis=1))
    return np.flatnonzero(changed & ~begins), np.cumsum(begins)


def _between(log: Telemetry, values: Array, usual: int) -> Array:
    """Values (n, k) between the updates of each stretch; after its last one they are held."""
    between = values.copy()
    new, _ = _changes(log, values)
    for start, stop in log.segments():
        known = _updates(new[(new >= start) & (new < stop)], start, stop, usual)
        if len(known) > 1:
            part = slice(start, known[-1] + 1)
            between[part] = _curve(log.time[part], log.time[known], values[known])
    return between


def _updates(new: Integers, start: int, stop: int, usual: int) -> Integers:
    """Rows of a stretch's updates; those that brought the same value again, too, as at rest."""
    seen = np.append(start, new)
    ends = np.append(new, stop)
    same = [np.arange(a + usual, b - usual // 2, usual) for a, b in zip(seen, ends, strict=True)]
    return np.sort(np.concatenate([seen, *same]))


def _curve(time: Array, known: Array, values: Array) -> Array:
    """Values (n, k) at times (n,) between those (m, k) at ``known`` (m,)."""
    if len(known) == 2:
        share = ((time - known[0]) / (known[1] - known[0]))[:, None]
        return np.asarray(values[0] + share * (values[1] - values[0]))
    curve = np.asarray(Akima1DInterpolator(known, values)(time))
    # What comes to rest, or stays on one side, does not swing to the other: friction would turn.
    after = np.clip(np.searchsorted(known, time, side="right"), 1, len(known) - 1)
    low = np.minimum(values[after - 1], values[after])
    high = np.maximum(values[after - 1], values[after])
    return np.clip(curve, np.where(low >= 0.0, 0.0, -np.inf), np.where(high <= 0.0, 0.0, np.inf))
