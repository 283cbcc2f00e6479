"""Take effects into a model: a new version, with the data and the errors that speak for it.

    adoption = adopt("air_drag", "drive.csv", "minibalance")
    adoption.model.save("minibalance-2.json")
    adoption.before.heldout_rmse_w, adoption.after.heldout_rmse_w, adoption.warnings
    older = revert(adoption.model, 1)                     # a version too

What a log does not support can be adopted as well; the warnings then say why one should not. The
history of a model holds every version whole, so that any of them can be brought back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import ModelError
from planner.power.catalogue import all_effects, find_effect
from planner.power.effect import Effect
from planner.power.model import PowerModel
from planner.power.vehicle import Vehicle
from planner.shown import Shown
from planner.telemetry.diagnosis import Diagnosis, Errors
from planner.telemetry.energy_error import energy_error
from planner.telemetry.extend import Addition, fit_with
from planner.telemetry.fit import Fit, FittedParameter, starting_model
from planner.telemetry.heldout import heldout_rmse
from planner.telemetry.log import Telemetry
from planner.telemetry.rank_effects import diagnose_source
from planner.telemetry.sample import open_source

DIAGNOSED = "diagnosed"
"""Stands for everything that a diagnosis of the log selects and proposes."""
LEAST_GAIN = 0.99
"""Held-out error that does not fall below this share of what it was has not fallen."""

SNAPSHOT = ("custom", "surfaces", "stderr", "covariance", "energy_error")
"""What a version keeps beside its effects."""

Progress = Callable[[float, str], None]
Cancel = Callable[[], bool]
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

    def to_json(self) -> dict[str, Any]:
        """The document of ``joulepath adopt --json``."""
        return {
            "model": self.model.describe(),
            "adopted": list(self.adopted),
            "before": _rmse(self.before),
            "after": _rmse(self.after),
            "noise_floor_w": self.before.noise_floor_w,
            "warnings": list(self.warnings),
            "parameters": [
                {
                    "effect": p.effect,
                    "name": p.name,
                    "element": p.element,
                    "value": p.value,
                    "stderr": p.stderr if np.isfinite(p.stderr) else None,
                    "unit": p.unit,
                    "identifiable": p.identifiable,
                    "note": p.note,
                }
                for p in self.parameters
            ],
            "history": history(self.model),
        }


def adopt(
    effects: Wanted | Sequence[Wanted],
    log: Telemetry | str | Path,
    model: PowerModel | Vehicle | str | Path,
    *,
    mapping: str | Path | None = None,
    progress: Progress | None = None,
    cancelled: Cancel | None = None,
) -> Adoption:
    """Add effects to a model and fit everything to a log.

    Args:
        effects: slugs, custom effects, the name of the formula that a diagnosis of this log
            proposes, or "diagnosed" for all that it selects and proposes.
        log, model, mapping, progress, cancelled: as planner.telemetry.rank_effects.diagnose.

    Raises:
        ModelError: an effect that does not exist, or that the model has already.
        LogError, VehicleError: something given cannot be used.
        Cancelled: ``cancelled`` said so.
    """
    wanted = [effects] if isinstance(effects, str | type) else list(effects)
    start = starting_model(model)
    custom = [e for e in wanted if isinstance(e, type)]
    _check_names(wanted, start)
    source = open_source(log, mapping, progress=progress, cancelled=cancelled)

    def watch(share: float, sentence: str) -> None:
        from planner.errors import Cancelled

        if cancelled is not None and cancelled():
            raise Cancelled("the adoption was cancelled")
        if progress is not None:
            progress(0.9 * share, sentence)

    diagnosis = diagnose_source(source, start, extra=custom, watch=watch)
    names = _names(wanted, diagnosis)
    additions = [_addition(name, diagnosis) for name in names]
    watch(1.0, "fitting the new version")
    if set(names) == set(diagnosis.proposed):
        fitted, after = diagnosis.fitted, diagnosis.after
    else:
        fitted = fit_with(
            diagnosis.base, diagnosis.corrected, additions, noise=diagnosis.fitted.noise, tried=True
        )
        after = Errors(fitted.rmse_w, heldout_rmse(diagnosis.corrected, fitted))
    warnings = _warnings(names, diagnosis, after, fitted)
    new = _new_version(start, fitted, names, diagnosis, after, warnings)
    return Adoption(
        new,
        tuple(names),
        diagnosis.baseline,
        after,
        fitted.parameters,
        tuple(warnings),
        diagnosis,
    )


def revert(model: PowerModel, version: int) -> PowerModel:
    """A new version that is as an earlier one was.

    Raises:
        ModelError: the model's history has no such version.
    """
    entries = {int(entry["version"]): entry for entry in model.history}
    if version not in entries:
        raise ModelError(
            "version",
            "is not in the model's history",
            value=version,
            accepted=", ".join(str(v) for v in entries) or "a model that adopt has written",
        )
    old = entries[version]
    snapshot = old["snapshot"]
    restored = PowerModel.from_document(
        {
            **model.document(),
            "effects": old["effects"],
            "custom": snapshot["custom"],
            "surfaces": snapshot["surfaces"],
            "stderr": snapshot["stderr"],
            # Versions of older files say nothing of them.
            "covariance": snapshot.get("covariance"),
            "energy_error": snapshot.get("energy_error"),
        }
    )
    entry = {
        **_entry(restored, model.version + 1, _label(model), "revert"),
        "reverted_to": version,
        "log": old["log"],
        "before": model.history[-1]["after"],
        "after": old["after"],
        "noise_floor_w": old["noise_floor_w"],
    }
    return replace(
        restored,
        version=model.version + 1,
        parent=_label(model),
        history=(*model.history, entry),
    )


def history(model: PowerModel) -> list[dict[str, Any]]:
    """Every version of a model, oldest first, without the snapshots that revert needs."""
    return [{k: v for k, v in entry.items() if k != "snapshot"} for entry in model.history]


def _rmse(errors: Errors) -> dict[str, Any]:
    return {"rmse_w": errors.rmse_w, "heldout_rmse_w": errors.heldout_rmse_w}


def _check_names(wanted: Sequence[Wanted], start: PowerModel) -> None:
    has = {effect.slug for effect in start.effects}
    if not wanted:
        raise ModelError("effect", "none was given", accepted=", ".join(all_effects()))
    for one in wanted:
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


def _addition(name: str, diagnosis: Diagnosis) -> Addition:
    return diagnosis.additions[name]


def _warnings(names: Sequence[str], diagnosis: Diagnosis, after: Errors, fitted: Fit) -> list[str]:
    warnings = []
    candidates = {c.effect: c for c in diagnosis.candidates}
    for name in names:
        candidate = candidates.get(name)
        if name in diagnosis.proposed:
            if candidate is not None and candidate.indistinguishable_from:
                rivals = ", ".join(candidate.indistinguishable_from)
                warnings.append(f"{name}: this log cannot tell it from {rivals}")
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
    if after.heldout_rmse_w > LEAST_GAIN * before.heldout_rmse_w:
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


def _label(model: PowerModel) -> str:
    return f"{model.name} v{model.version}"


def _entry(model: PowerModel, version: int, parent: str | None, action: str) -> dict[str, Any]:
    document = model.document()
    return {
        "version": version,
        "parent": parent,
        "action": action,
        "adopted": [],
        "effects": document["effects"],
        "warnings": [],
        "at": datetime.now(UTC).isoformat(timespec="seconds"),
        "snapshot": {key: document[key] for key in SNAPSHOT},
    }


def _new_version(
    start: PowerModel,
    fitted: Fit,
    names: Sequence[str],
    diagnosis: Diagnosis,
    after: Errors,
    warnings: Sequence[str],
) -> PowerModel:
    log: Mapping[str, Any] = diagnosis.log
    data = {
        "source": Path(str(log["source"])).name,
        "sha256": log["sha256"],
        "rows": log["rows"],
        "runs": log["runs"],
    }
    floor = diagnosis.baseline.noise_floor_w
    covariance, error = energy_error(diagnosis.corrected, fitted)
    model = replace(fitted.model, covariance=covariance, energy_error=error)
    past = start.history
    if not past:
        action = "fit" if diagnosis.refused is None else "stated"
        first = {
            **_entry(diagnosis.base, start.version, None, action),
            "log": data,
            "before": None,
            "after": _rmse(diagnosis.baseline),
            "noise_floor_w": floor,
        }
        past = (first,)
    entry = {
        **_entry(model, start.version + 1, _label(start), "adopt"),
        "adopted": list(names),
        "log": data,
        "before": _rmse(diagnosis.baseline),
        "after": _rmse(after),
        "noise_floor_w": floor,
        "warnings": list(warnings),
    }
    return replace(
        model,
        name=start.name,
        version=start.version + 1,
        parent=_label(start),
        history=(*past, entry),
    )
