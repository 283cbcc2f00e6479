"""The same fit, told what is hidden and what the meter does: the measure of every diagnosis.

    oracle = Oracle.of(log)
    oracle.floor_w         # W, its held-out error, the floor of all bars
    oracle.rho             # slug → effect after projection over the floor
    oracle.testable        # whether anybody could name what is hidden

It gets the log and the data sheet as a diagnosis does, and starts at the stated vehicle. Beside
that it knows which effects act, what a mechanism outside the catalogue adds, and what of the base
model the data sheet leaves out. It does not know the errors of odometry, IMU, clock and data sheet:
nobody does.

It reads the motion in every way that a diagnosis tries, and as it was logged; where an inertial
sensor is late, also with angles that are earlier by about that, and without its accelerations. It
knows whether rows came in bunches, and whether their speeds are held. Each time the power is passed
through the true meter, and the product's own fit looks for a meter, too: one that is not there may
take away noise of the motion. What predicts best counts, so that a floor is below every answer that
knows less.

Testable: every hidden effect has |z| ≥ 5, its score added up by runs where it hardly changes within
one, and its log-likelihood leads that of the best rival by 8. Rivals are the other effects of the
catalogue and the sensor errors that are not there, each with any sign. Errors that are there, the
data sheet's mass among them, stand beside the truth and beside every rival.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Array, Integers
from planner.power.catalogue import find_effect
from planner.power.model import PowerModel
from planner.telemetry.estimation import bounded_step
from planner.telemetry.holdout.heldout import fold_numbers, heldout_rmse
from planner.telemetry.holdout.metered import metered_base_fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import SENSORS
from planner.telemetry.parameters import Prior, free_places
from planner.telemetry.prediction import Nodes, predict, tangent
from planner.telemetry.sampling import LogSource, open_source
from planner.telemetry.starting_model import starting_model
from planner.telemetry.terms import CandidateLibrary, candidate_library
from tests.hidden_effects.laboratory.draw import Log
from tests.hidden_effects.laboratory.instruments import (
    Instruments,
    Meter,
    filtered,
    held_times,
    sampled,
)
from tests.hidden_effects.visibility import with_settings

LEAST_Z = 5.0
LEAST_LEAD = 8.0
STEPS = 12
CLIP = 3.5
"""Spreads that a residual counts at most, as in the product's fit."""
BLOCK = 20.0  # s
LASTING = 0.1
"""Share of a column's variance within runs, below which runs are what counts."""


@dataclass(frozen=True)
class Oracle:
    """What it found.

    Attributes:
        floor_w: held-out error, W.
        rho: by hidden slug or mechanism.
        z: by hidden slug.
        lead: least lead of the log-likelihood over a rival; ``rival`` is which.
    """

    floor_w: float
    rho: dict[str, float]
    z: dict[str, float]
    lead: float
    rival: str

    @property
    def testable(self) -> bool:
        """Whether what is hidden can be named at all."""
        shown = all(abs(z) >= LEAST_Z for z in self.z.values())
        return bool(self.z) and shown and self.lead >= LEAST_LEAD

    @classmethod
    def of(cls, log: Log) -> Oracle:
        """Fit, hold out, and compare with the rivals; of all readings of the rows, the best."""
        imu = log.truth.instruments
        logged = open_source(Telemetry.read(log.path, log.mapping))
        read = _as_recorded(logged, imu)
        # A meter beside uneven rows takes minutes, and is wrong.
        sources = [read if imu.bunched else logged, *_with_tilts(read, imu)]
        derived = read.by_changes_of_speed()
        sources += [] if derived is None else _with_tilts(derived, imu)
        rows = {
            (s.even, s.holds, s.derived, s.tilt_lag, s.tilt_filter, s.reading): s
            for each in sources
            for s in (each, *each.readings())
        }
        start = _with_what_is_there(starting_model(log.sheet), starting_model(log.robot))
        slugs = [slug for slug in log.truth.hidden if slug in log.truth.there]
        told = _told(start, log, slugs, read.sample)
        fits, floors = [], []
        for each in (source.sample for source in rows.values()):
            known = replace(each, power=each.power - log.truth.outside_power)
            fits.append(_Fit(known, candidate_library(start, known), log, slugs))
            floors += [fits[-1].heldout_rmse(), heldout_rmse(*metered_base_fit(known, told))]
        best = fits[int(np.argmin(floors[::2]))]
        return cls._of(best, log, slugs, min(floors))

    @classmethod
    def _of(cls, fit: _Fit, log: Log, slugs: Sequence[str], floor: float) -> Oracle:
        own = {slug: fit.change_by(slug) for slug in slugs}
        if outside := log.truth.outside:
            clear = _left(fit.through_gaps(log.truth.outside_power), fit.base)
            rho = {outside: float(np.sqrt(np.mean(clear**2)) / floor)}
            return cls(floor, rho, {}, np.inf, "")
        if not slugs:
            return cls(floor, {}, {}, np.inf, "")
        rho, z, leads = {}, {}, {}
        for slug in slugs:
            others = [own[other] for other in slugs if other != slug]
            clear = _left(own[slug], np.column_stack([fit.base, *others]))
            rho[slug] = float(np.sqrt(np.mean(clear**2)) / floor)
            z[slug] = fit.z_of(clear)
            leads |= fit.leads(slug, own[slug], others)
        rival = min(leads, key=lambda name: leads[name])
        return cls(floor, rho, z, float(leads[rival]), rival)


def _with_tilts(source: LogSource, instruments: Instruments) -> list[LogSource]:
    """The log, and with angles that are freed of nearly what their sensor did to them."""
    lag, seconds = instruments.angle_lag, instruments.angle_filter
    earlier = sorted(source.earlier_tilts(), key=lambda s: abs(s.tilt_lag - lag))
    freed = sorted(source.freed_tilts(), key=lambda s: abs(s.tilt_filter - seconds))
    return [source, *(earlier[:1] if lag else []), *(freed[:1] if seconds else [])]


def _as_recorded(source: LogSource, instruments: Instruments) -> LogSource:
    """The log as it was measured: on an even clock, or between updates, where that is true."""
    even = source.evenly_timed() if instruments.bunched else None
    source = source if even is None else even
    between = source.between_updates() if instruments.odometry_period > 0.0 else None
    return source if between is None else between


def _with_what_is_there(sheet: PowerModel, robot: PowerModel) -> PowerModel:
    """The data sheet's model with the parts that the robot has and the data sheet does not."""
    missing = (sheet.parameters == 0.0) & (robot.parameters > 0.0)
    return replace(sheet, parameters=np.where(missing, robot.parameters, sheet.parameters))


def _told(start: PowerModel, log: Log, slugs: Sequence[str], read: Telemetry) -> PowerModel:
    """The model with the effects that are hidden, at their strengths."""
    effects = [find_effect(slug) for slug in slugs]
    model = PowerModel.from_vehicle(start.vehicle, effects=effects, surfaces=read.surfaces)
    known = dict(zip(start.parameter_names, start.parameters, strict=True))
    own = zip(model.parameter_names, model.parameters, strict=True)
    values = np.array([known.get(name, value) for name, value in own])
    model = replace(model, parameters=values)
    for slug in slugs:
        model = with_settings(model, slug, log.truth.hidden[slug])
    return model


class _Fit:
    """Bounded, robust Gauss-Newton steps through the true meter."""

    def __init__(
        self, log: Telemetry, library: CandidateLibrary, drawn: Log, slugs: Sequence[str]
    ) -> None:
        self.log, self.library = log, library
        self.meter = drawn.truth.instruments.meter
        self.row = 1.0 / drawn.truth.conditions.rate
        instruments = drawn.truth.instruments
        self.clock_rate = instruments.clock_rate
        self.wrong = ["mass", *(kind for kind in instruments.wrong_sensors if kind in SENSORS)]
        model = library.model
        for slug in slugs:
            model = with_settings(model, slug, drawn.truth.hidden[slug])
        allowed = {place for place, slot in enumerate(model.slots) if slot[0].slug in slugs}
        allowed |= set(library.places)
        # Effects at their null value do not act, so that only what is hidden has free shapes.
        self.places = [place for place in free_places(model, log) if place in allowed]
        self.null = library.model
        self.slugs = slugs
        self.nodes = Nodes.of(log, model)
        self.model = model
        self.power = self.through_gaps(log.power)
        self._solve()
        order = {place: k for k, place in enumerate(self.places)}
        self.base = self.columns[:, [order[p] for p in library.places if p in order]]

    def through(self, columns: Array) -> Array:
        """Columns (n, k) W of the rows as the meter would show them, without ``carried``."""
        shown = through_meter(self.log, columns, self.meter, self.row, self.clock_rate)
        return shown - carried(self.log, shown, self.meter.time_constant)

    def through_gaps(self, shown: Array) -> Array:
        """(n,) W that a meter showed, without ``carried``."""
        return shown - carried(self.log, shown[:, None], self.meter.time_constant)[:, 0]

    def _solve(self) -> None:
        index = np.array(self.places)
        prior = Prior.of(self.model, self.places)
        value = begin = np.clip(self.model.parameters[index], prior.low, prior.high)
        best, stride, step = np.inf, 1.0, np.zeros(len(index))
        for _ in range(STEPS):
            values = self.model.parameters.copy()
            values[index] = value
            model = replace(self.model, parameters=values)
            watts, columns = tangent(model, self.nodes, self.places)
            seen = self.through(np.column_stack([watts, columns]))
            residual = self.power - seen[:, 0]
            spread = 1.4826 * float(np.median(np.abs(residual))) + 1e-9
            cost = float(np.sum(np.minimum(np.abs(residual), CLIP * spread) ** 2))
            if cost > best * (1.0 + 1e-6) and stride > 0.05:
                stride *= 0.5
                value = value - stride * step
                continue
            best, stride = min(best, cost), 1.0
            self.model, self.columns, self.residual = model, seen[:, 1:], residual
            self.spread, self.prior = spread, prior
            step = self._step(np.ones(len(residual), bool), value, begin)
            if np.all(np.abs(step) <= 1e-4 * (np.abs(value) + 1e-9)):
                break
            value = np.clip(value + step, prior.low, prior.high)
        self.value, self.begin = self.model.parameters[index], begin

    def _step(self, kept: Array, value: Array, begin: Array) -> Array:
        columns = self.columns[kept] / self.spread
        target = np.clip(self.residual[kept] / self.spread, -CLIP, CLIP)
        held = self.prior.weights**2 * (value - begin) + self.prior.gauge @ value
        gram = columns.T @ columns + self.prior.precision
        low, high = self.prior.low - value, self.prior.high - value
        return np.asarray(bounded_step(gram, columns.T @ target - held, low, high))

    def heldout_rmse(self) -> float:
        """W; each fold by one step of the fit without it."""
        folds = fold_numbers(self.log)
        left = np.empty(len(folds))
        for fold in np.unique(folds):
            out = folds == fold
            step = self._step(~out, self.value, self.begin)
            left[out] = self.residual[out] - self.columns[out] @ step
        return float(np.sqrt(np.mean(left**2)))

    def change_by(self, slug: str) -> Array:
        """(n,) W that a hidden effect adds, at its fitted strength."""
        values = self.model.parameters.copy()
        for place, slot in enumerate(self.model.slots):
            if slot[0].slug == slug:
                values[place] = self.null.parameters[place]
        without = replace(self.model, parameters=values)
        change = predict(self.model, self.nodes) - predict(without, self.nodes)
        return self.through(change[:, None])[:, 0]

    def z_of(self, clear: Array) -> float:
        """Standard errors of the factor on a projected column (n,) whose fitted factor is one."""
        square = float(clear @ clear)
        if square <= 1e-18:
            return 0.0
        runs = self.log.run
        means = np.bincount(runs, clear) / np.maximum(np.bincount(runs), 1)
        within = float(np.mean((clear - means[runs]) ** 2)) / (square / len(clear))
        lasting = within < LASTING
        number = runs if lasting else _blocks(self.log)
        scores = np.bincount(
            number, clear * np.clip(self.residual, -CLIP * self.spread, CLIP * self.spread)
        )
        scores = scores[np.bincount(number) > 0]
        many = len(scores) / max(len(scores) - 1, 1)
        return float(square / np.sqrt(many * np.sum(scores**2) + 1e-300))

    def leads(self, slug: str, own: Array, others: Sequence[Array]) -> dict[str, float]:
        """Rival → log-likelihood by which the hidden effect explains the log better."""
        target = np.clip(self.residual, -CLIP * self.spread, CLIP * self.spread) + own
        count = _independent(self.residual, self.log.run)
        # Everything around one model, or the effect's own part in the tangent would tell it.
        base = self.library.around(self.model, self.library.amplitudes, ())
        _, around, raw = base.columns(self.nodes)
        columns = self.through(raw)
        faults = self._faults(predict(self.model, self.nodes))
        there = [faults.pop(kind) for kind in self.wrong]
        beside = np.column_stack([self.through(around), *others, *there])
        least = _squares(target, np.column_stack([beside, own]))
        found: dict[str, float] = {}
        for term in self.library.terms:
            if term.effect != slug and term.effect not in self.slugs:
                rival = np.column_stack([beside, columns[:, list(term.columns)]])
                found[term.effect] = min(found.get(term.effect, np.inf), _squares(target, rival))
        for kind, column in faults.items():
            found[kind] = _squares(target, np.column_stack([beside, column]))
        return {
            name: 0.5 * count * float(np.log(max(squares, 1e-300) / max(least, 1e-300)))
            for name, squares in found.items()
        }

    def _faults(self, watts: Array) -> dict[str, Array]:
        """What errors of the sensors and of the data sheet's mass would change."""
        columns = {
            kind: sensor.column(self.log, self.model, watts) for kind, sensor in SENSORS.items()
        }
        columns["mass"] = self._heavier() - watts
        return {kind: self.through(column[:, None])[:, 0] for kind, column in columns.items()}

    def _heavier(self) -> Array:
        vehicle = replace(self.model.vehicle, mass=1.02 * self.model.vehicle.mass)
        effects = [effect for effect in self.model.effects if not effect.base]
        heavier = PowerModel.from_vehicle(vehicle, effects=effects, surfaces=self.model.surfaces)
        known = dict(zip(self.model.parameter_names, self.model.parameters, strict=True))
        values = np.array([known[name] for name in heavier.parameter_names])
        return predict(replace(heavier, parameters=values), self.nodes)


def through_meter(
    log: Telemetry, columns: Array, meter: Meter, row: float, clock_rate: float = 0.0
) -> Array:
    """Columns (n, k) of watts of the rows, as a meter would show them.

    ``clock_rate`` is the relative error of the log's time, by which a slower meter's readings are
    found. Between rows power is linear in time, or the same over a row where rows hold means.
    """
    same = meter.motion == meter.sampling
    if same and meter.time_constant == 0.0 and meter.delay == 0.0:
        return columns
    step = min(0.25 * row, 0.05)
    result = np.empty_like(columns)
    for start, stop in log.segments():
        part, time = columns[start:stop], log.time[start:stop] / (1.0 + clock_rate)
        grid = np.arange(time[0] - 2.0 * row, time[-1] + step, step)
        if same and meter.motion == "mean":
            places = np.clip(np.searchsorted(time, grid + 0.5 * step), 0, len(time) - 1)
            fine = part[places]
        else:
            at = time - (0.5 * row if meter.motion == "mean" else 0.0)
            fine = np.column_stack([np.interp(grid + 0.5 * step, at, c) for c in part.T])
        moment = time - meter.delay
        if meter.sampling == "held":
            moment = held_times(moment, meter.period, meter.phase)
        window = row if meter.sampling == "mean" else 0.0
        for k in range(part.shape[1]):
            seen = filtered(fine[:, k], step, meter.time_constant)
            result[start:stop, k] = sampled(seen, step, moment - grid[0], window)
    return result


def carried(log: Telemetry, shown: Array, time_constant: float) -> Array:
    """Columns (n, k) of what a filter still shows of its reading at the start of each stretch.

    Nobody knows the power before a run or within a gap. Its effect on later readings follows from
    the first one.
    """
    left = np.zeros_like(shown)
    if time_constant > 0.0:
        for start, stop in log.segments():
            fade = np.exp(-(log.time[start:stop] - log.time[start]) / time_constant)
            left[start:stop] = fade[:, None] * shown[start]
    return left


def _blocks(log: Telemetry) -> Integers:
    number = np.floor(log.time / BLOCK).astype(int) + 100_000 * log.run
    return np.unique(number, return_inverse=True)[1]


def _independent(residual: Array, run: Integers) -> float:
    """Number of rows that white noise would need to tell as much."""
    same = run[1:] == run[:-1]
    a, b = residual[1:][same], residual[:-1][same]
    lag = float(np.clip((a @ b) / max(np.sqrt((a @ a) * (b @ b)), 1e-300), 0.0, 0.99))
    return len(residual) * (1.0 - lag) / (1.0 + lag)


def _squares(target: Array, columns: Array) -> float:
    left = _left(target, columns)
    return float(left @ left)


def _left(target: Array, columns: Array) -> Array:
    """What is left of a vector after projecting out columns, some of which may be dependent."""
    scale = np.sqrt((columns**2).sum(axis=0))
    kept = columns[:, scale > 1e-12] / scale[scale > 1e-12]
    gram = kept.T @ kept
    inverse = np.linalg.pinv(gram, rcond=1e-10, hermitian=True)
    once = target - kept @ (inverse @ (kept.T @ target))
    return np.asarray(once - kept @ (inverse @ (kept.T @ once)))
