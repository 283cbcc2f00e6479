"""The rows in which a slow meter took its readings: from equal readings, or from their period.

    held_rows(log)                    # (n,) row of each reading, where equal readings follow
    held_rows(log, period=0.4)        # the same, where a meter reads every 0.4 s and rows scatter
    periods_of(log)                   # s, periods that the changes of the power suggest

A meter that is slower than the log holds its reading. Noise between meter and log, as on an analog
output, makes rows differ all the same. But the power then changes most at a regular moment. The
changes of a run, squared, have a peak in their spectrum at the frequency of the readings. Phases
belong to each run: a log's time may begin anew.

Rounding makes equal readings, too: where the power changes by less than a digit, and at no regular
moment. Steps are then mostly of one digit.
"""

from __future__ import annotations

import numpy as np

from planner.arrays import Array, Integers
from planner.telemetry.logs import Telemetry, pieces_of

SHORTEST_HOLD, LONGEST_HOLD = 1.8, 8.0
"""Rows that a regular reading may last; over longer times drives repeat themselves as well."""
HELD_SHARE = 0.3
"""Share of rows with the reading of the row before from which a meter may hold its readings."""
BINS = 4
"""Bins of a row's interval, for the spectrum."""
LEAST_POWER = 3.0
"""Peak of the spectrum over that of changes in any order, from which a period is tried."""
OWN_PHASE = 6.0
"""The same of a single run, from which its own phase is known: e^-6 by chance."""
NEAR_PEAK = 41
"""Frequencies around a peak that are tried."""
CUT_QUANTILE = 0.9
"""Quantile at which squared changes are cut, so that no few steps decide."""
SLOW_ROWS = 15
"""Rows of the mean that is taken off: changes are larger while a robot speeds up."""
MOST_MULTIPLE = 8
"""A peak may be a harmonic: its period, and this many times it at most, are tried."""
LEAST_RUN = 20
"""Rows of a run whose changes count."""
MOST_INTERVALS = 100_000
"""Rows' intervals of a run that the spectrum is taken of: a gap of days would fill the memory."""
ONE_DIGIT = 1.5
"""Digits up to which a change is one of a single digit."""


def held_rows(log: Telemetry, period: float = 0.0) -> Integers:
    """(n,) the row in which each row's reading was taken.

    Args:
        log: the rows.
        period: s between readings; 0 takes a reading that equals the one before for the same.
    """
    new = np.ones(len(log), np.bool_)
    if period > 0.0:
        number = np.floor(_moment(log, period))
        new[1:] = np.diff(number) != 0.0
    else:
        new[1:] = np.diff(log.power) != 0.0
    new[[start for start, _ in log.segments()]] = True
    return np.asarray(np.maximum.accumulate(np.where(new, np.arange(len(log)), 0)))


def is_rounded(log: Telemetry) -> bool:
    """Whether equal readings come from rounding: most changes are of one digit."""
    steps = np.abs(np.diff(log.power))
    steps = steps[steps > 0.0]
    return len(steps) == 0 or float(np.median(steps)) <= ONE_DIGIT * float(steps.min())


def periods_of(log: Telemetry) -> tuple[float, ...]:
    """s, what may be the period of a meter's readings; 0 for equal readings that are held."""
    repeated = 1.0 - len(np.unique(held_rows(log))) / max(len(log), 1)
    equal = (0.0,) if repeated > HELD_SHARE and not is_rounded(log) else ()
    return *_regular(log), *equal


def _regular(log: Telemetry) -> tuple[float, ...]:
    """s, periods at which the power changes; () where nothing is regular."""
    interval = float(np.median(log.interval)) if len(log) else 0.0
    ends = [
        (
            start,
            start + int((log.time[start:stop] - log.time[start] < MOST_INTERVALS * interval).sum()),
        )
        for start, stop in pieces_of(log.run)
    ]
    runs = [(start, stop) for start, stop in ends if stop - start >= LEAST_RUN]
    if not runs:
        return ()
    step = interval / BINS
    longest = max(log.time[stop - 1] - log.time[start] for start, stop in runs)
    count = 1 << int(np.ceil(np.log2(2.0 * longest / step + 2.0)))
    total, chance = np.zeros(count // 2 + 1), 1e-300
    changes = [(log.time[start:stop], _changes(log, start, stop)) for start, stop in runs]
    for time, change in changes:
        place = np.rint((time - time[0]) / step).astype(np.int64)
        line = np.bincount(np.clip(place, 0, count - 1), change, minlength=count)
        total += np.abs(np.fft.rfft(line)) ** 2
        chance += float(change @ change)
    frequency = np.fft.rfftfreq(count, step) * interval
    inside = np.flatnonzero((frequency > 1.0 / LONGEST_HOLD) & (frequency < 1.0 / SHORTEST_HOLD))
    if not len(inside):
        return ()
    peak = inside[np.argmax(total[inside])]
    if total[peak] < LEAST_POWER * chance:
        return ()
    # Over a long run a small error of the period adds up.
    near = (peak + np.linspace(-1.0, 1.0, NEAR_PEAK)) / (count * step)
    fine = near[np.argmax([_power(changes, each) for each in near])]
    periods = np.arange(1, MOST_MULTIPLE + 1) / fine
    return tuple(
        float(p)
        for p in periods
        # All harmonics of a long hold are peaks, the first one too.
        if p <= LONGEST_HOLD * interval or _power(changes, 1.0 / p) > LEAST_POWER * chance
    )


def _power(changes: list[tuple[Array, Array]], frequency: float) -> float:
    """W⁴, of the changes of runs, (m,) s and (m,) W² each, at a frequency in Hz."""
    total = 0.0
    for time, change in changes:
        total += abs(complex(change @ np.exp(2j * np.pi * frequency * time))) ** 2
    return total


def _changes(log: Telemetry, start: int, stop: int) -> Array:
    """(m,) W², squared changes from row to row of a run, without large ones and slow parts."""
    square = np.zeros(stop - start)
    square[1:] = np.diff(log.power[start:stop]) ** 2
    square = np.minimum(square, np.quantile(square[1:], CUT_QUANTILE))
    window = np.ones(SLOW_ROWS)
    slow = np.convolve(square, window, "same") / np.convolve(np.ones(len(square)), window, "same")
    change = square - slow
    change[0] = 0.0
    return np.asarray(change)


def _moment(log: Telemetry, period: float) -> Array:
    """(n,) periods since a reading; a new one begins at each whole number."""
    turns = log.time / period
    row = float(np.median(log.interval)) / period if len(log) else 0.0
    own: list[tuple[slice, complex, float | None]] = []
    for start, stop in pieces_of(log.run):
        rows, together, begins = slice(start, stop), 0j, None
        if stop - start >= LEAST_RUN:
            change = _changes(log, start, stop)
            together = complex(change @ np.exp(2j * np.pi * turns[rows]))
            if abs(together) ** 2 > OWN_PHASE * float(change @ change):
                begins = _begin(turns[rows], change, _turn(together) - 0.5 * row, row)
        own.append((rows, together, begins))
    usual = _turn(sum((together for _, together, _ in own), 0j)) - 0.5 * row
    moment = np.empty(len(log))
    for rows, _, begins in own:
        moment[rows] = turns[rows] - (usual if begins is None else begins)
    return moment


def _turn(together: complex) -> float:
    return float(np.angle(together)) / (2.0 * np.pi)


def _begin(turns: Array, change: Array, about: float, row: float) -> float:
    """Where periods begin, near ``about``, so that new readings have the largest changes.

    A few large changes shift the phase of one frequency by a row.

    Args:
        turns: (m,) time of each row in periods.
        change: (m,) W², as of _changes.
        about, row: periods; ``row`` is what a row lasts.
    """
    near = about + row * np.arange(-2 * BINS, 2 * BINS + 1) / BINS
    sums = [float(change[1:][np.diff(np.floor(turns - each)) != 0.0].sum()) for each in near]
    return float(near[np.isclose(sums, max(sums))].mean())
