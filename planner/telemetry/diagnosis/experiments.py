"""Which run separates aliased effects: chosen by what it adds to the evidence.

    advice = Advice(examination, selection, log)
    advice.experiments()                   # one for every tie
    advice.what_would_help("yaw_scrub")    # for an effect that is not identifiable
    advice.not_told(["air_drag"])          # all those, when air_drag is named

A list of feasible runs is laid out (manoeuvre × load × temperature, all of the same length), each
with the rows that it would give. The sums of the log and of such a run together say how far two
effects would then lie apart: the part of the one that neither refitting the model nor the other
could imitate, over the noise. The run with the largest smallest distance wins, which is the
T-optimal design of Atkinson & Fedorov (Biometrika 62, 1975) over this list.

    settings = {"runs": [{"payload", "motor_temp", "segments": [{"vx", "vy", "wz", "pitch", "roll",
                "acceleration", "seconds"}]}]}

in SI; ``motor_temp`` is None where it may be as it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from planner.arrays import Array, Integers
from planner.power.catalogue import all_effects
from planner.power.effect import Effect
from planner.power.rows import gravity_columns, rows_from
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.diagnosis.results import Experiment, NotTestable
from planner.telemetry.evidence import Examination
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import input_uncertainty
from planner.telemetry.selection import Selection

SECONDS = 600.0
"""Length that all runs of an experiment have together."""
SLOPE = 0.0873  # 5°
WARM, COLD = 60.0, 20.0
LOADED = 0.4
"""Payload of a loaded run, as a share of the robot's mass, unless the log has a heavier one."""
HOPELESS = 1.0
"""Distance in standard deviations below which a run is not recommended."""
HINT = 3.0
"""Standard errors from which an effect that is not named is mentioned."""
CLEARLY = 5.0
"""Distance in standard deviations from which effects count as separated."""
ROUGH = 0.25
"""What a row counts in which the speed changes: its mean over half a second leaves out of the
changes of friction as much as the power has noise (docs/virtual-robot.md), and lastingly."""
AS_GOOD = 0.98
"""Share of the largest distance from which a run that asks less, or shows more, is preferred."""
_UNEVEN, _OFFSET = "wheel_imbalance", "com_offset"  # planner.telemetry.selection.known_aliases
_SPEEDS = (0.15, 0.35, 0.6, 0.85)


@dataclass(frozen=True)
class Run:
    """One feasible run: sentence and numbers."""

    sentence: str
    settings: dict[str, Any]

    @property
    def demands(self) -> tuple[int, int]:
        """Temperatures that the motors have to be brought to, and how few loads are carried.

        Loads are changed at once, and show the shape of a drag, which is the hardest to identify.
        """
        runs = self.settings["runs"]
        heats, loads = ({run[name] for run in runs} for name in ("motor_temp", "payload"))
        return len(heats), -len(loads)


_DIGITS = {"vx": 3, "vy": 3, "wz": 3, "pitch": 4, "roll": 4, "acceleration": 3}


def _segment(vx: float, vy: float, wz: float = 0.0, **more: float) -> dict[str, float]:
    given = {"vx": vx, "vy": vy, "wz": wz, **more}
    return {name: round(given.get(name, 0.0), digits) for name, digits in _DIGITS.items()}


def _manoeuvres(top: float, turn: float) -> dict[str, list[dict[str, float]]]:
    speeds = [top * part for part in _SPEEDS]
    said = ", ".join(f"{v:.2f}" for v in speeds)
    angles = [k * np.pi / 4 for k in range(8)]
    degrees = f"{np.degrees(SLOPE):.0f}°"
    creep = [0.01, 0.02, 0.04, 0.07]
    return {
        f"straight ahead on level ground at {said} m/s": [_segment(v, 0.0) for v in speeds],
        f"sideways on level ground at {said} m/s": [_segment(0.0, v) for v in speeds],
        f"in all eight directions on level ground at {said} m/s": [
            _segment(v * np.cos(a), v * np.sin(a)) for v in speeds for a in angles
        ],
        f"up and down a slope of {degrees}, forwards, at {said} m/s": [
            _segment(v, 0.0, pitch=p) for v in speeds for p in (SLOPE, -SLOPE)
        ],
        f"up and down a slope of {degrees}, sideways, at {said} m/s": [
            _segment(0.0, v, roll=r) for v in speeds for r in (SLOPE, -SLOPE)
        ],
        f"forwards and sideways across a slope of {degrees} at {said} m/s": [
            s for v in speeds for s in (_segment(v, 0.0, roll=SLOPE), _segment(0.0, v, pitch=SLOPE))
        ],
        f"turning on the spot at {0.3 * turn:.2f} and {0.8 * turn:.2f} rad/s, both ways": [
            _segment(0.0, 0.0, w * turn) for w in (0.3, 0.8, -0.3, -0.8)
        ],
        f"in curves at {speeds[2]:.2f} m/s with up to {0.8 * turn:.2f} rad/s": [
            _segment(v * np.cos(a), v * np.sin(a), w * turn)
            for v in speeds[1:3]
            for a in angles[::2]
            for w in (0.0, 0.4, 0.8)
        ],
        "creeping at 1 to 7 cm/s, forwards and sideways": [
            s for v in creep for s in (_segment(v, 0.0), _segment(0.0, v))
        ],
        f"starting and stopping hard between 0 and {speeds[-1]:.2f} m/s, forwards and sideways": [
            s
            for v in speeds
            for a in (0.6, -0.6)
            for s in (_segment(v, 0.0, acceleration=a), _segment(0.0, v, acceleration=a))
        ],
    }


def feasible_runs(examination: Examination, log: Telemetry) -> list[Run]:
    """All runs that are considered for a robot and the quantities that its log has."""
    vehicle = examination.competitors.library.model.vehicle
    top = 0.65 * vehicle.limits.speed
    turn = 0.6 * vehicle.limits.yaw_rate
    manoeuvres = _manoeuvres(top, turn)
    # What the robot has carried before it can carry again.
    carried = float(np.nanmax(log.rows[:, INDEX["payload"]]))
    heavy = round(max(LOADED * vehicle.mass, carried), 1)
    loads: list[tuple[str, list[float]]] = [
        ("", [0.0]),
        (f", without load and with {heavy} kg", [0.0, heavy]),
    ]
    heats: list[tuple[str, list[float | None]]] = [("", [None])]
    if "motor_temp" in log.present:
        words = f", once with motors at {COLD:.0f} °C and once at {WARM:.0f} °C"
        heats.append((words, [COLD, WARM]))
    runs = []
    for (what, segments), load, heat in itertools.product(manoeuvres.items(), loads, heats):
        count = len(load[1]) * len(heat[1]) * len(segments)
        seconds = round(SECONDS / count, 1)
        settings = {
            "runs": [
                {
                    "payload": payload,
                    "motor_temp": temperature,
                    "segments": [{**s, "seconds": seconds} for s in segments],
                }
                for payload in load[1]
                for temperature in heat[1]
            ]
        }
        sentence = f"Drive {what}{load[0]}{heat[0]}, {SECONDS / 60:.0f} minutes in all."
        runs.append(Run(sentence, settings))
    return runs


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

    @cached_property
    def _runs(self) -> list[tuple[Run, Array]]:
        """Every run with the Gram matrix of the log and the run together."""
        evidence = self.examination.evidence
        runs = feasible_runs(self.examination, self.log)
        parts = [_rows(run, self.log) for run in runs]
        ends = np.cumsum([len(rows) for rows, _ in parts])[:-1]
        scaled = self._scaled(*(np.concatenate(part) for part in zip(*parts, strict=True)))
        grams = [part.T @ part for part in np.split(scaled, ends)]
        return [(run, evidence.total + gram) for run, gram in zip(runs, grams, strict=True)]

    def _scaled(self, rows: Array, interval: Array) -> Array:
        """Columns of such rows (R, C) by their noise; interval is seconds that each stands for."""
        count = len(rows)
        fake = replace(
            self.log.take(np.zeros(count, int)),
            rows=rows,
            power=np.zeros(count),
            time=np.arange(count, dtype=float) * 10.0 * float(interval.max()),
            interval=np.zeros(count),
            meter=None,
        )
        competitors, noise = self.examination.competitors, self.examination.noise
        watts, columns = competitors.raw(fake)
        columns[:, -1] = 0.0
        model = competitors.library.model
        spread = noise.spread(watts, input_uncertainty(model, rows))
        # Rows of one steady segment share their noise as neighbouring rows do.
        usual = float(np.median(self.log.interval))
        weight = interval / max(usual, 1e-6) * (1.0 - noise.correlation) / (1.0 + noise.correlation)
        hard = np.any(rows[:, [INDEX["ax"], INDEX["ay"]]] != 0.0, axis=1)
        weight = np.where(hard, ROUGH * weight, weight)
        return columns * (np.sqrt(np.maximum(weight, 0.0)) / spread)[:, None]

    @cached_property
    def _alone(self) -> Array:
        """Standard deviations (runs, C) of each column, by what the base could not imitate."""
        base = self.examination.evidence.tangent
        every = np.arange(len(self.examination.evidence.total))
        left = [np.diag(_left(gram, base, every)) for _, gram in self._runs]
        return np.sqrt(np.maximum(np.stack(left), 0.0))

    def experiments(self) -> tuple[Experiment, ...]:
        """One experiment for every selected effect that has aliases."""
        advice = []
        ranking = {s.name: s for s in self.selection.ranking}
        for name, aliases in self.selection.aliases.items():
            known = [r for r in aliases if r in ranking]
            if not known or name not in ranking:
                continue
            mine = ranking[name].member.columns
            strength = ranking[name].coefficients
            distances = [
                min(self._distance(gram, mine, strength, ranking[r].member.columns) for r in known)
                for _, gram in self._runs
            ]
            enough = [k for k, d in enumerate(distances) if d >= AS_GOOD * max(distances)]
            k = min(enough, key=lambda k: (*self._runs[k][0].demands, -distances[k]))
            distance, run = distances[k], self._runs[k][0]
            if name == _UNEVEN and _OFFSET in known and self._missing(_OFFSET):
                distance = 0.0  # the columns of an unknown offset know nothing of its side
            sure = "" if distance >= CLEARLY else " It may take several such runs."
            sentence, settings = run.sentence + sure, run.settings
            if distance < HOPELESS:
                # No motion parts effects that differ only in what the log does not know.
                missing = sorted({q for slug in (name, *known) for q in self._missing(slug)})
                wanted = f"Log {' and '.join(missing)}" if missing else "Measure them by themselves"
                sentence, settings = f"{wanted}: no run would tell them apart otherwise.", {}
            advice.append(Experiment((name, *known), sentence, settings))
        return tuple(advice)

    def _distance(
        self, gram: Array, mine: Sequence[int], strength: Array, alias: Sequence[int]
    ) -> float:
        """Standard deviations between an effect and the nearest that an alias could imitate."""
        rest = np.array([*self.examination.evidence.tangent.tolist(), *alias])
        left = _left(gram, rest, np.array(mine))
        return float(np.sqrt(max(float(strength @ left @ strength), 0.0)))

    def _missing(self, slug: str) -> list[str]:
        """Quantities that an effect reads and the log does not have."""
        effect = all_effects().get(slug)
        derived = ("odometer", "time_since_start", "slope_rate")
        reads = effect.reads if effect else frozenset[str]()
        return sorted(n for n in reads if n not in self.log.present and n not in derived)

    def not_testable(self, selected: Collection[str]) -> tuple[NotTestable, ...]:
        """Effects that are not identifiable from this log, or hardly, and what would help.

        Args:
            selected: effects that are named.
        """
        testable, chosen = self.examination.testable, {m.name for m in self.selection.members}
        reasons = {slug: why for slug, why in testable.items() if why is not None}
        for slug in self.examination.unnoticed:
            if (why := self.examination.barely_testable(slug)) is not None:
                reasons[slug] = why
        for ranked in self.selection.ranking:
            if ranked.z > HINT and not ranked.member.sensor:
                but = "held-out rows do not" if ranked.name in chosen else "too little to name it"
                hint = f"the log hints at it, {ranked.z:.1f} standard errors, {but}"
                reasons[ranked.name] = hint
        aliased = {alias for name in selected for alias in self.selection.aliases.get(name, ())}
        return tuple(
            NotTestable(slug, why, self.what_would_help(slug))
            for slug, why in sorted(reasons.items())
            if slug not in {*selected, *aliased}
        )

    def what_would_help(self, slug: str) -> str:
        """What would make an effect testable, in one sentence."""
        missing = self._missing(slug)
        competitors = self.examination.competitors
        columns = [
            (competitors.candidate(k), competitors.library.amplitudes[k])
            for k, c in enumerate(competitors.library.candidates)
            if c.effect == slug
        ]
        effect = all_effects().get(slug)
        if effect and effect.before_meter:
            return effect.how_to_measure
        if columns:
            at, amplitudes = zip(*columns, strict=True)
            apart = (self._alone[:, list(at)] * np.abs(amplitudes)).max(axis=1)
            if apart.max() > CLEARLY:
                return self._runs[int(apart.argmax())][0].sentence
        if missing:
            return f"Log {' and '.join(missing)}."
        return (effect or Effect).how_to_measure


def _left(gram: Array, base: Integers, at: Integers) -> Array:
    """Gram matrix of columns `at` (A, A) after what the columns `base` explain of them."""
    inner = gram[np.ix_(base, base)]
    scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    inner = inner / np.outer(scale, scale) + 1e-9 * np.eye(len(base))
    cross = gram[np.ix_(base, at)] / scale[:, None]
    return gram[np.ix_(at, at)] - cross.T @ np.linalg.solve(inner, cross)


def _rows(run: Run, log: Telemetry) -> tuple[Array, Array]:
    """One row for each segment of a run, and the seconds that it stands for."""
    usual: dict[str, float] = {
        name: float(np.nanmedian(log.rows[:, INDEX[name]]))
        for name in ("motor_temp", "ambient_temp", "battery_voltage", "sensor_rate")
        if name in log.present and np.isfinite(log.rows[:, INDEX[name]]).any()
    }
    usual |= {name: 0.0 for name in ("com_x", "com_y") if name in log.present}
    far = float(np.nanmax(log.rows[:, INDEX["odometer"]]))
    driven: list[dict[str, Any]] = []
    seconds = []
    for one in run.settings["runs"]:
        clock = 0.0
        for s in one["segments"]:
            speed = max(float(np.hypot(s["vx"], s["vy"])), 1e-9)
            columns: dict[str, Any] = {
                **usual,
                **{name: s[name] for name in ("vx", "vy", "wz")},
                "ax": s["acceleration"] * s["vx"] / speed,
                "ay": s["acceleration"] * s["vy"] / speed,
                "payload": one["payload"],
                "odometer": far,
                "time_since_start": clock + 0.5 * s["seconds"],
            }
            if one["motor_temp"] is not None:
                columns["motor_temp"] = one["motor_temp"]
            columns |= gravity_columns(s["roll"], s["pitch"], gravity=STANDARD_GRAVITY)
            driven.append(columns)
            seconds.append(s["seconds"])
            clock += s["seconds"]
    rows = rows_from(**{name: [columns[name] for columns in driven] for name in driven[0]})
    return rows, np.array(seconds)
