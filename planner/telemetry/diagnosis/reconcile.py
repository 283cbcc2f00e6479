"""Reconcile searches of one log: around the fit and the model as given, and in two readings.

    decision = undisputed(found, decision, other)      # another search has no other answer
    decision = beside_noise(found, decision, noisier)  # noise of the motion does not make the claim
    decision = confirmed(found, decision, others)      # the usual reading bears the claim out
    more_credible(first, second)                       # the diagnosis to return

Where a strong effect is missing, the fit of the base model ends at physical bounds. The columns
around such a fit may be misleading. A second search, around the model as given, then sometimes
names other effects. It wins when its held-out error is clearly lower, or lower at all where the
first names a sensor fault and it does not. Among equally good explanations the simpler one wins: no
formula outside the catalogue, then fewer parameters at bounds. A parameter at its bound makes up
for a missing effect, and only within this log.

A claim must also outlive the noise of the motion (planner.telemetry.sampling.noisier_motion), and
the reading of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.arrays import Array
from planner.telemetry.diagnosis.answer import Answer, Decision
from planner.telemetry.diagnosis.decision import stands
from planner.telemetry.diagnosis.results import Diagnosis
from planner.telemetry.diagnosis.unexplained import unexplained_by
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import heldout_residual, rms, supports
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import counted
from planner.telemetry.other_terms import SENSORS
from planner.telemetry.prediction import predict
from planner.telemetry.selection import Found

BELIEVED_RATIO, NAMING_RATIO, OVERRULING_RATIO = 0.98, 0.9, 0.83
"""Held-out error of the second search over that of the first, below which the second wins: where
the first named something; where it could not tell what is missing; and where it found nothing: its
floor is then too high, since 1.2 times the true one is too much for a complete model."""
EQUAL_Z, EQUAL_RATIO = 2.0, 1.05
"""Standard errors over runs, and ratio, within which held-out errors count as equal."""


def undisputed(
    found: Found, decision: Decision, other: Decision, *, same_log: bool = True
) -> Decision:
    """A decision; without its claim where another search of the log has other answers.

    Which effect explains the little that is left above the noise floor may depend on where the
    columns were taken. Then the log does not tell it. And what usual errors of data sheet and
    sensors explain around the one model, no effect needs to explain around the other.

    Args:
        found: state of the search that was decided.
        decision: what was decided.
        other: decision about the other search.
        same_log: whether neither corrected errors of sensors, so that errors compare.
    """
    answer, before, floor = decision.answer, decision.before, decision.floor
    nothing = without_claim(found, decision)
    mine, theirs = _names(answer), _names(other.answer) or set(other.alike)
    if answer.proposal is None and mine and same_log:
        least = min(before, other.before, key=rms)
        if not stands(least, answer.judged, floor):
            return nothing
    little = nothing.unexplained.little
    if answer.proposal is not None or not mine or not theirs or not little:
        return decision
    each = [{m.name, *answer.aliases.get(m.name, ())} for m in answer.members]
    shared = all(names & theirs for names in each)
    if shared and (other.answer.claims or theirs <= mine):
        return decision
    return replace(nothing, alike=tuple(dict.fromkeys((*sorted(mine), *sorted(theirs)))))


def outdone(log: Telemetry, one: Decision, other: Decision) -> bool:
    """Whether held-out runs support the effects of another search against those of one.

    Columns around a fit that a strong effect has bent may name others. Where both searches name
    some, unseen runs can tell who is right.

    Args:
        log: the rows, which neither search has corrected.
        one, other: decisions about them.
    """
    each = one.answer, other.answer
    if any(not answer.members or answer.proposal is not None for answer in each):
        return False
    if _names(one.answer) == _names(other.answer):
        return False
    return supports(log, one.answer.judged, other.answer.judged, other.floor)


def beside_noise(found: Found, decision: Decision, noisier: Sequence[Telemetry]) -> Decision:
    """``beyond_noise``, and what stays is as sure as noise of the motion leaves it."""
    return as_sure_as_noise_leaves(found, beyond_noise(found, decision, noisier), noisier)


def beyond_noise(found: Found, decision: Decision, noisier: Sequence[Telemetry]) -> Decision:
    """A decision; without its claim where noise of the motion makes what the claim takes off.

    A model that is driven by noisy speeds and tilts predicts a power that scatters, and a claim may
    take that back. What it takes off then grows in proportion to the noise's variance. So it is
    fitted to logs with as much noise again, too. The growth, subtracted, leaves what it would take
    off without any noise. That must still be as much as any claim must take off.

    Args:
        found: state of the search that was decided.
        decision: what was decided.
        noisier: the rows of the search, from copies of the log with as much noise again.
    """
    answer, before, floor = decision.answer, decision.before, decision.floor
    if not answer.claims:
        return decision
    left, formula = answer.judged, _is_formula(answer)

    def outlives(growth: float) -> bool:
        if growth <= 0.0:
            return True
        grown = float(np.sqrt(1.0 + growth / rms(counted(left, floor)) ** 2))
        return supports(found.log, before, left, floor, formula=formula, grown=grown)

    searches = [_of_rows(found, log) for log in noisier]
    # A claim can hardly take back more than what noise does to the prediction.
    scattered = predict(found.base.model, searches[0].log) - found.base.watts
    if outlives(rms(counted(scattered, floor)) ** 2):
        return decision
    more = [_taken_off(search, answer, floor) for search in searches]
    if outlives(float(np.mean(more)) - _taken_off(found, answer, floor)):
        return decision
    # Noise explains it, so no effect needs to.
    return replace(without_claim(found, decision), alike=())


def as_sure_as_noise_leaves(
    found: Found, decision: Decision, noisier: Sequence[Telemetry]
) -> Decision:
    """A decision whose fit's standard errors include what noise of the motion does.

    Friction that changes with a speed, or an edge of a slope, is blurred by noise of the speed and
    of the slope, and a fit finds less of it. As much noise again moves each parameter further, by
    about as much as the noise of the log has moved it.

    Args:
        found: state of the search that was decided.
        decision: what was decided.
        noisier: as for ``beyond_noise``.
    """
    answer = decision.answer
    if not answer.claims:
        return decision
    fits = [_refitted(_of_rows(found, log), answer) for log in noisier]
    return replace(decision, answer=replace(answer, fit=answer.fit.unsure_by(fits)))


def _taken_off(found: Found, answer: Answer, floor: Array) -> float:
    """W², of the squared error by a claim that is fitted to this log, as the model alone is."""
    each = found.heldout(found.refit(())), _left_with(found, answer)
    without, claimed = (rms(counted(residual, floor)) ** 2 for residual in each)
    return without - claimed


def _left_with(found: Found, answer: Answer) -> Array:
    """(n,) W, the held-out residual that a claim is judged by, once it is fitted to this log."""
    fitted = _refitted(found, answer)
    beside = found.left_beside_base(fitted)
    return found.heldout(fitted) if beside is None else beside


def _refitted(found: Found, answer: Answer) -> Fit:
    """A claim, fitted to this log."""
    formula = () if answer.proposal is None else (answer.proposal.addition,)
    return found.refit([*answer.additions, *formula])


def _of_rows(found: Found, log: Telemetry) -> Found:
    """The same search for other rows, corrected as its own and read from its meter."""
    for kind, (value, _) in found.corrections.items():
        log = SENSORS[kind].correct(log, value)
    return replace(found, log=replace(log, meter=found.log.meter))


def confirmed(
    found: Found, decision: Decision, others: Sequence[tuple[Found, Decision]]
) -> Decision:
    """A decision; without its claim where the usual reading of the motion does not bear it out.

    What only one way to read the speeds shows may be how their errors look in it. The usual reading
    bears a claim out where its own search makes the same one, or where its held-out runs support
    it. Either will do: the noise of that reading may hide an effect from a search, or spoil a fit.

    Args:
        found: state of the search that was decided.
        decision: what was decided.
        others: searches of the log in its usual reading, and what was decided about them.
    """
    answer = decision.answer
    if not answer.claims:
        return decision
    if any(
        _makes(other.answer, answer) or _supports(each, other, answer) for each, other in others
    ):
        return decision
    return without_claim(found, decision)


def _makes(other: Answer, answer: Answer) -> bool:
    """Whether another answer makes the same claim."""
    each = [{m.name, *answer.aliases.get(m.name, ())} for m in answer.members]
    alike = all(names & _names(other) for names in each)
    return other.claims and alike and _is_formula(answer) == _is_formula(other)


def _supports(found: Found, decision: Decision, answer: Answer) -> bool:
    """Whether held-out runs of another reading support a claim that is fitted to it."""
    left, before, floor = _left_with(found, answer), decision.before, decision.floor
    shown = supports(found.log, before, left, floor, formula=_is_formula(answer))
    return shown and stands(before, left, floor)


def more_credible(first: Diagnosis, second: Diagnosis) -> Diagnosis:
    """The one to believe.

    Args:
        first: of the search around the fit.
        second: of the search around the model as given.
    """
    ratios = {"complete": OVERRULING_RATIO, "not_identifiable": NAMING_RATIO}
    enough = ratios.get(first.verdict, BELIEVED_RATIO)
    if second.after.heldout_rmse_w < enough * first.after.heldout_rmse_w:
        return second
    no_fault = first.sensors and second.proposed and not second.sensors
    if no_fault and second.after.heldout_rmse_w < first.after.heldout_rmse_w:
        return second
    both = first.proposed and second.proposed and not (first.sensors or second.sensors)
    if both and _complexity(second) < _complexity(first) and _as_good(second, first):
        return second
    return first


def _complexity(diagnosis: Diagnosis) -> tuple[bool, int]:
    """Whether a formula is needed, and how many parameters stand at the ends of their ranges."""
    ends = sum(1 for p in diagnosis.fitted.parameters if p.at_the_end)
    return diagnosis.outside is not None, ends


def _as_good(one: Diagnosis, other: Diagnosis) -> bool:
    """Whether the held-out error of the one is not clearly above that of the other."""
    if one.after.heldout_rmse_w > EQUAL_RATIO * other.after.heldout_rmse_w:
        return False
    log = one.corrected  # the same rows in both: neither names a sensor fault
    mine, theirs = (heldout_residual(log, each.fitted) ** 2 for each in (one, other))
    _, run = np.unique(log.run, return_inverse=True)
    excess = np.bincount(run, mine - theirs)
    return bool(excess.sum() < EQUAL_Z * np.sqrt(np.sum(excess**2)) + 1e-12)


def without_claim(found: Found, decision: Decision) -> Decision:
    """The decision that nothing is claimed; what was named is among what may be there."""
    named = tuple(member.name for member in decision.answer.members)
    nothing = Answer(found.base, decision.before)
    left = unexplained_by(found.log, decision.before, decision.floor, found.base.watts)
    return replace(decision, answer=nothing, alike=named, unexplained=left, near="")


def _is_formula(answer: Answer) -> bool:
    """Whether it names what the catalogue does not know."""
    return answer.proposal is not None


def _names(answer: Answer) -> set[str]:
    """Slugs of the effects that an answer names, and of their aliases."""
    members = [member.name for member in answer.members]
    return {*members, *(alias for name in members for alias in answer.aliases.get(name, ()))}
