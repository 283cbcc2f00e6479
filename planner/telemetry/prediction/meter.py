"""What a meter shows of a power: a filter or an even mean, with a delay, linear in the power.

    readings = Readings.of(log)              # None where the log's meter does nothing
    readings.change(columns)                 # (n, m) W per unit, as the meter shows them
    readings.shown(watts)                    # (n,) W, with what the meter showed before
    meter_columns(log, watts)                # (n, k) W/s, derivatives by the fitted numbers

Between the middles of rows the power is taken as linear, and the filter's answer to that is exact
(a first-order hold: Franklin, Powell & Workman, Digital control of dynamic systems, 1998). At a
time constant and a delay of zero the reading is the power itself. Before the first row of a stretch
nothing is known of the power but that row's reading, so the filter starts from it, one interval
earlier.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from planner.arrays import Array, Integers, Mask
from planner.telemetry.logs import Meter, Telemetry
from planner.telemetry.prediction.held_readings import held_rows
from planner.telemetry.prediction.per_log import per_log

STEP_SHARE = 0.05
"""Step of a derivative over the time constant or over the interval of a row."""


class _Window(NamedTuple):
    """An even mean over ``seconds`` before each row's moment.

    Attributes:
        low, share: (n,) it begins between row ``low`` and the next, or with the stretch.
        step: (n,) s since the row before; 0 where a stretch begins.
        missing: (n,) share of it before the stretch.
    """

    low: Integers
    share: Array
    step: Array
    missing: Array
    seconds: float

    @classmethod
    def of(cls, log: Telemetry, time: Array, seconds: float) -> _Window:
        low, share = np.zeros(len(log), np.int64), np.zeros(len(log))
        step, missing = np.diff(time, prepend=time[0]), np.zeros(len(log))
        for start, stop in log.segments():
            own, step[start] = time[start:stop], 0.0
            place = np.interp(own - seconds, own, np.arange(start, stop))
            low[start:stop] = place.astype(np.int64)
            share[start:stop] = place - low[start:stop]
            missing[start:stop] = np.maximum(1.0 - (own - own[0]) / seconds, 0.0)
        return cls(low, share, step, missing, seconds)

    def mean(self, columns: Array) -> Array:
        """(n, m) of columns (n, m), which are 0 before each stretch."""
        trapezes = np.zeros(columns.shape)
        trapezes[1:] = 0.5 * (columns[1:] + columns[:-1]) * self.step[1:, None]
        total = np.cumsum(trapezes, axis=0)
        low, share = total[self.low], self.share[:, None]
        begun = low + share * (total[np.minimum(self.low + 1, len(total) - 1)] - low)
        return np.asarray((total - begun) / self.seconds)


class Readings(NamedTuple):
    """The rows of a log as its meter shows them.

    Attributes:
        low, share: (n,) the shifted power of a row lies between that of rows ``low`` and the next.
        keep, before, now: (n,) weights of the reading before, of the power before and of this one.
        begins: (n,) whether a row begins a stretch.
        held: (n,) row whose reading a row shows.
        carried: (n,) W that is left of what the meter showed before each stretch.
        window: of a meter that averages evenly.
    """

    low: Integers
    share: Array
    keep: Array
    before: Array
    now: Array
    begins: Mask
    held: Integers
    carried: Array
    window: _Window | None = None

    @classmethod
    def of(cls, log: Telemetry) -> Readings | None:
        """The operator of a log's meter; None where the log has none."""
        meter = log.meter
        if meter is None or not len(log):
            return None
        return per_log(log, "readings", lambda: cls.through(log, meter, cls.taken_in(log)))

    @classmethod
    def through(cls, log: Telemetry, meter: Meter, taken: Integers) -> Readings:
        """The operator of a meter on rows that may have another one.

        ``taken`` is what ``taken_in`` gave for a meter of the same sampling and period.
        """
        count = len(log)
        interval = np.where(log.interval > 0.0, log.interval, 1.0)
        middle = log.time - 0.5 * interval
        at = middle - meter.delay_s + (0.0 if meter.sampling == "mean" else 0.5 * interval)
        low, share = np.arange(count), np.zeros(count)
        begins = np.zeros(count, np.bool_)
        step = interval.copy()
        for start, stop in log.segments():
            begins[start] = True
            step[start + 1 : stop] = np.diff(middle[start:stop])
            if stop - start > 1:
                place = np.interp(at[start:stop], middle[start:stop], np.arange(start, stop))
                low[start:stop] = np.minimum(place.astype(np.int64), stop - 2)
                share[start:stop] = place - low[start:stop]
        step = np.maximum(step, 1e-9)
        keep, ramp = np.zeros(count), np.zeros(count)
        tau, even = meter.time_constant_s, meter.sampling == "window"
        if tau > 0.0 and not even:
            keep, ramp = np.exp(-step / tau), tau / step * -np.expm1(-step / tau)
        now = np.where(begins, 1.0 - keep, 1.0 - ramp)
        before = np.where(begins, 0.0, ramp - keep)
        carried, window = np.zeros(count), None
        _carry(keep, begins, log.power, carried)
        if tau > 0.0 and even:
            window = _Window.of(log, middle, tau)
            first = np.maximum.accumulate(np.where(begins, np.arange(count), 0))
            carried = window.missing * log.power[first]
        return cls(low, share, keep, before, now, begins, taken, carried[taken], window)

    @staticmethod
    def taken_in(log: Telemetry) -> Integers:
        """(n,) the row in which the log's meter took each row's reading."""
        meter = log.meter
        if meter is None or meter.sampling != "held":
            return np.arange(len(log))
        return per_log(log, "taken", lambda: held_rows(log, meter.period_s))

    @classmethod
    def as_shown(cls, log: Telemetry, columns: Array) -> Array:
        """Columns of power (n, m) as the log's meter shows them."""
        readings = cls.of(log)
        return columns if readings is None else readings.change(columns)

    def change(self, columns: Array) -> Array:
        """(n, m) columns of power as the meter shows them, from (n, m)."""
        shown = np.empty(columns.shape)
        _filter(np.ascontiguousarray(columns), *self[:6], shown)
        if self.window is not None:
            return self.window.mean(shown)
        return shown[self.held] if np.any(np.diff(self.held) != 1) else shown

    def shown(self, watts: Array) -> Array:
        """(n,) W that the meter shows of a power (n,) W."""
        return self.change(watts[:, None])[:, 0] + self.carried


@njit(cache=True, nogil=True)
def _filter(
    columns: Any, low: Any, share: Any, keep: Any, before: Any, now: Any, begins: Any, shown: Any
) -> None:
    rows, count = columns.shape
    last = np.zeros(count)
    for k in range(rows):
        at, part = low[k], share[k]
        for j in range(count):
            here = columns[at, j]
            if part > 0.0:
                here += part * (columns[at + 1, j] - here)
            shown[k, j] = now[k] * here
            if not begins[k]:
                shown[k, j] += keep[k] * shown[k - 1, j] + before[k] * last[j]
            last[j] = here


@njit(cache=True, nogil=True)
def _carry(keep: Any, begins: Any, power: Any, carried: Any) -> None:
    for k in range(len(keep)):
        carried[k] = keep[k] * (power[k] if begins[k] else carried[k - 1])


def meter_columns(log: Telemetry, watts: Array) -> Array:
    """Derivatives of the readings by the meter's fitted numbers.

    Args:
        log: the rows, with their meter.
        watts: (n,) W at the supply, before the meter.

    Returns:
        (n, k) W/s; k is 0 without a meter, and a time constant of zero has no column.
    """
    meter = log.meter
    if meter is None or not len(log):
        return np.empty((len(log), 0))
    interval = float(np.median(log.interval))
    taken = Readings.taken_in(log)

    def slope(name: str, value: float, step: float) -> Array:
        shown = []
        for end in (value - step, value + step):
            readings = Readings.through(log, meter.with_number(name, end), taken)
            shown.append(readings.shown(watts))
        return (shown[1] - shown[0]) / (2.0 * step)

    columns = []
    if (tau := meter.time_constant_s) > 0.0:
        columns.append(slope("time_constant_s", tau, STEP_SHARE * tau))
    columns.append(slope("delay_s", meter.delay_s, STEP_SHARE * interval))
    return np.column_stack(columns)
