"""What to measure next: simulated before it is recommended.

    advice = Advice(examination, selection, log)
    advice.experiments(wide, undecided)    # drives, best first

A list of drives is laid out (way of driving × load × temperature × duration), each with the rows
that it would give. The model's columns on these rows, in units of the log's noise, with its
autocorrelation and its offsets and gains of runs, are added to the sums of the log. Together they
say what a second diagnosis would have: how far two effects lie apart that this log cannot tell
apart (the part of the one that neither refitting the model nor the other could imitate), and how
wide the intervals are. A drive is recommended only if it breaks a tie or halves an interval there.
Of these the one with the largest gain per minute wins: the logarithm to base 2 of the factor by
which the standard error falls, which is Lindley's information in bits. This is the T-optimal design
of Atkinson & Fedorov, and D-optimal for a single parameter, over a list.

Where no drive would do, a column is recommended, if one is missing
(planner.telemetry.diagnosis.advice.missing_columns).

Source
    A. C. Atkinson, V. V. Fedorov, The design of experiments for discriminating between two rival
    models, Biometrika 62, 1975; D. V. Lindley, On a measure of the information provided by an
    experiment, Annals of Mathematical Statistics 27, 1956.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.arrays import Array, Integers
from planner.power.catalogue import all_effects
from planner.power.effect import Effect
from planner.quantities import INDEX
from planner.telemetry.diagnosis.advice.drives import (
    Drive,
    drives_of,
    rows_of_round,
    settings_of,
)
from planner.telemetry.diagnosis.results import Experiment
from planner.telemetry.evidence import Examination
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import input_uncertainty
from planner.telemetry.selection import RankedTerm, Selection

MINUTES = (2.0, 5.0, 10.0, 20.0, 40.0)
"""Durations that are considered, driving alone."""
LEAST_RUNS = 4
"""Runs that a drive is divided into: errors are those of runs that were held out."""
USUAL_MINUTES = 10.0
"""The one of these that is recommended for an effect that is not testable."""
LOAD_MINUTES, HEAT_MINUTES = 1.0, 10.0
"""Minutes that it takes to change the load, and to bring the motors to another temperature."""
WARM, COLD = 60.0, 20.0
"""°C of motors that have driven for long, and of motors that have cooled down."""
LOADED = 0.4
"""Payload of a loaded run, as a share of the robot's mass, unless the log has a heavier one."""
ASKED = 1.5
"""Standard errors from which an effect may be what could not be attributed."""
MOST_ASKED = 6
"""Effects that a drive is to separate where something could not be attributed."""
CLEARLY = 7.0
"""Distance in standard deviations from which effects count as separated. The likelihood gains
half its square, 24.5 ± 7: far above what a tie needs (full_refit_comparison)."""
HALVED = 3.0
"""Factor by which a standard error must fall in the simulation, so that it halves in the robot:
errors of load and position do not fall with the rows, and runs scatter."""
UNKNOWN = 0.5
"""Standard error of a parameter over its value from which it is hardly known at all."""
WIDE = 0.05
"""Standard error of a parameter over its value from which a narrower interval is worth a drive. A
95 % interval is then a tenth to either side."""
ROUGH = 0.25
"""What a row counts in which the speed changes: its mean over half a second leaves out of the
changes of friction as much as the power has noise (docs/virtual-robot.md), and lastingly."""

Run = dict[str, float | None]


@dataclass(frozen=True)
class Option:
    """A drive with the runs and rounds of it.

    Attributes:
        drive: the way of driving.
        runs: payload and motor temperature of every run.
        rounds: of every run.
        planned: minutes that driving was to take.
        minutes: that it takes, loads and temperatures to change included.
        gram: of the log and this drive together.
    """

    drive: Drive
    runs: tuple[Run, ...]
    rounds: int
    planned: float
    minutes: float
    gram: Array

    @property
    def sentence(self) -> str:
        """What to drive, in words."""
        loads = list(dict.fromkeys(run["payload"] or 0.0 for run in self.runs))
        heats = [h for h in dict.fromkeys(run["motor_temp"] for run in self.runs) if h is not None]
        load = f", without load and with {loads[-1]:g} kg" if len(loads) > 1 else ""
        heat = f", with motors at {' and at '.join(f'{h:.0f}' for h in heats)} °C" if heats else ""
        driving = len(self.runs) * self.rounds * self.drive.seconds / 60.0
        total = f"{max(driving, 1.0):.0f} minutes in {len(self.runs)} runs"
        return f"Drive {self.drive.words}{load}{heat}, {total}."


@dataclass(frozen=True)
class Question:
    """What an experiment is to answer.

    Attributes:
        names: the effects, as an experiment lists them.
        pairs: each an effect and the columns of what it must be told apart from; () for nothing.
        given: columns of what is fitted beside them.
        narrower: the intervals of the first effect are to be halved.
    """

    names: tuple[str, ...]
    pairs: tuple[tuple[RankedTerm, tuple[int, ...]], ...]
    given: tuple[int, ...] = ()
    narrower: bool = False


class Advice:
    """What further runs would show, for one examined log.

    Args:
        examination: of the log.
        selection: what was found in it.
        log: the rows.
    """

    def __init__(self, examination: Examination, selection: Selection, log: Telemetry) -> None:
        self.examination = examination
        self.selection = selection
        self.log = log
        self.vehicle = examination.competitors.library.model.vehicle

    @cached_property
    def options(self) -> list[Option]:
        """Every drive in every duration, with the Gram matrix of the log and the drive together."""
        carried = float(np.nanmax(self.log.rows[:, INDEX["payload"]]))
        # What the robot has carried before it can carry again.
        heavy = round(max(LOADED * self.vehicle.mass, carried), 1)
        loads: list[tuple[float, ...]] = [(0.0,), (0.0, heavy)]
        heats: list[tuple[float | None, ...]] = [(None,)]
        if "motor_temp" in self.log.present:
            heats.append((COLD, WARM))
        drives = drives_of(self.vehicle)
        each: list[Run] = [
            {"payload": payload, "motor_temp": heat}
            for payload, heat in itertools.product(
                loads[-1], dict.fromkeys(itertools.chain(*heats))
            )
        ]
        sums = self._sums_of_rounds(drives, each)
        options = []
        for (place, drive), load, heat in itertools.product(enumerate(drives), loads, heats):
            runs = tuple(
                run for run in each if run["payload"] in load and run["motor_temp"] in heat
            )
            at = [each.index(run) for run in runs]
            for minutes in MINUTES:
                every = max(1, round(60.0 * minutes / (len(runs) * drive.seconds)))
                times = min(every, math.ceil(LEAST_RUNS / len(runs)))
                rounds = round(every / times)
                gram = np.sum([self._of_run(sums[place][k], rounds) for k in at], axis=0)
                total = self.examination.evidence.total[: len(gram), : len(gram)] + times * gram
                took = times * len(runs) * rounds * drive.seconds / 60.0
                took += LOAD_MINUTES * (len(load) - 1) + HEAT_MINUTES * (len(heat) - 1)
                options.append(Option(drive, runs * times, rounds, minutes, took, total))
        return options

    def _sums_of_rounds(self, drives: Sequence[Drive], runs: Sequence[Run]) -> list[list[Array]]:
        """Gram matrix of one round by drive and run; the last two columns are of its noise."""
        parts = [
            rows_of_round(settings_of(drive, self.vehicle, [run], 1), run, self._usual)
            for drive in drives
            for run in runs
        ]
        ends = np.cumsum([len(seconds) for _, seconds in parts])[:-1]
        rows, seconds = (np.concatenate(part) for part in zip(*parts, strict=True))
        grams = [part.T @ part for part in np.split(self._scaled(rows, seconds), ends)]
        return [grams[k : k + len(runs)] for k in range(0, len(grams), len(runs))]

    @cached_property
    def _usual(self) -> dict[str, float]:
        usual: dict[str, float] = {
            name: float(np.nanmedian(self.log.rows[:, INDEX[name]]))
            for name in ("motor_temp", "ambient_temp", "battery_voltage", "sensor_rate")
            if name in self.log.present and np.isfinite(self.log.rows[:, INDEX[name]]).any()
        }
        usual |= {name: 0.0 for name in ("com_x", "com_y") if name in self.log.present}
        return usual | {"odometer": float(np.nanmax(self.log.rows[:, INDEX["odometer"]]))}

    @cached_property
    def slow(self) -> float:
        """What the noise's autocorrelation leaves of a slow signal in one row, at most 1."""
        noise = self.examination.noise
        # An autoregression shrinks it by 1 - the sum of its weights, its own noise by less.
        return min((1.0 - float(noise.reflections[-1].sum())) / float(noise.shrink[-1]), 1.0)

    def _scaled(self, rows: Array, seconds: Array) -> Array:
        """Columns of rows (R, C + 2) by their noise; the last two are an offset and a gain."""
        count = len(rows)
        fake = replace(
            self.log.take(np.zeros(count, int)),
            rows=rows,
            power=np.zeros(count),
            time=np.cumsum(seconds),
            interval=seconds,
            meter=None,
        )
        competitors, noise = self.examination.competitors, self.examination.noise
        watts, columns = competitors.raw(fake)
        columns = columns[:, : competitors.first_shape]
        spread = noise.spread(watts, input_uncertainty(competitors.library.model, rows))
        usual = float(np.median(self.log.interval))
        weight = seconds / max(usual, 1e-6) * self.slow**2
        hard = np.any(rows[:, [INDEX[n] for n in ("ax", "ay", "yaw_acceleration")]] != 0.0, axis=1)
        weight = np.where(hard, ROUGH * weight, weight)
        shared = np.column_stack([columns, np.ones(count), watts])
        return np.asarray(shared * (np.sqrt(weight) / spread)[:, None])

    def _of_run(self, one: Array, rounds: int) -> Array:
        """Information of a run of some rounds, (C, C): its offset and gain are unknown."""
        gram, by_run = rounds * one, self.examination.noise.by_run
        inner, cross = gram[:-2, :-2], gram[:-2, -2:]
        if not np.any(by_run > 0.0):
            return np.asarray(inner)
        # (1 + S B S')^-1 by Woodbury, with B as it is where it has no inverse.
        known = np.linalg.solve(np.eye(2) + by_run @ gram[-2:, -2:], by_run)
        return np.asarray(inner - cross @ known @ cross.T)

    # What is asked.

    def experiments(self, wide: Collection[str], undecided: bool) -> tuple[Experiment, ...]:
        """The best drives for what this log leaves open, one for each question, best first.

        Args:
            wide: named effects whose intervals are wide.
            undecided: something is missing that could not be attributed.

        Returns:
            Drives; for a tie that no drive breaks what to measure by itself, last.
        """
        questions = self._questions(wide, undecided)
        found = [self._best(question) for question in questions]
        drives: dict[str, Experiment] = {}
        for one in sorted((e for e in found if e is not None), key=lambda e: -e.gain / e.minutes):
            # One drive may answer several questions.
            same = drives.get(one.run, one)
            names = tuple(dict.fromkeys([*same.separates, *one.separates]))
            drives[one.run] = replace(same, separates=names)
        answers = zip(questions, found, strict=True)
        lasting = [q for q, drive in answers if drive is None and q.pairs[0][1]]
        return *drives.values(), *map(_by_itself, lasting)

    def _questions(self, wide: Collection[str], undecided: bool) -> list[Question]:
        ranking = {s.name: s for s in self.selection.ranking}
        named = [m.name for m in self.selection.members if m.name in ranking]
        questions = []
        for name, aliases in self.selection.aliases.items():
            known = [r for r in aliases if r in ranking]
            if name not in ranking or not known:
                continue
            pairs = tuple((ranking[name], ranking[r].member.columns) for r in known)
            given = _columns(ranking, [n for n in named if n not in (name, *known)])
            questions.append(Question((name, *known), pairs, given))
        for name in wide:
            if name in ranking and not any(name in q.names for q in questions):
                given = _columns(ranking, [n for n in named if n != name])
                questions.append(Question((name,), ((ranking[name], ()),), given, narrower=True))
        if undecided:
            possible = [s for s in self.selection.ranking if s.z > ASKED and not s.member.sensor]
            likely = possible[:MOST_ASKED]
            pairs = tuple(
                (one, () if one is other else other.member.columns)
                for one, other in itertools.product(likely, likely)
            )
            if pairs:
                questions.append(Question(tuple(s.name for s in likely), pairs))
        return questions

    def _best(self, question: Question) -> Experiment | None:
        """The drive that answers a question with the largest gain per minute; None: none does."""
        before = self._certainty(self.examination.evidence.total, question)
        best: tuple[float, float, Option] | None = None
        for option in self.options:
            after = self._certainty(option.gram, question)
            if question.narrower:
                enough = bool(np.all(after >= HALVED * before))
            else:
                enough = bool(np.all(after >= CLEARLY))
            # Rivals that the log cannot tell at all count as half a standard deviation apart.
            gain = float(np.min(np.log2(after / np.maximum(before, 0.5))))
            if enough and (best is None or gain / option.minutes > best[0]):
                best = gain / option.minutes, gain, option
        if best is None:
            return None
        _, gain, option = best
        settings = settings_of(option.drive, self.vehicle, option.runs, option.rounds)
        minutes = round(option.minutes, 1)
        return Experiment(question.names, option.sentence, settings, minutes, round(gain, 2))

    def _certainty(self, gram: Array, question: Question) -> Array:
        """(k,) distances, in standard deviations: of an effect from each alternative, or of its
        parameters from 0.
        """
        base = [*self.examination.evidence.tangent.tolist(), *question.given]
        if question.narrower:
            first, _ = question.pairs[0]
            known = left_after(gram, np.array(base), np.array(first.member.columns))
            variance = np.diag(np.linalg.pinv(known, hermitian=True))
            return np.asarray(np.abs(first.coefficients) / np.sqrt(np.maximum(variance, 1e-300)))
        apart = []
        for one, alternative in question.pairs:
            left = left_after(gram, np.array([*base, *alternative]), np.array(one.member.columns))
            square = float(one.coefficients @ left @ one.coefficients)
            apart.append(math.sqrt(max(square, 0.0)))
        return np.array(apart)

    def missing(self, slug: str) -> list[str]:
        """Quantities that an effect reads and the log does not have."""
        effect = all_effects().get(slug)
        derived = ("odometer", "time_since_start", "slope_rate")
        reads = effect.reads if effect else frozenset[str]()
        return sorted(n for n in reads if n not in self.log.present and n not in derived)


def _by_itself(question: Question) -> Experiment:
    """What is left where no drive separates an effect from its aliases."""
    how = (all_effects().get(question.names[0]) or Effect).how_to_measure
    said = f"No drive tells {' from '.join(question.names[:2])} in this log's conditions. {how}"
    return Experiment(question.names, said, {})


def _columns(ranking: Mapping[str, RankedTerm], names: Sequence[str]) -> tuple[int, ...]:
    return tuple(c for name in names for c in ranking[name].member.columns)


def left_after(gram: Array, base: Integers, at: Integers) -> Array:
    """Gram matrix of columns `at` (A, A) after what the columns `base` explain of them."""
    inner = gram[np.ix_(base, base)]
    scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    inner = inner / np.outer(scale, scale) + 1e-9 * np.eye(len(base))
    cross = gram[np.ix_(base, at)] / scale[:, None]
    return gram[np.ix_(at, at)] - cross.T @ np.linalg.solve(inner, cross)
