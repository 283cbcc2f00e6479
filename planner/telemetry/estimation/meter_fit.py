"""The meter of a log, estimated beside a model: time constant, delay and sampling moment.

    log = with_meter(log, model, places)       # the same rows with their meter, or as they were

A meter that averages, or whose reading comes late, is linear in the power. So the model's tangent
goes through the same meter as its power, and its parameters take at every trial of the meter what
they can (variable projection: Golub & Pereyra, SIAM Journal on Numerical Analysis 10(2), 1973).

No meter is the null hypothesis: its time constant and delay are zero, so the hypotheses are nested.
Both have noise of any autocorrelation (planner.telemetry.noise.row_likelihood). A meter is believed
where it makes the log much likelier, in most of its clusters, and not by smoothing alone: noise of
the speeds asks for that too, but symmetrically. A meter's readings come late. A filter averages
what was before a reading, which is taken by the end of its row: there its delay is bounded. Without
a filter a reading may lead, as the motion's own stamps may be late.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from planner.arrays import Array, Integers
from planner.power.model import PowerModel
from planner.telemetry.logs import Meter, Telemetry
from planner.telemetry.noise import noise_of, row_likelihood
from planner.telemetry.prediction import (
    Nodes,
    Readings,
    input_uncertainty,
    periods_of,
    tangent,
)
from planner.telemetry.sampling import cluster_numbers

LEAST_GAIN = 12.0
"""Log-likelihood by which a meter must lead none: e^12 to one against it."""
LEAST_METER_Z = 3.84
"""Standard errors over clusters of that lead."""
FILTER_GAIN = 6.0
"""Log-likelihood by which a filter must lead a plain delay."""
LEAST_LAG_ROWS = 0.3
"""Rows by which readings must be late or early; less is what rows average over."""
LEAST_START = 0.5
"""Rows of the least time constant and delay where the search begins."""
NEXT_FILTER, NEXT_DELAY = 2.0, math.sqrt(2.0)
"""Factors from each of them to the next: the peak over a time constant is wider."""
LONGEST_START, LONGEST_LEAD, START_ROWS = 3.0, 0.5, 8.0
"""s; the search begins at time constants and delays up to the first or START_ROWS, and at leads up
to the second or a row."""
LONGEST_STEP = 0.1
"""s between next delays, or half a row: a peak is as wide as what the robot does at a time."""
LEAST_DELAY = 0.06
"""s; a smaller delay without a filter is what derivatives and slipping wheels blur."""
END_ROWS = 0.5
"""Rows by which readings of a row's end lead its mean."""
SHIFTED_ROWS, SHIFTED_SHARE = 0.5, 0.1
"""Rows and share of a time constant that noise of the motion, errors of the data sheet and effects
that are not in the model shift it by: more than the error by the power's noise alone. How often the
truth is held with them is in docs/naming.md."""
NEAR_GAIN = 6.0
"""Log-likelihood that a search may still gain over where it begins."""
FIRST_STEP, ERROR_STEP = 0.3, 0.1
"""Rows, or logarithms of the time constant: first steps of a search, and of a derivative. The first
step of a delay above a row is that share of it, up to LONGEST_STEP."""
TIME_CONSTANT, DELAY = BOTH = "time_constant_s", "delay_s"
"""Numbers of a meter that are fitted."""
USUAL_LAGS, USUAL_FILTERS = (-0.5, 0.0, 0.5, 1.0), (0.0, 0.05, 0.2, 0.8)
"""Rows by which readings are late, and s of their filters, of the meters beside which motions are
compared."""
COMPARED_ROWS = 4000
"""Rows that motions are compared on: many times those that distinguish them."""
LEAST_METER_ROWS = 100
"""Rows below which a log does not identify its meter."""


@dataclass(frozen=True)
class _Search:
    """Likelihood of a log as a function of its meter.

    ``together`` is (n, 1 + m): W of the model at the supply, and its columns; ``taken`` is
    what Readings.taken_in gave, by sampling and period, and ``scored`` what ``score`` gave.
    """

    log: Telemetry
    together: Array
    spread: Array
    clusters: Integers
    interval: float
    taken: dict[tuple[str, float], Integers] = field(default_factory=dict)
    scored: dict[Meter, float] = field(default_factory=dict)

    @classmethod
    def beside(
        cls, log: Telemetry, model: PowerModel, places: Sequence[int], further: Array | None = None
    ) -> _Search:
        """The search beside a model, its parameters ``places`` and (n, m) W per unit further."""
        watts, columns = tangent(model, Nodes.of(log, model), places)
        if further is not None:
            columns = np.column_stack([columns, further])
        input_error = input_uncertainty(model, log.rows_for(model.surfaces))
        noise, _ = noise_of(log, log.power - watts, watts, input_error, columns)
        spread = noise.spread(watts, input_error)
        together = np.column_stack([watts, columns])
        return cls(log, together, spread, cluster_numbers(log), float(np.median(log.interval)))

    def kinds(self) -> list[Meter]:
        """Meters without filter or delay: that of the rows, and those that hold a reading."""
        held = (Meter(sampling="held", period_s=period) for period in periods_of(self.log))
        return [Meter(), *held]

    def usual_meters(self) -> list[Meter]:
        """Some of every kind, with and without a filter, at USUAL_LAGS."""
        return [
            replace(kind, time_constant_s=seconds, delay_s=rows * self.interval)
            for kind in self.kinds()
            for seconds in USUAL_FILTERS
            for rows in USUAL_LAGS
        ]

    def rows(self, meter: Meter | None) -> Array:
        """(n,) log-likelihood of every row."""
        shown, carried = self.together, np.zeros(len(self.log))
        if meter is not None:
            kind = meter.sampling, meter.period_s
            if kind not in self.taken:
                self.taken[kind] = Readings.taken_in(replace(self.log, meter=meter))
            readings = Readings.through(self.log, meter, self.taken[kind])
            shown, carried = readings.change(shown), readings.carried
        watts = shown[:, 0] + carried
        residual = self.log.power - watts
        return row_likelihood(self.log, residual, watts, self.spread, shown[:, 1:])

    def score(self, meter: Meter) -> float:
        """Log-likelihood of the log; where searches begin is asked for again."""
        if meter not in self.scored:
            self.scored[meter] = float(self.rows(meter).sum())
        return self.scored[meter]

    def best(self, starts: Sequence[Meter], *names: str) -> tuple[Meter, float]:
        """The likeliest meter near the likeliest of some, and its log-likelihood.

        Args:
            starts: where the search may begin.
            names: numbers of the meter that are free.
        """
        start = max(starts, key=self.score)
        begin = np.array([self._coordinate(name, getattr(start, name)) for name in names])
        causal = TIME_CONSTANT in names
        low = [_earliest(start) if causal and name == DELAY else -np.inf for name in names]

        def at(x: Array) -> Meter:
            return self._at(start, names, np.maximum(x, low))

        def cost(x: Array) -> float:
            return -self.score(at(x))

        far = max(LONGEST_STEP / (FIRST_STEP * self.interval), 1.0)
        sizes = [
            min(max(abs(x), 1.0), far) if name == DELAY else 1.0
            for name, x in zip(names, begin, strict=True)
        ]
        simplex = begin + FIRST_STEP * np.vstack([np.zeros(len(begin)), np.diag(sizes)])
        options: Any = {"xatol": 0.01, "fatol": 0.05, "maxfev": 60, "initial_simplex": simplex}
        found = minimize(cost, begin, method="Nelder-Mead", options=options)
        return at(found.x), -float(found.fun)

    def _coordinate(self, name: str, value: float) -> float:
        # In rows; a time constant, which stays positive, as its logarithm.
        rows = value / self.interval
        return float(np.log(rows)) if name == TIME_CONSTANT else rows

    def _at(self, meter: Meter, names: Sequence[str], x: Array) -> Meter:
        for name, place in zip(names, x, strict=True):
            rows = np.exp(place) if name == TIME_CONSTANT else place
            meter = meter.with_number(
                name, float(np.clip(rows * self.interval, -Meter.LONGEST_LAG, Meter.LONGEST_LAG))
            )
        return meter

    def errors(self, meter: Meter, *names: str) -> Array:
        """(k,) standard errors: curvature of the likelihood, or scatter over clusters if wider."""
        value = np.array([self._coordinate(name, getattr(meter, name)) for name in names])
        count, steps = len(names), np.full(len(names), ERROR_STEP)

        def at(x: Array) -> Array:
            return self.rows(self._at(meter, names, x))

        middle = float(at(value).sum())
        ends = [(at(value - step), at(value + step)) for step in np.diag(steps)]
        curvature = np.diag([2.0 * middle - float((a + b).sum()) for a, b in ends])
        if count == 2:
            both = 2.0 * middle - float((at(value + steps) + at(value - steps)).sum())
            mixed = 0.5 * (both - float(np.trace(curvature)))
            # Rounding and kinks must leave a positive matrix.
            most = 0.99 * np.sqrt(max(curvature[0, 0] * curvature[1, 1], 0.0))
            curvature[0, 1] = curvature[1, 0] = np.clip(mixed, -most, most)
        curvature[np.diag_indices(count)] = np.maximum(np.diag(curvature), 1e-9)
        inverse = np.linalg.inv(curvature / np.outer(steps, steps))
        slopes = [(b - a) / (2.0 * step) for (a, b), step in zip(ends, steps, strict=True)]
        by_cluster = np.stack([np.bincount(self.clusters, one) for one in slopes])
        sandwich = inverse @ (by_cluster @ by_cluster.T) @ inverse
        errors = np.sqrt(np.maximum(np.diag(inverse), np.diag(sandwich)))
        sizes = [meter.time_constant_s if n == TIME_CONSTANT else self.interval for n in names]
        return np.asarray(errors * sizes)


def _earliest(meter: Meter) -> float:
    """Rows; the least delay of a filter that does not foresee the power of later rows."""
    return -END_ROWS if meter.sampling == "mean" else 0.0


def with_meter(
    log: Telemetry,
    model: PowerModel,
    places: Sequence[int],
    beside: Array | None = None,
    *,
    filtering: bool = True,
) -> Telemetry:
    """The log with the meter that its power was read from.

    Args:
        log: the rows; their meter is estimated anew. One that averages evenly may do so again.
        model: around which the power is linear.
        places: numbers of its parameters that may take what they can.
        beside: (n, m) W per unit, columns of effects that may be missing.
        filtering: whether it may be a filter; otherwise it has a delay or a moment alone.

    Returns:
        The log; without a meter where it does not clearly show one.
    """
    evenly = log.meter is not None and log.meter.sampling == "window"
    log = replace(log, meter=None)
    # A constant power shows no motion, late or averaged: the longest filter would fit it best.
    lone = len(log) and float(np.median(log.interval)) <= 0.0  # most rows are alone in their runs
    if len(log) < LEAST_METER_ROWS or lone or not np.ptp(log.power):
        return log
    search = _Search.beside(log, model, places, beside)
    return replace(log, meter=_believed(search, filtering, evenly))


def likelihoods(
    readings: Sequence[Telemetry], model: PowerModel, places: Sequence[int]
) -> list[float]:
    """Log-likelihood of the power by readings of the same rows, each beside its likeliest meter.

    Args:
        readings: the rows with one motion each; the first says how the power scatters.
        model: around which the power is linear.
        places: numbers of its parameters that may take what they can.

    Returns:
        One for each of them; 0 for all of a log that is too short or never varies.
    """
    log = readings[0].take(slice(0, COMPARED_ROWS))
    if len(log) < LEAST_METER_ROWS or not np.ptp(log.power):
        return [0.0] * len(readings)
    first = _Search.beside(replace(log, meter=None), model, places)
    meters, found = first.usual_meters(), []
    for reading in readings:
        one = replace(reading.take(slice(0, COMPARED_ROWS)), meter=None)
        search = replace(_Search.beside(one, model, places), spread=first.spread)
        found.append(max(map(search.score, meters)))
    return found


def _starts(interval: float, longest: float, factor: float, step: float = math.inf) -> list[float]:
    """s up to ``longest``, each that factor and at most a step from the last."""
    starts = [min(LEAST_START * interval, Meter.LONGEST_LAG)]
    while (following := min(factor * starts[-1], starts[-1] + step)) <= longest:
        starts.append(following)
    return starts


def _delays(interval: float, longest: float) -> list[float]:
    return _starts(interval, longest, NEXT_DELAY, max(LONGEST_STEP, 0.5 * interval))


def _likeliest_delay(search: _Search, late: Sequence[float]) -> tuple[Meter, float]:
    """The likeliest meter without a filter, and its log-likelihood; ``late`` (s) are its starts.

    Each kind is searched by itself: the best start of one may hide a sharp peak of another.
    """
    row = search.interval
    early = [-lag for lag in _delays(row, max(LONGEST_LEAD, row))]
    found = [search.best([Meter(delay_s=lag) for lag in (*early, *late)], DELAY)]
    middle = found[0][0].delay_s
    for kind in search.kinds()[1:]:
        # What is held is later by half of its period.
        near = (0.0, -row, -0.5 * row, middle, middle - 0.5 * kind.period_s)
        lags = (*near, *_starts(row, START_ROWS * row, NEXT_FILTER))
        found.append(search.best([replace(kind, delay_s=lag) for lag in lags], DELAY))
    return max(found, key=lambda one: one[1])


def _believed(search: _Search, filtering: bool, evenly: bool) -> Meter | None:
    interval = search.interval
    nothing = search.rows(None)
    longest = min(max(LONGEST_START, START_ROWS * interval), Meter.LONGEST_LAG)
    late = _delays(interval, longest)
    filters = [
        replace(kind, time_constant_s=lag)
        for kind in ([Meter(sampling="window")] if evenly else search.kinds())
        for lag in _starts(interval, longest, NEXT_FILTER)
        if filtering
    ]
    plain, plain_score = _likeliest_delay(search, late)
    least = float(nothing.sum()) + LEAST_GAIN
    if max([plain_score, *map(search.score, filters)]) < least - NEAR_GAIN:
        return None
    lagging, meter, score = False, plain, plain_score
    if filtering:
        after_plain = [] if evenly else [replace(plain, time_constant_s=interval)]
        first = max((*filters, *after_plain), key=search.score)
        later = [replace(first, delay_s=lag) for lag in late]
        meter, score = search.best([first, *later], *BOTH)
        lagging = meter.time_constant_s + meter.delay_s > LEAST_LAG_ROWS * interval
    if lagging and score - plain_score > FILTER_GAIN:
        found = _at_known_moment(search, meter, *BOTH)
    else:
        found = _at_known_moment(search, plain, DELAY)
        if found.sampling == "mean" and abs(found.delay_s) < LEAST_DELAY:
            return None
    gain = np.bincount(search.clusters, search.rows(found) - nothing)
    scatter = float(gain.std()) * np.sqrt(len(gain)) + 1e-12
    return found if gain.sum() > max(LEAST_GAIN, LEAST_METER_Z * scatter) else None


def _at_known_moment(search: _Search, meter: Meter, *free: str) -> Meter:
    """The meter with its errors, read at the mean or the end of a row where it nearly is.

    Between rows the power is not known, and a filter can trade some of its length for a delay. So
    what lies near one of the two moments is taken to be there.
    """
    if TIME_CONSTANT in free and meter.delay_s <= _earliest(meter) * search.interval:
        # A delay at its bound was not fitted.
        free = (TIME_CONSTANT,)
    errors = {DELAY: 0.0, **dict(zip(free, search.errors(meter, *free), strict=True))}
    early = -meter.delay_s / search.interval
    if meter.sampling == "mean" and early > LEAST_LAG_ROWS:
        meter = replace(meter, sampling="end", delay_s=meter.delay_s + END_ROWS * search.interval)
    rest = abs(meter.delay_s)
    if meter.sampling != "held" and rest <= LEAST_LAG_ROWS * search.interval:
        meter = replace(meter, delay_s=0.0)
        if TIME_CONSTANT in free:
            meter, _ = search.best([meter], TIME_CONSTANT)
            errors[TIME_CONSTANT] = np.hypot(search.errors(meter, TIME_CONSTANT)[0], 0.5 * rest)
        errors[DELAY] = np.hypot(errors[DELAY], 0.5 * rest)
    return replace(
        meter,
        time_constant_error_s=float(errors.get(TIME_CONSTANT, 0.0)),
        time_constant_shift_s=math.hypot(
            SHIFTED_ROWS * search.interval, SHIFTED_SHARE * meter.time_constant_s
        )
        if TIME_CONSTANT in free
        else 0.0,
        delay_error_s=float(errors[DELAY]),
    )
