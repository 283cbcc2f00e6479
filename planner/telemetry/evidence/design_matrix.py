"""The design matrix: columns of everything that may explain a residual, and their testability.

    columns = DesignColumns(library, dictionary)          # which column is what
    examination = examine(log, columns)                   # a sample in memory
    examination.evidence                                  # statistics for all tests
    examination.testable["air_drag"]                      # None, or why it is not identifiable

The order of the columns: Jacobian of the model and of the log's meter, usual errors of data sheet
and sensors, candidates of the catalogue, errors of sensors, shapes, residual. All are as the meter
shows them. Residuals count at most a few spreads (planner.telemetry.noise).

An effect is not identifiable where less than 0.2 % of a column survives refitting the model; where
what survives is no larger than the sensors' own errors; or where it would have to exceed a tenth of
the mean power to be noticed. That is settled before anything is ranked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.arrays import Array, Integers
from planner.quantities import INDEX
from planner.telemetry.evidence.evidence import Evidence
from planner.telemetry.evidence.gram_matrices import RowClusters
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import Noise, clipped, noise_of, strongest_columns
from planner.telemetry.other_terms import (
    GIVEN,
    SENSORS,
    Dictionary,
    Sensor,
    given_columns,
)
from planner.telemetry.prediction import (
    Nodes,
    Readings,
    input_uncertainty,
    meter_columns,
    predict,
)
from planner.telemetry.sampling import cluster_numbers, stretches
from planner.telemetry.terms import CandidateLibrary, Term

LEAST_TOLERANCE = 2e-3
"""Share of a column's squares that must survive refitting the model, or it is not identifiable."""
LEAST_OVER_SENSOR_ERROR = 2.0
"""Squares that survive over those that sensors' usual errors make in single rows. Thousands of rows
show a smaller signal, but what such errors make of a column then looks like the effect."""
KNOWN_EFFECT_SHARE = 0.25
"""Share of both thresholds that suffices for an effect that an earlier round found testable."""
LARGEST_UNNOTICED = 0.10
"""Share of the mean power; an effect that could be larger without being noticed is not testable."""
REPORTED_UNNOTICED = 0.01
"""Share of the mean power; an effect that could be larger unnoticed is reported as such."""
DETECTION_Z = 3.84
"""Standard errors from which an effect counts as noticed."""
PROBE_ROWS = 3000
"""Rows on which disturbed inputs are compared with the logged ones."""

SENSOR_ERRORS: dict[str, tuple[float, float]] = {
    **dict.fromkeys(("vx", "vy"), (0.002, 0.005)),
    "wz": (0.003, 0.005),
    **dict.fromkeys(("ax", "ay"), (0.01, 0.0)),
    **dict.fromkeys(("gravity_x", "gravity_y"), (0.017, 0.0)),
    **dict.fromkeys(("motor_temp", "ambient_temp"), (0.5, 0.0)),
    "battery_voltage": (0.02, 0.0),
    "slope_rate": (0.003, 0.0),
    **dict.fromkeys(("wind_x", "wind_y"), (0.1, 0.0)),
}
"""Usual errors of single rows, SI and relative (odometry, 0.1° of slope, MEMS accelerometers)."""
SPEED_OF = {"vx": "vx", "vy": "vy", "wz": "wz", "ax": "vx", "ay": "vy"}
"""What is averaged where it is steady, by what that leaves no error of (steady_drive)."""


@dataclass(frozen=True)
class DesignColumns:
    """Which column is what.

    Attributes:
        library: the model and the catalogue's candidates.
        dictionary: shapes over the axes of motion.
        sensors: errors of sensors that compete.
        exact: take the inputs for exact: a column that their errors would drown counts as well.
        testable_before: effects that an earlier round could tell and chose, or found tied with its
            choice. Around another model they stay in the race with smaller margins.
        meter_numbers: fitted numbers of the log's meter; their columns stand beside the model's.
        even_w: how the base model was fitted, as in Noise; so are all others.
    """

    library: CandidateLibrary
    dictionary: Dictionary
    sensors: tuple[Sensor, ...] = tuple(SENSORS.values())
    exact: bool = False
    testable_before: frozenset[str] = frozenset()
    meter_numbers: int = 0
    even_w: float = 0.0

    @property
    def tangent(self) -> int:
        """Number of the columns of the model, of the meter and of the usual errors."""
        return self.first_given + GIVEN.total

    @property
    def first_given(self) -> int:
        """Column of the first usual error of data sheet and sensors."""
        return len(self.library.places) + self.meter_numbers

    def candidate(self, number: int) -> int:
        """Column of a candidate of the library."""
        return self.tangent + number

    def sensor(self, number: int) -> int:
        """Column of a sensor's error."""
        return self.tangent + len(self.library.candidates) + number

    @property
    def first_shape(self) -> int:
        """Column of the first shape."""
        return self.tangent + len(self.library.candidates) + len(self.sensors)

    @property
    def residual(self) -> int:
        """Column of the residual, the last one."""
        return self.first_shape + len(self.dictionary.shapes)

    @property
    def usual(self) -> slice:
        """Columns of usual errors of data sheet and sensors."""
        return slice(self.first_given, self.tangent)

    @property
    def known(self) -> Array:
        """(columns,) what is known of each coefficient before the log, one over its variance."""
        known = np.zeros(self.residual + 1)
        known[self.usual] = 1.0
        return known

    def with_known(
        self, white: Array, numbers: Integers, runs: Integers
    ) -> tuple[Array, Integers, Integers]:
        """Whitened rows, and a cluster of rows that say what is known before the log.

        Args:
            white: (n, columns).
            numbers, runs: (n,) of cluster and run.
        """
        rows = np.diag(self.known)[self.usual]
        more = np.full(len(rows), 1, np.int64)
        return (
            np.concatenate([white, rows]),
            np.concatenate([numbers, (numbers[-1] + 1) * more]),
            np.concatenate([runs, runs[-1] * more]),
        )

    def raw(self, log: Telemetry) -> tuple[Array, Array]:
        """(n,) W of the model and (n, columns) W per unit, the residual last."""
        model = self.library.held_model
        rows = log.rows_for(model.surfaces)
        nodes = Nodes.of(log, model)
        watts, tangent, candidates = self.library.columns(nodes)
        sensors = [sensor.column(log, model, watts) for sensor in self.sensors]
        shapes = Readings.as_shown(log, self.dictionary.columns(rows))
        if self.meter_numbers:
            # Rows that no meter has shown, of a drive that is only thought of, know nothing of it.
            meter = np.zeros((len(log), self.meter_numbers))
            if log.meter is not None:
                meter[:] = meter_columns(log, predict(model, nodes.unmetered()))
            tangent = np.column_stack([tangent, meter])
        given = given_columns(log, model, watts)
        # What is held counts as not explained yet: its columns compete with all others for it.
        held = list(self.library.held)
        residual = log.power - watts + candidates[:, held] @ self.library.amplitudes[held]
        return watts, np.column_stack([tangent, given, candidates, *sensors, shapes, residual])


@dataclass(frozen=True)
class Examination:
    """The design matrix of a log around one model, and its statistics.

    Attributes:
        competitors: which column is what.
        evidence: sufficient statistics of the whitened columns.
        noise: what was taken for noise.
        watts: (n,) W of the model for the sample.
        spread: (n,) W, standard deviation of single rows.
        raw: (n, columns) of the sample, the residual clipped.
        residual: (n,) W, measured less modelled, as it is.
        testable: slug → None, or why it is not identifiable from this log.
        unnoticed: slug → W, rms, up to which an identifiable effect would go unnoticed.
        terms: the identifiable forms of effects.
        shapes: numbers of the identifiable shapes.
        mean_watts: mean of |P|, W.
    """

    competitors: DesignColumns
    evidence: Evidence
    noise: Noise
    watts: Array
    spread: Array
    raw: Array
    residual: Array
    testable: dict[str, str | None]
    unnoticed: dict[str, float]
    terms: tuple[Term, ...]
    shapes: tuple[int, ...]
    mean_watts: float

    @cached_property
    def exact(self) -> Evidence:
        """The evidence where data sheet and sensors are taken for exact."""
        known = self.evidence
        first = self.competitors.first_given
        return Evidence(first, known.clusters, known.plain, known.rows, known.slow)

    @property
    def given(self) -> Array:
        """(n, k) W of the sample, by usual errors of data sheet and sensors."""
        return self.raw[:, self.competitors.usual]

    def barely_testable(self, slug: str) -> str | None:
        """A sentence on an identifiable effect of which much would go unnoticed, else None."""
        watts = self.unnoticed.get(slug, 0.0)
        return _unnoticed(watts, self) if watts > REPORTED_UNNOTICED * self.mean_watts else None


def examine(
    log: Telemetry, competitors: DesignColumns, explained: tuple[int, ...] | None = None
) -> Examination:
    """The design matrix of a log in memory, with its statistics and what is identifiable.

    Args:
        log: the rows.
        competitors: which columns.
        explained: columns that the noise is estimated after; None finds up to four itself.
    """
    watts, raw = competitors.raw(log)
    residual = raw[:, -1].copy()
    own = raw[:, : competitors.tangent]
    helpers = _helpers(watts, raw, competitors.tangent) if explained is None else list(explained)
    model = competitors.library.held_model
    input_error = input_uncertainty(model, log.rows_for(model.surfaces))
    noise, left = noise_of(
        log, residual, watts, input_error, np.column_stack([own, raw[:, helpers]])
    )
    noise = replace(noise, even_w=competitors.even_w)
    spread = noise.spread(watts, input_error)
    raw[:, -1] = residual - left + clipped(left, spread)
    white = noise.whiten(log, watts, spread, raw)
    scaled = raw / spread[:, None]
    clusters = RowClusters(*competitors.with_known(white, cluster_numbers(log), log.run))
    slow = _slow_shares(log, raw)
    plain_sums = scaled.T @ scaled + np.diag(competitors.known)
    evidence = Evidence(competitors.tangent, clusters, plain_sums, len(log), slow)
    mean = float(np.mean(np.abs(watts)))
    plain = Examination(
        competitors, evidence, noise, watts, spread, raw, residual, {}, {}, (), (), mean
    )
    return _with_testable(log, plain)


def _helpers(watts: Array, raw: Array, tangent: int) -> list[int]:
    """Columns that explain most of the residual, rows weighted: noise must not contain effects."""
    size = np.abs(watts)
    weighted = raw / np.maximum(size, 0.3 * float(np.mean(size)) + 1e-9)[:, None]
    own, others, residual = weighted[:, :tangent], weighted[:, tangent:-1], weighted[:, -1]
    centred = np.abs(residual - np.median(residual))
    limit = 5.0 * 1.4826 * float(np.median(centred)) + 1e-12
    chosen = strongest_columns(np.clip(residual, -limit, limit), own, others)
    return [tangent + k for k in chosen]


def _slow_shares(log: Telemetry, raw: Array) -> Array:
    """Share of every column's variance that is a run's mean or a slow drift within it."""
    slow = np.zeros(raw.shape[1])
    for start, stop in log.run_pieces():
        time = np.linspace(-1.0, 1.0, stop - start)
        order = min(3, stop - start)
        basis, _ = np.linalg.qr(np.vander(time, order, increasing=True))
        part = basis.T @ raw[start:stop]
        slow += (part**2).sum(axis=0)
    mean = raw.mean(axis=0)
    total = ((raw - mean) ** 2).sum(axis=0)
    between = np.maximum(slow - len(raw) * mean**2, 0.0)
    return np.asarray(between / np.maximum(total, 1e-300))


def _with_testable(log: Telemetry, plain: Examination) -> Examination:
    """Decide for every effect whether it is identifiable, and keep the terms that are."""
    competitors, evidence = plain.competitors, plain.evidence
    library = competitors.library
    over = over_sensor_errors(log, plain)
    if competitors.exact:
        over = np.full_like(over, np.inf)
    testable: dict[str, str | None] = dict(library.absent)
    good: list[bool] = []
    reasons: dict[str, list[str]] = {}
    for number, column in enumerate(library.candidates):
        why = _why_not_identifiable(plain, number, over)
        good.append(why is None)
        if why is not None:
            reasons.setdefault(column.effect, []).append(why)
    terms = []
    for term in library.terms:
        whole = len(term.columns) > 1 and " " in library.candidates[term.columns[0]].parameter
        if whole:
            usable = tuple(n for n in term.columns if good[n])
            if usable:
                terms.append(replace(term, columns=usable))
        elif all(good[n] for n in term.columns) and _separate(plain, term):
            terms.append(term)
    known = {term.effect for term in terms}
    for column in library.candidates:
        slug = column.effect
        testable[slug] = None if slug in known else reasons[slug][0]
    watts: dict[str, list[float]] = {}
    for term in terms:
        at = [competitors.candidate(n) for n in term.columns]
        watts.setdefault(term.effect, []).extend(_unnoticed_watts(plain, n) for n in at)
    # Forms of one effect, of which one is true; the log need not separate them.
    unnoticed = {slug: float(np.median(values)) for slug, values in watts.items()}
    shapes = tuple(
        k
        for k in range(len(competitors.dictionary.shapes))
        if over[competitors.first_shape + k] >= LEAST_OVER_SENSOR_ERROR
        and evidence.tolerance(competitors.first_shape + k) > 0.01
    )
    return replace(plain, testable=testable, unnoticed=unnoticed, terms=tuple(terms), shapes=shapes)


def _why_not_identifiable(plain: Examination, number: int, over: Array) -> str | None:
    evidence, candidate = plain.evidence, plain.competitors.library.candidates[number]
    column = plain.competitors.candidate(number)
    known = candidate.effect in plain.competitors.testable_before
    if evidence.tolerance(column) < LEAST_TOLERANCE * (KNOWN_EFFECT_SHARE if known else 1.0):
        return (
            "in this log, a refit of the model's own parameters changes the power in the same way"
        )
    if over[column] < LEAST_OVER_SENSOR_ERROR * (KNOWN_EFFECT_SHARE if known else 1.0):
        return (
            "after a refit of the model's parameters, its remaining power is no larger than the "
            "errors of the sensors"
        )
    unnoticed = _unnoticed_watts(plain, column)
    if unnoticed > LARGEST_UNNOTICED * plain.mean_watts:
        return _unnoticed(unnoticed, plain)
    if _least(plain, column) > max(-candidate.low, candidate.high):
        return "as large as it can be at all it would go unnoticed"
    return None


def _least(plain: Examination, column: int) -> float:
    """Least coefficient of a column that would be noticed."""
    return DETECTION_Z / float(np.sqrt(max(float(plain.evidence.partial[column, column]), 1e-300)))


def _unnoticed_watts(plain: Examination, column: int) -> float:
    return _least(plain, column) * float(np.sqrt(np.mean(plain.raw[:, column] ** 2)))


def _unnoticed(watts: float, plain: Examination) -> str:
    share = 100.0 * watts / plain.mean_watts
    return f"it would go unnoticed up to {watts:.2g} W, {share:.2g} % of the mean power"


def _separate(plain: Examination, term: Term) -> bool:
    """Parameters of one effect that do the same are not taken together."""
    if len(term.columns) < 2:
        return True
    at = [plain.competitors.candidate(n) for n in term.columns]
    clear = plain.evidence.partial[np.ix_(at, at)]
    scale = np.sqrt(np.diag(clear))
    values = np.linalg.eigvalsh(clear / np.outer(scale, scale))
    return bool(values[0] > 0.02)


def over_sensor_errors(log: Telemetry, plain: Examination) -> Array:
    """For every column: what the tangent leaves of it, over what errors of the inputs make of it.

    Both as sums of squares on some rows, with inputs disturbed by SENSOR_ERRORS.
    """
    competitors = plain.competitors
    # A meter shows what was before: rows alone would not do.
    step = max(len(log) // PROBE_ROWS, 1) if log.meter is None else 1
    at = np.arange(0, len(log), step)
    probe = log.take(at)
    rng = np.random.default_rng(7)
    rows = probe.rows.copy()
    for name, (fixed, relative) in SENSOR_ERRORS.items():
        column = rows[:, INDEX[name]]
        if np.all(column == column[0]):
            continue  # a constant is not measured row by row
        error = (fixed + relative * np.abs(column)) * rng.standard_normal(len(rows))
        if name in SPEED_OF:
            number, count, steady = (values[at] for values in stretches(log, SPEED_OF[name]))
            if name == SPEED_OF[name]:
                # Rows of a steady drive share what is left of the error in their mean.
                _, begin, stretch = np.unique(number, return_index=True, return_inverse=True)
                error = error[begin][stretch] / np.sqrt(count)
                calm = steady & (column == 0.0)  # at rest
            else:
                calm = steady  # no acceleration that was measured
            error[calm] = 0.0
        column += error
    _, disturbed = competitors.raw(replace(probe, rows=rows))
    scale = 1.0 / plain.spread[at]
    first, second = plain.raw[at] * scale[:, None], disturbed * scale[:, None]
    own = slice(0, competitors.tangent)
    norms = np.sqrt((first[:, own] ** 2).sum(axis=0))
    norms[norms == 0.0] = 1.0  # a parameter that does nothing here has no share
    known = np.diag(np.sqrt(competitors.known * len(at) / len(log)))[own]
    used = np.concatenate([first, known])
    share, *_ = np.linalg.lstsq(used[:, own] / norms, used, rcond=1e-8)
    left, right = first - first[:, own] / norms @ share, second - second[:, own] / norms @ share
    signal, error = (left**2).sum(axis=0), ((right - left) ** 2).sum(axis=0)
    # Columns of load or temperature have no error at all.
    ratio = signal / np.maximum(error, 1e-12 * signal + 1e-300)
    ratio[signal < 1e-10 * (first**2).sum(axis=0)] = 0.0
    return np.asarray(ratio)
