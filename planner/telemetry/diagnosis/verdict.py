"""The verdict of a diagnosis, and its sentence.

    verdict = verdict_of(faulty=False, formula=False, named=True, lost=False)
    diagnosis = replace(diagnosis, sentence=sentence_of(diagnosis, near=()))
    diagnosis = never_complete_with_structure(diagnosis)

The last is a gate. A model is not complete where one regime holds much of the squared error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from planner.telemetry.diagnosis.results import Diagnosis, Verdict
from planner.telemetry.regimes import Regime

LEAST_STRUCTURE = 0.1
"""Share of the squared error in one regime from which a model is not called complete.

A regime is listed only where chance does not explain it. Below a tenth, users would be sent after
structure that hardly changes the energy of a route."""


def verdict_of(*, faulty: bool, formula: bool, named: bool, lost: bool) -> Verdict:
    """The verdict with the highest precedence.

    Args:
        faulty: an error of a sensor explains the residual.
        formula: a formula outside the catalogue is proposed.
        named: effects of the catalogue are selected.
        lost: there is a misfit that nothing explains.
    """
    if faulty:
        return "sensor_error"
    if formula:
        return "outside_catalogue"
    if named:
        return "missing_effect"
    return "not_identifiable" if lost else "complete"


def never_complete_with_structure(diagnosis: Diagnosis) -> Diagnosis:
    """``complete`` becomes ``not_identifiable`` where a regime holds much of the squared error."""
    if diagnosis.verdict != "complete" or _structure(diagnosis) is None:
        return diagnosis
    doubted = replace(diagnosis, verdict="not_identifiable")
    return replace(doubted, sentence=sentence_of(doubted))


def sentence_of(diagnosis: Diagnosis, near: Sequence[str] = ()) -> str:
    """The verdict in words, then whether the fit of the base model was refused.

    Args:
        diagnosis: everything but its sentence.
        near: effects that would look the same as what cannot be attributed.
    """
    verdict = _verdict_in_words(diagnosis, near)
    meter = None if diagnosis.meter is None else f"{diagnosis.meter.sentence}."
    refused = None if diagnosis.refused is None else diagnosis.refused.sentence
    return " ".join(filter(None, [verdict, meter, refused]))


def _structure(diagnosis: Diagnosis) -> Regime | None:
    """The regime with the largest share of the squared error, if that is a large one."""
    largest = max(diagnosis.regimes, key=lambda r: r.share_of_squared_error, default=None)
    if largest is None or largest.share_of_squared_error < LEAST_STRUCTURE:
        return None
    return largest


def _verdict_in_words(diagnosis: Diagnosis, near: Sequence[str]) -> str:
    before, after = diagnosis.baseline, diagnosis.after
    error = f"held-out error {before.heldout_rmse_w:.3g} W"
    if diagnosis.proposed:
        error += f" → {after.heldout_rmse_w:.3g} W"
    errors = f"{error}, noise {before.noise_floor_w or 0.0:.3g} W"
    names = " and ".join(diagnosis.selected)
    if diagnosis.verdict == "sensor_error":
        faults = "; ".join(s.sentence for s in diagnosis.sensors)
        rest = f"; in addition, {names} is missing" if names else ""
        return f"A sensor is wrong rather than the model: {faults}{rest}."
    if diagnosis.outside is not None:
        over = " and ".join(diagnosis.outside.quantities).replace("_", " ")
        further = f" in addition to {names}" if names else ""
        return (
            f"Something outside the catalogue is missing{further}, over {over}: "
            f"{diagnosis.outside.formula} ({errors})."
        )
    if diagnosis.verdict == "missing_effect":
        aliases = {
            alias
            for c in diagnosis.candidates
            if c.effect in diagnosis.selected
            for alias in c.indistinguishable_from
        }
        aliased = f"; aliased in this log with {', '.join(sorted(aliases))}" if aliases else ""
        # Named all the same, so the loss of single rows fell.
        unsure = (
            "; most rows improve, but not a few that small errors of the speeds decide"
            if after.heldout_rmse_w >= before.heldout_rmse_w
            else ""
        )
        return f"Missing: {names} ({errors}){aliased}{unsure}."
    if diagnosis.verdict == "not_identifiable":
        structure = _structure(diagnosis)
        where = f", most of all {structure.sentence}" if structure else ""
        like = f": {', '.join(near)} would look the same" if near else ""
        return f"Something is missing{where}; this log cannot attribute it{like} ({errors})."
    return f"Nothing is missing that this log could show ({errors})."
