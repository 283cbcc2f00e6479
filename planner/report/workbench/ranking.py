"""A diagnosis's candidates on a page: those worth a look, and the statistics of their tests."""

from __future__ import annotations

from typing import Any

from planner.amounts import estimate, finite, watts
from planner.power.catalogue import all_effects
from planner.report.markup import (
    Markup,
    element,
    figure,
    folded,
    joined,
    paragraph,
    plain,
    section,
    table,
)
from planner.report.workbench.bars import MOST_CANDIDATES
from planner.report.workbench_wording import could_be_missing, error_without, likelihood
from planner.telemetry.diagnosis import Candidate, Diagnosis


def shown_candidates(diagnosis: Diagnosis) -> tuple[dict[str, Candidate], int]:
    """Slug → candidate of those worth a look, best first, and how many are left out."""
    known = {c.effect: c for c in diagnosis.candidates}
    shown, left_out = could_be_missing(_ranked(diagnosis))
    return {c["effect"]: known[c["effect"]] for c in shown}, left_out


def without_any(diagnosis: Diagnosis) -> float:
    """W, error on unseen runs that the candidates are compared with."""
    return error_without(_ranked(diagnosis))


def chances(diagnosis: Diagnosis) -> dict[str, str]:
    """Slug → probability in words; {} where probabilities mean nothing."""
    if not likely(diagnosis):
        return {}
    ranked = _ranked(diagnosis)
    return {c["effect"]: likelihood(c, ranked) for c in ranked["candidates"]}


def likely(diagnosis: Diagnosis) -> bool:
    """Whether the candidates' probabilities mean something: not when all of them were ruled out."""
    return diagnosis.outside is None or bool(diagnosis.selected)


def ranking(diagnosis: Diagnosis, drawing: str) -> Markup:
    """The candidates that lower the error, and the statistics of their tests, folded."""
    shown, left_out = shown_candidates(diagnosis)
    known_as = chances(diagnosis)
    heading = "What could be missing" if diagnosis.selected else "Effects that were tried"
    others = (
        f"Left out because the error on unseen runs does not fall: {left_out}." if left_out else ""
    )
    if not shown:
        return section(heading, paragraph(others)) if others else Markup("")
    columns = ["probability"] * bool(known_as) + ["error with it"]
    aliased = any(bool(c.indistinguishable_from) for c in shown.values())
    heads = ["effect", *columns, "parameters", *["tied with"] * aliased]
    cells = [_candidate(c, known_as.get(c.effect, "")) for c in shown.values()]
    rows = [[row[head] for head in heads] for row in cells]
    words = (0, *range(1 + len(columns), len(heads)))
    first, rest = rows[:MOST_CANDIDATES], rows[MOST_CANDIDATES:]
    strong = [k for k, c in enumerate(shown.values()) if c.effect in diagnosis.selected]
    tests = ["effect", "size / noise", "z", "p"]
    statistics = table("", tests, [[row[head] for head in tests] for row in cells], words=(0,))
    probability = (
        "Probability: that the effect is missing, if one to three of these may be. "
        if known_as
        else "No probabilities: none of these explains the residual. "
    )
    together = (
        " The error with a named effect is that with all named ones."
        if len(diagnosis.selected) > 1
        else ""
    )
    size = "Size: what it adds to the power, rms, over the noise. z and p: of its test alone."
    return section(
        heading,
        figure(drawing),
        table("", heads, first, words=words, strong=strong),
        folded(f"{len(rest)} less likely ones", table("", heads, rest, words=words)),
        paragraph(probability + others + together, "note"),
        folded("statistics of the tests", statistics, paragraph(size, "note")),
    )


def aliases(diagnosis: Diagnosis) -> list[str]:
    """Selected effects and their aliases."""
    return [
        f"This log cannot tell {c.effect} from {' or '.join(c.indistinguishable_from)}: "
        "each explains what the model misses equally well."
        for c in diagnosis.candidates
        if c.effect in diagnosis.selected and c.indistinguishable_from
    ]


def _ranked(diagnosis: Diagnosis) -> dict[str, Any]:
    return {
        "baseline": diagnosis.baseline.to_json(),
        "after": diagnosis.after.to_json(),
        "sensor": [fault.kind for fault in diagnosis.sensors],
        "selected": diagnosis.selected,
        "candidates": [c.to_json() for c in diagnosis.candidates],
    }


def _candidate(c: Candidate, chance: str) -> dict[str, object]:
    effect = all_effects().get(c.effect)
    title = joined(" ", element("small", effect.title)) if effect else ""
    fitted = [
        f"{n} = {estimate(p.value, finite(p.stderr), p.unit)}" for n, p in c.parameters.items()
    ]
    return {
        "effect": joined(element("b", c.effect), title),
        "probability": chance,
        "size / noise": f"{c.rho:.2g}",
        "z": f"{c.z:.1f}",
        "p": "< 1e-12" if c.p_value < 1e-12 else f"{c.p_value:.2g}",
        "error with it": watts(c.heldout_rmse_w),
        "parameters": Markup("<br/>".join(map(plain, fitted))),
        "tied with": ", ".join(c.indistinguishable_from),
    }
