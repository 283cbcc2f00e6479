"""Sentences about the workbench's results, the same in terminals, pages and notebooks.

Documents are those of ``to_json``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from planner.amounts import watts

Document = Mapping[str, Any]


def model_name(model: Document) -> str:
    """Name and version of a model's description."""
    return f"{model['name']}, version {model['version']}"


def proposed(diagnosis: Document) -> list[str]:
    """Names of everything that a diagnosis proposes to adopt."""
    outside = diagnosis.get("outside_catalogue") or {}
    return [*diagnosis["selected"], *filter(None, [outside.get("name")])]


def excess(energy: Document) -> float | None:
    """Predicted energy over the measured one, minus 1; None where nothing was measured."""
    measured, predicted = energy["measured_j"], energy["predicted_j"]
    return float(predicted / measured - 1) if measured else None


def how_far(comparison: Document) -> str:
    """What a comparison says, what the meter does, and whether the fit is refused."""
    fitted = ", fitted to this log," if comparison.get("fitted") else ""
    heldout = f", {watts(comparison['heldout_rmse_w'])} on held-out runs" if fitted else ""
    said = (
        f"The model {model_name(comparison['model'])}{fitted} misses the measured power by "
        f"{watts(comparison['rmse_w'])} rms{heldout}; the log's own noise is about "
        f"{watts(comparison['noise_floor_w'])}."
    )
    refused = comparison.get("refused_fit") or {}
    meter = comparison.get("meter") or {}
    shown = f"{meter['sentence']}." if meter else None
    return " ".join(filter(None, [said, shown, refused.get("sentence")]))


def what_came_of_it(adoption: Document) -> str:
    """What an adoption says, in one sentence."""
    before, after = adoption["before"], adoption["after"]
    return (
        f"Adopted {', '.join(adoption['adopted'])}: held-out error "
        f"{watts(before['heldout_rmse_w'])} → {watts(after['heldout_rmse_w'])}, the log's own "
        f"noise is about {watts(adoption['noise_floor_w'])}; this is "
        f"{model_name(adoption['model'])}."
    )


def how_it_came_about(model: Document, entries: Sequence[Document]) -> str:
    """What a model's history says, in one sentence."""
    if not entries:
        return f"{model_name(model)} has no history: nothing was adopted yet."
    first = entries[0].get("before") or entries[0].get("after") or {}
    last = entries[-1].get("after") or {}
    sentence = f"{model_name(model)}, {len(entries)} versions known"
    if first.get("heldout_rmse_w") is not None and last.get("heldout_rmse_w") is not None:
        start, end = watts(first["heldout_rmse_w"]), watts(last["heldout_rmse_w"])
        sentence += f": held-out error {start} → {end}"
    return sentence + "."


def about(experiment: Document) -> str:
    """What a recommendation is for, before its sentence."""
    names = list(experiment["separates"])
    if not names:
        return ""
    if len(names) == 1:
        return f"To know {names[0]} better: "
    return f"To tell {', '.join(names[:-1])} and {names[-1]} apart: "


def not_testable(entries: Iterable[Document]) -> dict[tuple[str, str], list[str]]:
    """Why, and what would help → effects of which that is true."""
    alike: dict[tuple[str, str], list[str]] = {}
    for entry in entries:
        reason = (entry["why"], entry.get("what_would_help") or "")
        alike.setdefault(reason, []).append(entry["effect"])
    return alike
