"""The verdict of a diagnosis, and its sentence.

verdict = verdict_of(faulty=False, formula=False, named=True, lost=False)
diagnosis = replace(diagnosis, sentence=sentence_of(diagnosis, alike=(), near=""))
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from planner.amounts import share, watts
from planner.power.catalogue import all_effects
from planner.telemetry.diagnosis.results import Diagnosis, Verdict
from planner.telemetry.diagnosis.unexplained import MOST_OVER_FLOOR
from planner.telemetry.regimes import Regime

CLOSE_ERRORS = 1.05
"""Held-out error over the noise floor up to which both are called the same."""
WORTH_A_WORD = 0.2
"""Probability from which an effect that is not named is spoken of: one of five such is there."""


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


def sentence_of(
    diagnosis: Diagnosis,
    alike: Sequence[str] = (),
    near: str = "",
    apart: Sequence[str] = (),
    exact_w: float = math.inf,
    impossible: Sequence[str] = (),
    misread: str = "",
) -> str:
    """The verdict in words, how near it was, and whether the fit of the base model was refused.

    Args:
        diagnosis: everything but its sentence.
        alike: effects that would look the same as what cannot be attributed.
        near: what decided narrowly.
        apart: what does not belong together in the log, in clauses.
        exact_w: W, what the error on unseen runs may be without usual errors of the data sheet and
            of the sensors.
        impossible: what the vehicle's motors cannot have done, in clauses.
        misread: another reading of the log, in which the model does much better, in a sentence.
    """
    beyond = [f"{clause[0].upper()}{clause[1:]}." for clause in impossible]
    if misread:
        return " ".join([f"{misread}.", *beyond])
    said = [_verdict_in_words(diagnosis, alike, apart), *beyond]
    if diagnosis.after.heldout_rmse_w > MOST_OVER_FLOOR * exact_w:
        said.append(
            "Usual errors of the data sheet and of the sensors are a part of this error: without "
            f"them it may be {watts(exact_w)}."
        )
    if diagnosis.unexplained.slow_w and not apart:
        said.append(
            f"About {watts(diagnosis.unexplained.slow_w)} of it lasts for seconds, more than power "
            "meters drift, and no column tells when: a load that switches on and off, or a ground "
            "that changes. Log what may tell it."
        )
    said += [f"{clause[0].upper()}{clause[1:]}." for clause in apart]
    if diagnosis.outside is not None:
        said.append(f"The formula is {diagnosis.outside.formula}.")
    said.append(_planned_already(diagnosis))
    if near:
        said.append(f"This is a near decision: {near}.")
    if diagnosis.verdict in ("complete", "not_identifiable") and not apart:
        said.append(_likeliest(diagnosis, alike))
    if diagnosis.verdict == "complete":
        said.append(_scope(diagnosis))
    if diagnosis.meter is not None:
        said.append(f"{diagnosis.meter.sentence}.")
    if diagnosis.refused is not None:
        said.append(diagnosis.refused.sentence)
    return " ".join(filter(None, said))


def _verdict_in_words(diagnosis: Diagnosis, alike: Sequence[str], apart: Sequence[str]) -> str:
    names = _names(diagnosis)
    if diagnosis.verdict == "sensor_error":
        faults = "; ".join(s.sentence for s in diagnosis.sensors)
        rest = f", and the model lacks {names}" if names else ""
        return f"A sensor is wrong: {faults}{rest}. {_fall(diagnosis, 'Corrected')}."
    if diagnosis.outside is not None:
        over = " and ".join(diagnosis.outside.quantities).replace("_", " ")
        further = f"{names} and " if names else ""
        return (
            f"The model lacks {further}something over {over} that no effect of the catalogue "
            f"describes: {_fall(diagnosis, 'with a formula')}."
        )
    if diagnosis.verdict == "missing_effect":
        how = "with it" if len(diagnosis.selected) == 1 else "with them"
        return f"The model lacks {names}: {_fall(diagnosis, how)}."
    error = watts(diagnosis.baseline.heldout_rmse_w)
    if diagnosis.shows_nothing:
        lead = "This log is too short or too uniform to show any effect of the catalogue"
        return f"{lead}: the error on unseen runs is {error}."
    if diagnosis.verdict == "not_identifiable":
        if alike and diagnosis.unexplained.little and not apart:
            them = "it" if len(alike) == 1 else "them"
            return (
                f"This log cannot tell whether anything is missing: {' or '.join(alike)} would "
                f"lower the error on unseen runs a little, but without {them} it is {error}, "
                f"{_beside_noise(diagnosis)}."
            )
        like = f" ({', '.join(alike)} would look the same)" if alike else ""
        left = diagnosis.unexplained
        if left.where and left.heldout_over_floor <= MOST_OVER_FLOOR and not apart:
            return (
                f"Little is missing, if anything: the error on unseen runs is {error}, "
                f"{_beside_noise(diagnosis)}, but not evenly{_most_of_all(diagnosis)}. This log "
                f"cannot name what is missing there{like}; noise of the measured motion may do "
                "the same."
            )
        # What differs from run to run counts as noise wherever no column tells it.
        noise = "" if apart else f", {_beside_noise(diagnosis)}"
        most = "" if left.slow_w and not left.where else _most_of_all(diagnosis)
        return (
            f"Something is missing that this log cannot name{like}{most}: "
            f"the error on unseen runs is {error}{noise}."
        )
    return (
        f"Nothing is missing that this log could show: the error on unseen runs is {error}, "
        f"{_beside_noise(diagnosis)}."
    )


def _fall(diagnosis: Diagnosis, how: str) -> str:
    """What a claim does to the error, and what it leaves."""
    before, after = diagnosis.baseline.heldout_rmse_w, diagnosis.after.heldout_rmse_w
    # Named all the same, so the loss of single rows fell.
    but = (
        " most rows improve, but not a few that small errors of the speeds decide;"
        if after >= before
        else ""
    )
    verb = "goes" if but else "falls"
    return (
        f"{how},{but} the error on unseen runs {verb} from {watts(before)} to {watts(after)}, "
        f"{_beside_noise(diagnosis)}"
    )


def _beside_noise(diagnosis: Diagnosis) -> str:
    """The error that is left, beside the noise; where it is, once that is much."""
    rest, noise = diagnosis.unexplained, diagnosis.baseline.noise_floor_w or 0.0
    error, floor = diagnosis.after.heldout_rmse_w, watts(noise)
    # The ratio leaves out a few far rows; what is shown beside each other must agree, too.
    if max(rest.heldout_over_floor, error / max(noise, 1e-300)) <= CLOSE_ERRORS:
        return f"which is the log's own noise (about {floor})"
    if rest.heldout_over_floor <= MOST_OVER_FLOOR:
        return f"close to the log's own noise (about {floor})"
    most = _most_of_all(diagnosis) if diagnosis.proposed else ""
    ratio = rest.heldout_over_floor
    many = f"{ratio:.2g}" if ratio < 99.5 else f"{ratio:,.0f}"
    times = f"{many} times the log's own noise (about {floor})"
    return f"still {times}{most}" if diagnosis.proposed else times


def _structure(diagnosis: Diagnosis) -> Regime | None:
    """The regime that makes most of what stays unexplained, or of the residual as it was."""
    where = diagnosis.unexplained.where or diagnosis.regimes
    return max(where, key=lambda r: r.share_of_squared_error, default=None)


def _most_of_all(diagnosis: Diagnosis) -> str:
    structure = _structure(diagnosis)
    if structure is None:
        return ""
    side = "more" if structure.bias_w > 0.0 else "less"
    return (
        f", most of all {structure.where} ({watts(abs(structure.bias_w))} {side} than predicted, "
        f"{share(structure.share_of_squared_error)} of the squared error)"
    )


def _names(diagnosis: Diagnosis) -> str:
    """The selected effects, each with those that explain the residual equally well."""
    aliases = {c.effect: c.indistinguishable_from for c in diagnosis.candidates}
    return " and ".join(
        f"{' or '.join([effect, *aliases[effect]])} (this log cannot tell which)"
        if aliases.get(effect)
        else _titled(effect)
        for effect in diagnosis.selected
    )


def _planned_already(diagnosis: Diagnosis) -> str:
    """That routes of the vehicle count what is said to be missing from its base model."""
    listed = diagnosis.model.vehicle.active
    names = [slug for slug in diagnosis.selected if slug in listed]
    if not names:
        return ""
    them = "it" if len(names) == 1 else "them"
    return (
        f"Planning with the vehicle counts {' and '.join(names)}, as its file says; this diagnosis "
        f"began without {them}."
    )


def _titled(slug: str) -> str:
    """A slug, and its title where that says more."""
    effect = all_effects().get(slug)
    if effect is None or set(effect.title.split()) <= set(slug.split("_")):
        return slug
    return f"{slug} ({effect.title})"


def _likeliest(diagnosis: Diagnosis, alike: Sequence[str]) -> str:
    """The likeliest effect that was not named, where it lowers the error on unseen runs."""
    before = diagnosis.baseline.heldout_rmse_w
    better = [
        (c.probability or 0.0, c.effect, c.heldout_rmse_w)
        for c in diagnosis.candidates
        if c.effect not in alike and c.heldout_rmse_w is not None and c.heldout_rmse_w < before
    ]
    chance, effect, error = max(better, default=(0.0, "", 0.0))
    if chance < WORTH_A_WORD:
        return ""
    return (
        f"The likeliest effect that it may lack is {_titled(effect)} ({share(chance)}): with it "
        f"the error on unseen runs is {watts(error)}. This is too little to name it."
    )


def _scope(diagnosis: Diagnosis) -> str:
    """How many effects the log could have shown."""
    able, every = diagnosis.showable
    return f"It could show {able} of {every} effects of the catalogue." if able else ""
