"""Versions of a model, each stored whole so that it can be restored.

for entry in history(model): ...       # oldest first
older = revert(model, 1)               # a version too
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from planner.errors import ModelError
from planner.power.model import PowerModel
from planner.telemetry.diagnosis import Diagnosis, Errors
from planner.telemetry.estimation import Fit, energy_error

SNAPSHOT = ("custom", "surfaces", "stderr", "covariance", "energy_error")
"""Keys of a model's document that a version stores beside its effects."""


def revert(model: PowerModel | str | Path, version: int) -> PowerModel:
    """A new version that is as an earlier one was.

    Args:
        model: a model, or its .json file.
        version: as its history numbers it.

    Raises:
        ModelError: the file cannot be used, or the model's history has no such version.
    """
    model = model if isinstance(model, PowerModel) else PowerModel.load(model)
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
    # Older files have no covariance and no energy error.
    kept = {key: snapshot.get(key) for key in SNAPSHOT}
    restored = PowerModel.from_document({**model.document(), "effects": old["effects"], **kept})
    entry = {
        **_entry(restored, model.version + 1, _label(model), "revert"),
        "reverted_to": version,
        "log": old["log"],
        "before": model.history[-1]["after"],
        "after": old["after"],
        "noise_floor_w": old["noise_floor_w"],
    }
    return _next_version(restored, model, (*model.history, entry))


def history(model: PowerModel) -> list[dict[str, Any]]:
    """Every version of a model, oldest first, without the snapshots that revert needs."""
    return [{k: v for k, v in entry.items() if k != "snapshot"} for entry in model.history]


def rmse_of(errors: Errors) -> dict[str, Any]:
    """Both errors of a version, ready for JSON."""
    return {"rmse_w": errors.rmse_w, "heldout_rmse_w": errors.heldout_rmse_w}


def _next_version(
    model: PowerModel, before: PowerModel, entries: tuple[Mapping[str, Any], ...]
) -> PowerModel:
    version, parent = before.version + 1, _label(before)
    return replace(model, version=version, parent=parent, history=entries)


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


def new_version(
    start: PowerModel,
    fitted: Fit,
    names: Sequence[str],
    diagnosis: Diagnosis,
    after: Errors,
    warnings: Sequence[str],
) -> PowerModel:
    """A fitted model as the next version of the one that it started from.

    Args:
        start: the version before.
        fitted: with what was adopted.
        names: of that.
        diagnosis: of the log.
        after: errors of ``fitted``.
        warnings: why one should hesitate.
    """
    log = diagnosis.log
    data = {key: log[key] for key in ("source", "sha256", "rows", "runs")}
    data["source"] = Path(str(log["source"])).name
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
            "after": rmse_of(diagnosis.baseline),
            "noise_floor_w": floor,
        }
        past = (first,)
    entry = {
        **_entry(model, start.version + 1, _label(start), "adopt"),
        "adopted": list(names),
        "log": data,
        "before": rmse_of(diagnosis.baseline),
        "after": rmse_of(after),
        "noise_floor_w": floor,
        "warnings": list(warnings),
    }
    return _next_version(replace(model, name=start.name), start, (*past, entry))
