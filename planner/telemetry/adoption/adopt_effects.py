"""Adopt effects into a model: a new version, with its data and its errors before and after.

    adoption = adopt("air_drag", "drive.csv", "minibalance")
    adoption.model.save("minibalance-2.json")
    adoption.before.heldout_rmse_w, adoption.after.heldout_rmse_w, adoption.warnings

Effects that a log does not support can be adopted too; the warnings then say why not to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.cancellation import CancellationToken
from planner.errors import ModelError
from planner.power.catalogue import all_effects, find_effect, is_effect
from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle
from planner.progress import Progress, silent
from planner.shown import Shown, frame
from planner.telemetry.adoption.versions import history, new_version, rmse_of
from planner.telemetry.diagnosis import Diagnosis, Errors, diagnose_source
from planner.telemetry.estimation import Fit, FittedParameter
from planner.telemetry.holdout import heldout_residual, rms
from planner.telemetry.logs import LogLike, MappingLike
from planner.telemetry.other_terms import given_columns
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import open_source
from planner.telemetry.single_core import single_core
from planner.telemetry.starting_model import starting_model
from planner.telemetry.terms import fit_with

if TYPE_CHECKING:
    import pandas

DIAGNOSED = "diagnosed"
"""Name for everything that a diagnosis of the log selects and proposes."""
CLEAR_FALL = 0.99
"""Held-out error after over before; above it, adoption warns that the error does not fall."""

Wanted = str | type[Effect]


@dataclass(frozen=True)
class Adoption(Shown):
    """A new version of a model and what speaks for it.

    Attributes:
        model: the new version.
        adopted: slugs.
        before, after: errors without and with the effects, both fitted to the log.
        parameters: the fitted ones.
        warnings: why one should hesitate.
        diagnosis: of the log, from which all this comes.
    """

    model: PowerModel
    adopted: tuple[str, ...]
    before: Errors
    after: Errors
    parameters: tuple[FittedParameter, ...]
    warnings: tuple[str, ...]
    diagnosis: Diagnosis

    def to_frame(self) -> pandas.DataFrame:
        """The fitted parameters as a DataFrame, one row each, as in the JSON document."""
        names = [one.name for one in fields(FittedParameter)]
        return frame((asdict(parameter) for parameter in self.parameters), names)

    def to_json(self) -> dict[str, Any]:
        """The document of ``joulepath adopt --json``."""
        return {
            "model": self.model.describe(),
            "adopted": list(self.adopted),
            "before": rmse_of(self.before),
            "after": rmse_of(self.after),
            "noise_floor_w": self.before.noise_floor_w,
            "warnings": list(self.warnings),
            "parameters": [
                {**asdict(p), "stderr": p.stderr if np.isfinite(p.stderr) else None}
                for p in self.parameters
            ],
            "history": history(self.model),
        }


@single_core()
def adopt(
    effects: Wanted | Sequence[Wanted],
    log: LogLike,
    model: PowerModel | Vehicle | str | Path,
    *,
    mapping: MappingLike | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Adoption:
    """Add effects to a model and fit everything to a log.

    Args:
        effects: slugs, custom effects, the name of the formula that a diagnosis of this log
            proposes, or "diagnosed" for all that it selects and proposes.
        log, model, mapping, progress, cancelled: as
        planner.telemetry.diagnosis.diagnose_log.diagnose.

    Raises:
        ModelError: an effect that does not exist, or that the model has already.
        LogError, VehicleError: something given cannot be used.
        Cancelled: ``cancelled`` said so.
    """
    if isinstance(effects, str | type) or not isinstance(effects, Iterable):
        wanted: list[Wanted] = [effects]
    else:
        wanted = list(effects)
    start = starting_model(model)
    _check_names(wanted, start)
    custom = [e for e in wanted if isinstance(e, type)]
    report = progress or silent
    watch = CancellationToken(cancelled).watched(
        lambda share, sentence: report(0.9 * share, sentence)
    )
    source = open_source(log, mapping, watch)
    diagnosis = diagnose_source(source, start, custom, watch)
    names = _names(wanted, diagnosis)
    additions = [diagnosis.additions[name] for name in names]
    watch(1.0, "fitting the new version")
    if set(names) == set(diagnosis.proposed):
        fitted, after = diagnosis.fitted, diagnosis.after
    else:
        base, corrected = diagnosis.base, diagnosis.corrected
        unsure = given_columns(corrected, base, predict(base, corrected))
        noise = diagnosis.fitted.noise
        fitted = fit_with(base, corrected, additions, noise=noise, unsure=unsure)
        after = Errors(fitted.rmse_w, rms(heldout_residual(diagnosis.corrected, fitted)))
    warnings = _warnings(names, diagnosis, after, fitted)
    new = new_version(start, fitted, names, diagnosis, after, warnings)
    errors = diagnosis.baseline, after
    return Adoption(new, tuple(names), *errors, fitted.parameters, tuple(warnings), diagnosis)


def _check_names(wanted: Sequence[Wanted], start: PowerModel) -> None:
    has = {effect.slug for effect in start.effects}
    if not wanted:
        raise ModelError("effect", "none was given", accepted=", ".join(all_effects()))
    for one in wanted:
        if not isinstance(one, str) and not is_effect(one):
            accepted = f"{', '.join(all_effects())}, or a custom effect"
            raise ModelError("effect", "is no effect", value=repr(one), accepted=accepted)
        slug = one if isinstance(one, str) else one.slug
        if slug in has:
            raise ModelError(
                "effect", "the model has it already", value=slug, accepted="another effect"
            )
        if isinstance(one, str) and one != DIAGNOSED and not one.startswith("unknown_"):
            find_effect(one)


def _names(wanted: Sequence[Wanted], diagnosis: Diagnosis) -> list[str]:
    names: list[str] = []
    for one in wanted:
        slug = one if isinstance(one, str) else one.slug
        if slug == DIAGNOSED:
            names += diagnosis.proposed
            if not diagnosis.proposed:
                raise ModelError(
                    "effect",
                    "the diagnosis of this log proposes nothing",
                    value=DIAGNOSED,
                    accepted=f"an effect by name; what it says: {diagnosis.sentence}",
                )
        elif slug in diagnosis.additions:
            names.append(slug)
        else:
            raise ModelError(
                "effect",
                "is not what the diagnosis of this log proposes",
                value=slug,
                accepted=", ".join(diagnosis.additions),
            )
    return list(dict.fromkeys(names))


def _warnings(names: Sequence[str], diagnosis: Diagnosis, after: Errors, fitted: Fit) -> list[str]:
    warnings = []
    candidates = {c.effect: c for c in diagnosis.candidates}
    for name in names:
        candidate = candidates.get(name)
        if name in diagnosis.proposed:
            if candidate is not None and candidate.indistinguishable_from:
                aliases = ", ".join(candidate.indistinguishable_from)
                warnings.append(f"{name}: aliased in this log with {aliases}")
        elif candidate is None or candidate.why_not is not None:
            why = candidate.why_not if candidate else "it was not among the candidates"
            warnings.append(f"{name}: this log cannot support it: {why}")
        elif not candidate.parameters:
            warnings.append(f"{name}: this log asks for a sign or size that it cannot have")
        else:
            warnings.append(
                f"{name}: this log does not call for it (it would add {candidate.rho:.2g} of the "
                f"noise, z = {candidate.z:.1f})"
            )
    before = diagnosis.baseline
    if after.heldout_rmse_w > CLEAR_FALL * before.heldout_rmse_w:
        warnings.append(
            f"the held-out error does not fall: {before.heldout_rmse_w:.3g} W before, "
            f"{after.heldout_rmse_w:.3g} W after"
        )
    for sensor in diagnosis.sensors:
        warnings.append(
            f"{sensor.sentence}: the parameters were fitted to the log corrected for that"
        )
    for parameter in fitted.parameters:
        if parameter.effect in names and parameter.note:
            warnings.append(f"{parameter.effect}.{parameter.name}: {parameter.note}")
    return warnings
