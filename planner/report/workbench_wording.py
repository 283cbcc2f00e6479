"""Sentences about the workbench's results, the same in terminals, pages and notebooks.

Documents are those of ``to_json``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from planner.amounts import chance, joules, signed, watts

Document = Mapping[str, Any]

LIKELY = 0.5
"""Probability from which a table shows an effect as rather there than not."""


def model_name(model: Document) -> str:
    """Name and version of a model's description."""
    return f"{model['name']}, version {model['version']}"


def run_name(label: str) -> str:
    """A run's label in a sentence: run 10, but run07 and over the ridge."""
    return f"run {label}" if label.replace(".", "").isdigit() else label


def proposed(diagnosis: Document) -> list[str]:
    """Names of everything that a diagnosis proposes to adopt."""
    outside = diagnosis.get("outside_catalogue") or {}
    return [*diagnosis["selected"], *filter(None, [outside.get("name")])]


def excess(energy: Document) -> float | None:
    """Predicted energy over the measured one, minus 1; None where nothing was measured."""
    measured, predicted = energy["measured_j"], energy["predicted_j"]
    return float(predicted / measured - 1) if measured else None


RUN_HEADS = ("run", "rows", "measured", "predicted", "error", "rms", "bias")


def run_row(run: Document) -> list[str]:
    """Energy and power of one run of a log, as RUN_HEADS names them."""
    error = excess(run)
    return [
        str(run["run"]),
        f"{run['rows']:,}",
        joules(run["measured_j"]),
        joules(run["predicted_j"]),
        "" if error is None else f"{100 * error:+z.1f} %".replace("-", "−"),
        watts(run["rmse_w"]),
        signed(run["bias_w"]),
    ]


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
    apart = [f"{one[0].upper()}{one[1:]}." for one in comparison.get("apart") or ()]
    return " ".join(filter(None, [said, *apart, shown, refused.get("sentence")]))


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


def error_without(diagnosis: Document) -> float:
    """W, error on unseen runs that a candidate must lower: with sensors as right ones have it."""
    corrected = diagnosis.get("sensor") and not diagnosis["selected"]
    errors = diagnosis["after"] if corrected else diagnosis["baseline"]
    return float(errors["heldout_rmse_w"])


def could_be_missing(diagnosis: Document) -> tuple[list[Document], int]:
    """Candidates worth a look, and how many are left out.

    A candidate that is neither selected nor tied with one that is must lower the error on unseen
    runs, by as much as is shown.
    """
    before, selected = error_without(diagnosis), diagnosis["selected"]
    kept = {*selected, *_aliased(diagnosis)}
    able = [c for c in diagnosis["candidates"] if c.get("testable", True)]
    shown = [c for c in able if c["effect"] in kept or _lowers(c["heldout_rmse_w"], before)]
    shown.sort(key=lambda c: c["effect"] not in selected)
    return shown, len(able) - len(shown)


def _aliased(diagnosis: Document) -> set[str]:
    """Effects that explain the residual as well as a selected one."""
    chosen = [c for c in diagnosis["candidates"] if c["effect"] in diagnosis["selected"]]
    return {name for c in chosen for name in c["indistinguishable_from"]}


def _lowers(error: float | None, before: float) -> bool:
    return error is not None and error < before and watts(error) != watts(before)


def likelihood(candidate: Document, diagnosis: Document) -> str:
    """Probability of a candidate in words that the verdict does not contradict."""
    known = candidate["probability"]
    if candidate["effect"] not in diagnosis["selected"]:
        if candidate["effect"] in _aliased(diagnosis):
            return "tied"
        if known is not None and known >= LIKELY:
            return "not confirmed"
    return "not known" if known is None else chance(known)


def untestable(diagnosis: Document) -> dict[str, tuple[list[str], dict[str, list[str]]]]:
    """Cause → effects with their sizes, and what would help → effects that it helps."""
    causes: dict[str, tuple[list[str], dict[str, list[str]]]] = {}
    for entry in diagnosis.get("not_testable", ()):
        effects, helps = causes.setdefault(entry.get("cause") or entry["why"], ([], {}))
        size = entry.get("size")
        effects.append(f"{entry['effect']} ({size})" if size else entry["effect"])
        if help_ := entry.get("what_would_help"):
            helps.setdefault(help_, []).append(entry["effect"])
    return causes
