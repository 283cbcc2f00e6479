"""Results of a diagnosis: the verdict, its evidence, and what to do next.

planner.telemetry.diagnosis.diagnose makes them. ``to_json`` gives the document of the command line
and of the service.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.shown import Shown, frame
from planner.telemetry.diagnosis.unexplained import Unexplained
from planner.telemetry.estimation import Fit, RefusedFit
from planner.telemetry.logs import Meter, Telemetry
from planner.telemetry.pictures import Pictures
from planner.telemetry.regimes import Regime
from planner.telemetry.terms import Addition

if TYPE_CHECKING:
    import pandas

Verdict = Literal[
    "missing_effect", "complete", "not_identifiable", "outside_catalogue", "sensor_error"
]

HINTED = "the log hints at it, "
"""How the reason begins why an effect is not named that could be seen."""


@dataclass(frozen=True)
class Errors:
    """Error of a model on a log, W.

    Attributes:
        rmse_w: on the rows that the model was fitted to.
        heldout_rmse_w: on runs that it was not fitted to.
        noise_floor_w: error of a perfect model; None where it was not estimated.
    """

    rmse_w: float
    heldout_rmse_w: float
    noise_floor_w: float | None = None

    def to_json(self) -> dict[str, Any]:
        """The keys of design's ``baseline`` and ``after``."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True)
class Estimate:
    """Value of one parameter with its standard error."""

    value: float
    stderr: float | None
    unit: str

    def to_json(self) -> dict[str, Any]:
        """Value, standard error and unit."""
        return {**asdict(self), "stderr": _number(self.stderr)}


@dataclass(frozen=True)
class Candidate:
    """One effect of the catalogue in the ranking.

    Attributes:
        effect: slug.
        probability: that it is missing, given that one to three of the candidates may be; None
            where held-out runs overruled the search that it comes from.
        heldout_rmse_w: of the model with it, on held-out runs; None when it is not identifiable.
        parameters: name → estimate.
        z: normal deviate of its test.
        p_value: of its test alone, before any correction for the number of candidates.
        rho: effect size, rms of what it adds over the noise.
        gain: log-likelihood gained over the model.
        degrees_of_freedom: number of its parameters.
        indistinguishable_from: slugs that explain the log as well.
        why_not: why it is not identifiable from this log; None when it is.
    """

    effect: str
    probability: float | None
    heldout_rmse_w: float | None
    parameters: Mapping[str, Estimate]
    z: float
    p_value: float
    rho: float
    gain: float
    degrees_of_freedom: int
    indistinguishable_from: tuple[str, ...] = ()
    why_not: str | None = None

    def to_json(self) -> dict[str, Any]:
        """One entry of ``candidates``."""
        return {
            "effect": self.effect,
            "probability": self.probability,
            "heldout_rmse_w": self.heldout_rmse_w,
            "parameters": {name: e.to_json() for name, e in self.parameters.items()},
            "evidence": {
                "z": self.z,
                "p_value": self.p_value,
                "rho": self.rho,
                "delta_log_likelihood": self.gain,
                "degrees_of_freedom": self.degrees_of_freedom,
            },
            "indistinguishable_from": list(self.indistinguishable_from),
            "testable": self.why_not is None,
            "why_not": self.why_not,
        }


@dataclass(frozen=True)
class Outside:
    """A shape that the catalogue does not have.

    Attributes:
        quantities: over which it runs, the telling one first.
        curve: (x, W) points over the first of them.
        name: slug under which it can be adopted.
        formula: its text.
        effect: the custom effect.
        z, rho: of the shape that showed it.
    """

    quantities: tuple[str, ...]
    curve: tuple[tuple[float, float], ...]
    name: str
    formula: str
    effect: type[Effect]
    z: float
    rho: float

    def to_json(self) -> dict[str, Any]:
        """Design's ``outside_catalogue``."""
        return {
            "quantities": list(self.quantities),
            "shape": [[x, w] for x, w in self.curve],
            "formula": self.formula,
            "name": self.name,
            "definition": dict(self.effect.definition or {}),
            "evidence": {"z": self.z, "rho": self.rho},
        }


@dataclass(frozen=True)
class SensorFault:
    """A sensor whose error explains the residual."""

    kind: str
    value: float
    stderr: float
    unit: str
    sentence: str

    def to_json(self) -> dict[str, Any]:
        """One entry of ``sensor``."""
        return {**asdict(self), "stderr": _number(self.stderr)}


@dataclass(frozen=True)
class NotTestable:
    """An effect that is not identifiable from this log.

    Attributes:
        effect: slug.
        why: in words.
        what_would_help: a drive, a column or a measurement, in words.
        cause: what the reason has in common with those of other effects.
        size: what is special to this one, such as "up to 0.26 W"; or "".
    """

    effect: str
    why: str
    what_would_help: str
    cause: str = ""
    size: str = ""

    def to_json(self) -> dict[str, Any]:
        """One entry of ``not_testable``."""
        return asdict(self)


@dataclass(frozen=True)
class Experiment:
    """What to measure next: a drive, or a quantity to log.

    Attributes:
        separates: slugs that it tells apart, or whose interval it halves.
        run: what to do, in words.
        settings: of a drive, SI (telemetry.diagnosis.advice.drives); {} for a quantity to log.
        minutes: that a drive takes, changes of load and temperature included.
        gain: bits; the standard error of what is asked falls by a factor of 2 to this power.
    """

    separates: tuple[str, ...]
    run: str
    settings: Mapping[str, Any]
    minutes: float = 0.0
    gain: float = 0.0

    def to_json(self, number: int = 1) -> dict[str, Any]:
        """One entry of ``experiments``; ``number`` counts its drives from 1."""
        file = f"drive{'' if number == 1 else f'-{number}'}.csv" if self.settings else None
        return {**asdict(self), "separates": list(self.separates), "file": file}

    @classmethod
    def documents(cls, experiments: Sequence[Experiment]) -> list[dict[str, Any]]:
        """The entry ``experiments``: each with the name of its command file."""
        numbers = itertools.accumulate(bool(e.settings) for e in experiments)
        return [e.to_json(k) for e, k in zip(experiments, numbers, strict=True)]


@dataclass(frozen=True, kw_only=True)
class FittedModels:
    """The models that a diagnosis fitted.

    Attributes:
        base: the model fitted without what was selected.
        fitted: the model with everything that the diagnosis proposes, fitted.
        additions: name → how to add it, for all that could be adopted.
        corrected: the rows that the models were fitted to, without the errors of sensors.
        refused: None; where the model as stated beats its fit on held-out runs, both errors.
    """

    base: PowerModel
    fitted: Fit
    additions: Mapping[str, Addition]
    corrected: Telemetry
    refused: RefusedFit | None = None


@dataclass(frozen=True, kw_only=True)
class Diagnosis(FittedModels, Shown):
    """The answer to: which effect is missing?

    Attributes:
        verdict: what was found.
        selected: slugs to adopt, strongest first; () when none.
        sentence: the verdict in words.
        baseline, after: errors of the model as it is (fitted) and with what was selected.
        candidates: every effect that competed, best first.
        not_testable: effects that are not identifiable from the log, and what would help.
        regimes: where the residual has structure.
        unexplained: what the answer leaves: held-out error over the noise floor, and where.
        outside: a formula outside the catalogue, or None.
        sensors: faulty sensors.
        experiments: what to measure next, best first.
        log: source, hash, rows, runs, findings.
        pictures: what a person looks at to believe it.
    """

    verdict: Verdict
    selected: tuple[str, ...]
    sentence: str = ""
    baseline: Errors
    after: Errors
    candidates: tuple[Candidate, ...]
    not_testable: tuple[NotTestable, ...]
    regimes: tuple[Regime, ...]
    unexplained: Unexplained
    outside: Outside | None
    sensors: tuple[SensorFault, ...]
    experiments: tuple[Experiment, ...]
    log: Mapping[str, Any]
    pictures: Pictures

    @property
    def nbytes(self) -> int:
        """Bytes that it takes, about: its rows, and what fits and pictures made of them."""
        return 8 * self.corrected.rows.nbytes

    @property
    def meter(self) -> Meter | None:
        """What the power was read from; None shows the power as it is."""
        return self.corrected.meter_as_logged

    @property
    def model(self) -> PowerModel:
        """The model with everything that ``selected`` and ``outside`` propose, fitted."""
        return self.fitted.model

    @property
    def proposed(self) -> tuple[str, ...]:
        """Names of everything to adopt: ``selected``, and the formula of ``outside``."""
        return (*self.selected, *((self.outside.name,) if self.outside else ()))

    def to_frame(self) -> pandas.DataFrame:
        """The ranking of candidates as a DataFrame, best first.

        Columns are ``effect``, ``selected``, ``probability``, ``heldout_rmse_w``, the numbers of
        ``evidence`` in the JSON document, ``indistinguishable_from`` and ``why_not``.
        """
        documents = [candidate.to_json() for candidate in self.candidates]
        return frame(
            {
                "effect": one["effect"],
                "selected": one["effect"] in self.selected,
                **{key: one[key] for key in ("probability", "heldout_rmse_w")},
                **one["evidence"],
                "indistinguishable_from": ", ".join(one["indistinguishable_from"]),
                "why_not": one["why_not"],
            }
            for one in documents
        )

    @property
    def showable(self) -> tuple[int, int]:
        """How many effects of the catalogue the log could have shown, and of how many."""
        unseen = {n.effect for n in self.not_testable if not n.cause.startswith(HINTED)}
        every = {c.effect for c in self.candidates} | unseen
        return len(every - unseen), len(every)

    @property
    def shows_nothing(self) -> bool:
        """Whether the log is too short or too uniform to show any effect, and shows no misfit."""
        little = self.unexplained.little and not self.proposed and not self.sensors
        return little and not self.showable[0]

    def to_json(self) -> dict[str, Any]:
        """The document of ``joulepath diagnose --json``."""
        return {
            "verdict": self.verdict,
            "selected": list(self.selected),
            "sentence": self.sentence,
            "baseline": self.baseline.to_json(),
            "after": self.after.to_json(),
            "candidates": [c.to_json() for c in self.candidates],
            "not_testable": [n.to_json() for n in self.not_testable],
            "regimes": [r.to_json() for r in self.regimes],
            "unexplained": self.unexplained.to_json(),
            "outside_catalogue": None if self.outside is None else self.outside.to_json(),
            "sensor": [s.to_json() for s in self.sensors] or None,
            "experiments": Experiment.documents(self.experiments),
            "model": self.base.describe(),
            "log": dict(self.log),
            "refused_fit": None if self.refused is None else self.refused.to_json(),
            "meter": None if self.meter is None else self.meter.to_json(),
            "pictures": self.pictures.to_json(),
        }


def _number(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else value
