"""The verdict of a diagnosis, and its sentence.

verdict = verdict_of(faulty=False, formula=False, named=True, lost=False)
diagnosis = replace(diagnosis, sentence=sentence_of(diagnosis, alike=(), near=""))
"""

from __future__ import annotations

from collections.abc import Sequence

from planner.telemetry.diagnosis.results import Diagnosis, Verdict
from planner.telemetry.diagnosis.unexplained import MOST_OVER_FLOOR
from planner.telemetry.regimes import Regime


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


def sentence_of(diagnosis: Diagnosis, alike: Sequence[str] = (), near: str = "") -> str:
    """The verdict in words, how near it was, and whether the fit of the base model was refused.

    Args:
        diagnosis: everything but its sentence.
        alike: effects that would look the same as what cannot be attributed.
        near: what decided narrowly.
    """
    said = [_verdict_in_words(diagnosis, alike)]
    if near:
        said.append(f"This is a near decision: {near}.")
    if diagnosis.meter is not None:
        said.append(f"{diagnosis.meter.sentence}.")
    if diagnosis.refused is not None:
        said.append(diagnosis.refused.sentence)
    return " ".join(said)


def _structure(diagnosis: Diagnosis) -> Regime | None:
    """The regime that makes most of what stays unexplained, or of the residual as it was."""
    where = diagnosis.unexplained.where or diagnosis.regimes
    return max(where, key=lambda r: r.share_of_squared_error, default=None)


def _errors(diagnosis: Diagnosis) -> str:
    """Held-out errors and noise, and what stays unexplained."""
    before, after, rest = diagnosis.baseline, diagnosis.after, diagnosis.unexplained
    error = f"held-out error {before.heldout_rmse_w:.3g} W"
    if diagnosis.proposed or diagnosis.sensors:
        error += f" → {after.heldout_rmse_w:.3g} W"
    errors = f"{error}, noise {before.noise_floor_w or 0.0:.3g} W"
    if rest.heldout_over_floor <= MOST_OVER_FLOOR:
        return errors
    structure = _structure(diagnosis)
    most = f", most of all {structure.sentence}" if structure and diagnosis.proposed else ""
    return f"{errors}: {rest.heldout_over_floor:.2g} times the noise stays unexplained{most}"


def _names(diagnosis: Diagnosis) -> str:
    """The selected effects, each with those that explain the residual equally well."""
    aliases = {c.effect: c.indistinguishable_from for c in diagnosis.candidates}
    return " and ".join(
        f"{' or '.join([effect, *aliases[effect]])} (this log cannot tell which)"
        if aliases.get(effect)
        else effect
        for effect in diagnosis.selected
    )


def _verdict_in_words(diagnosis: Diagnosis, alike: Sequence[str]) -> str:
    before, after = diagnosis.baseline, diagnosis.after
    errors, names = _errors(diagnosis), _names(diagnosis)
    if diagnosis.verdict == "sensor_error":
        faults = "; ".join(s.sentence for s in diagnosis.sensors)
        rest = f"; in addition, {names} is missing" if names else ""
        return f"A sensor is wrong rather than the model: {faults}{rest} ({errors})."
    if diagnosis.outside is not None:
        over = " and ".join(diagnosis.outside.quantities).replace("_", " ")
        further = f" in addition to {names}" if names else ""
        return (
            f"Something outside the catalogue is missing{further}, over {over}: "
            f"{diagnosis.outside.formula} ({errors})."
        )
    if diagnosis.verdict == "missing_effect":
        # Named all the same, so the loss of single rows fell.
        unsure = (
            "; most rows improve, but not a few that small errors of the speeds decide"
            if after.heldout_rmse_w >= before.heldout_rmse_w
            else ""
        )
        return f"Missing: {names} ({errors}){unsure}."
    if diagnosis.verdict == "not_identifiable":
        structure = _structure(diagnosis)
        where = f", most of all {structure.sentence}" if structure else ""
        like = f": {', '.join(alike)} would look the same" if alike else ""
        return f"Something is missing{where}; this log cannot attribute it{like} ({errors})."
    return f"Nothing is missing that this log could show ({errors})."
