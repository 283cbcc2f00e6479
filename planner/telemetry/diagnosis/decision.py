"""The decision: which answer to a log held-out runs support, and what it leaves unexplained.

    decision = decide(found, floor)
    decision.answer, decision.unexplained, decision.complete

Effects, formulas and errors of sensors are judged by one rule (planner.telemetry.holdout.supports):
what is claimed lowers the error on held-out runs. A formula must beat the best answer without one,
single effects of the catalogue included. A claim must also be the main cause of what is missing: it
takes off MOST_OF_EXCESS of the squared error above the noise floor, however near that is. What is
left of sensors and data sheet always looks a little like some effect.

Nothing is missing where the held-out error is near the floor and no regime stands out
(planner.telemetry.diagnosis.unexplained).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from planner.arrays import Array
from planner.telemetry.belonging import apart
from planner.telemetry.diagnosis.answer import Answer, Decision
from planner.telemetry.diagnosis.formula_answers import (
    formula_of_shape,
    overlooked_formula,
    without_effects,
)
from planner.telemetry.diagnosis.unexplained import (
    MOST_OVER_FLOOR,
    Unexplained,
    unexplained_by,
    without_slow,
)
from planner.telemetry.holdout import (
    LinearHeldout,
    heldout_residual,
    rms,
    supports,
)
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import counted
from planner.telemetry.selection import (
    Found,
    Tried,
    fitted_singles,
)

MOST_OF_EXCESS = 0.5
"""Share of the squared error above the floor that a claim must take off: what is named explains
more than all else that is left."""
NEAR_ERROR = 1.02
"""Factor on the held-out error of a claim that makes a near decision fail."""
MOST_FAR_OUT = 1.02
"""Factor by which the held-out error of all rows may rise for who adopts a claim, those far out
among them, which elsewhere count at the clip."""
CERTAIN_Z, CERTAIN = 5.0, 0.9
"""Standard errors and probability from which a candidate is tried before a log is called
complete."""


def decide(found: Found, floor: Array) -> Decision:
    """Choose the answer that held-out runs support.

    Args:
        found: state of the search.
        floor: (n,) W, from floor_of.
    """
    log, selection = found.log, found.selection
    before = found.heldout(found.base)
    nothing = best = Answer(found.base, before)
    searched, formula = _searched(found), formula_of_shape(found)
    answers = [answer.left for answer in (nothing, searched, formula) if answer is not None]
    expected, floor = floor, _undercut(floor, answers)
    formula = without_effects(found, formula, floor)
    left_by_nothing = unexplained_by(log, before, floor, found.base.watts)
    # What lasts is no noise: a claim that leaves most of it is not the main cause.
    expected = without_slow(expected, before, left_by_nothing.slow_w)
    shape = selection.shape
    alike = shape.near if shape is not None and formula is None else ()
    if searched is not None and _supported(found, before, searched, floor):
        if not left_by_nothing.little or _clear(found, before, searched, floor):
            best = searched
        else:
            # Where hardly anything is left to explain, many sets of effects explain it.
            alike = tuple(member.name for member in searched.members)
    tried: tuple[Tried, ...] = ()
    unsettled = searched is not None or bool(alike) or not left_by_nothing.little or _certain(found)
    # The floor may take a strong effect for noise, but runs differ by it. A full fit shows it.
    unsettled |= bool(apart(log, before, found.base.model))
    alone = len(best.members) == 1
    # Where hardly anything is left to explain, many effects explain it; and what takes the place of
    # a part of the base model explains the part as well.
    doubtful = alone and (left_by_nothing.little or best.beside is not None)
    if formula is not None or alone or (not best.claims and unsettled):
        # Elsewhere few do, unless a drive changes little: then all follows its speed.
        competing_with = best.members[0] if formula is None and alone and not doubtful else None
        linear = LinearHeldout(log, found.examination)
        tried = fitted_singles(found, linear, before, floor, competing_with)
        doubtful |= alone and bool(tried)
        floor = _undercut(floor, [one.residual for one in tried])
        several = len(best.members) > 1
        pair = None if left_by_nothing.little or several else best_pair(found, tried, floor)
        if pair is not None and _leads(log, pair, formula, floor):
            best, doubtful = pair, False
        if doubtful:
            best = _with_equals(found, best, tried, before, floor)
        others = _competing_with(found, best, tried, before, floor) if doubtful else ()
        if others:
            best, alike = nothing, (best.members[0].name, *others)
        elif not left_by_nothing.little or _shown(found, tried):
            best = _better(found, best, tried, floor, before, left_by_nothing.little)
        if not best.claims and not left_by_nothing.little:
            alike = alike or _competing(tried)
    leading = best.left if best.claims or not _competing(tried) else tried[0].residual

    def leads(claim: Answer) -> bool:
        if supports(log, leading, claim.judged, floor, formula=True):
            return True
        # Effects that would not stand themselves are no answer, though they explain a part of it.
        partly = not claim.members and not stands(before, leading, expected)
        alone = partly and supports(log, before, claim.judged, floor, formula=True)
        return alone and supports(log, leading, claim.judged, floor)

    def wins(claim: Answer | None) -> bool:
        return (
            claim is not None
            and leads(claim)
            # Beside effects it must explain most of what these leave, in their place most of all.
            and stands(best.left if claim.members else before, claim.judged, expected)
            and (not claim.members or _weighs(found, before, best.left, claim.judged, floor))
        )

    if not wins(formula):
        little = left_by_nothing.little
        other = overlooked_formula(found, floor, before if little else None)
        formula = formula if little and other is None else other
        if little and other is not None and not best.claims and not wins(other):
            # Too unsure for a formula, it is surer than noise: the floor holds slow power.
            floor, formula = _undercut(floor, [other.left]), None
            left_by_nothing = unexplained_by(log, before, floor, found.base.watts)
    if formula is not None and wins(formula):
        best = formula
    elif formula is not None and _outdone(found, best, formula, floor):
        best, alike = nothing, tuple(member.name for member in best.members)
    if best.claims and (not stands(before, best.judged, expected) or _misleads(found, best, floor)):
        # Held-out runs show it, beside more that it does not explain.
        alike = alike or tuple(member.name for member in best.members)
        best = nothing
    if best.claims:
        left, alike = unexplained_by(log, best.left, floor, best.fit.watts), ()
    else:
        left = unexplained_by(log, before, floor, found.base.watts) if tried else left_by_nothing
    near = _near(log, before, best, left, floor)
    if best.members and best.proposal is None and best.fit is not found.fitted:
        # What was only tried has no intervals yet.
        best = replace(best, fit=found.refit(best.additions, tried=True))
    return Decision(best, before, floor, left, searched, alike, tried, near)


def _weighs(found: Found, before: Array, effects: Array, both: Array, floor: Array) -> bool:
    """Whether a formula beside effects takes off a fair share of what these take off.

    Args:
        found: state of the search, with a shape beside effects.
        before, effects, both: (n,) W, held-out residuals of the model, with the effects, and with
            the formula as well.
        floor: (n,) W.
    """
    squares = [rms(counted(residual, floor)) ** 2 for residual in (before, effects, both)]
    shape = found.selection.shape
    return shape is None or shape.weighs(squares[0] - squares[1], squares[1] - squares[2])


def _outdone(found: Found, best: Answer, formula: Answer, floor: Array) -> bool:
    """Whether a formula in the place of effects does better, though not as clearly as it must.

    Then the log does not tell which it is: as of two effects, the one that is named must lead.
    """
    if not best.claims or formula.members:
        return False
    return supports(found.log, best.left, formula.judged, floor)


def _misleads(found: Found, answer: Answer, floor: Array) -> bool:
    """Whether who adopts the answer, and leaves the data sheet as it is, predicts new runs worse.

    Usual errors, and how a robot stands on a slope, may explain what a claim makes worse. Its
    model is used without them. Rows far out count, too: a claim may leave them as they are.
    """
    without, adopted = (heldout_residual(found.log, fit) for fit in (found.base, answer.fit))
    worse = rms(counted(adopted, floor)) > rms(counted(without, floor))
    return worse or rms(adopted) > MOST_FAR_OUT * rms(without)


def stands(before: Array, after: Array, floor: Array) -> bool:
    """Whether most of what held-out residuals (n,) W have above the floor is gone."""
    one, other, least = (rms(counted(r, floor)) for r in (before, after, floor))
    return one**2 - other**2 >= MOST_OF_EXCESS * (one**2 - min(least, other) ** 2)


def _undercut(floor: Array, residuals: Sequence[Array]) -> Array:
    """The floor, lowered to the least of some held-out errors: no answer can be below it."""
    least = min((rms(counted(residual, floor)) for residual in residuals), default=rms(floor))
    return floor * min(1.0, least / rms(floor))


def _searched(found: Found) -> Answer | None:
    """What the search selected."""
    members = tuple(m for m in found.selection.members if not m.sensor)
    if not members:
        return None
    left = found.heldout(found.fitted)
    aliases = dict(found.selection.aliases)
    return Answer(
        found.fitted, left, members, found.additions, aliases=aliases, beside=found.beside
    )


def _supported(found: Found, before: Array, answer: Answer, floor: Array) -> bool:
    if supports(found.log, before, answer.judged, floor):
        return True
    if answer.beside is not None:
        return False
    # Whether an effect is there is asked of the fewest parameters that show it.
    fewest = found.searched
    return fewest is not None and supports(found.log, before, found.heldout(fewest), floor)


def _clear(found: Found, before: Array, answer: Answer, floor: Array) -> bool:
    """Whether one effect is claimed that chance alone would hardly show.

    Of many effects one lowers an error near the floor by a hundredth or two.
    """
    alone = len(answer.members) == 1
    return alone and supports(found.log, before, answer.judged, floor, chosen=True)


def _certain(found: Found) -> bool:
    """Whether the ranking shows an effect as certain that was not selected."""
    chosen = {m.name for m in found.selection.members}
    return any(
        r.z >= CERTAIN_Z and r.probability >= CERTAIN
        for r in found.selection.ranking
        if r.name not in chosen and not r.member.sensor
    )


def _better(
    found: Found,
    best: Answer,
    tried: tuple[Tried, ...],
    floor: Array,
    before: Array,
    little: bool,
) -> Answer:
    """The best single effect where it beats the best answer so far.

    One that the search does not show needs as much as a formula: it was chosen by its error. Where
    little is left to explain, chance must not do as well.
    """
    first = next((one for one in tried if one.supported), None)
    if first is None or first.competing:
        return best
    if best.claims and not supports(found.log, best.left, first.residual, floor):
        return best
    shown = _shown(found, (first,))
    if little and not supports(found.log, before, first.residual, floor, chosen=True):
        return best
    if not shown and not supports(found.log, before, first.residual, floor, formula=True):
        return best
    member = first.ranked.member
    aliases = {first.name: first.equals}
    return Answer(first.fit, first.residual, (member,), (first.addition,), aliases=aliases)


def best_pair(found: Found, tried: tuple[Tried, ...], floor: Array) -> Answer | None:
    """Two effects that held-out runs show together; None where one alone does nearly as well.

    Of two that are there, each alone seems to compete with the other. The second one was chosen by
    its error, so that it needs as much as a formula, unless the search is certain of both.
    """
    supported = [one for one in tried if one.supported]
    best: Answer | None = None
    for one in supported[1:]:
        first = supported[0]
        additions = (first.addition, one.addition)
        fitted = found.refit(additions)
        left = found.heldout(fitted)
        certain = all(each.ranked.probability >= CERTAIN for each in (first, one))
        shown = supports(found.log, first.residual, left, floor, formula=not certain)
        if shown and (best is None or rms(left) < rms(best.left)):
            members = (first.ranked.member, one.ranked.member)
            aliases = {each.name: each.equals for each in (first, one)}
            beside = found.left_beside_base(fitted)
            best = Answer(fitted, left, members, additions, aliases=aliases, beside=beside)
    return best


def _leads(log: Telemetry, pair: Answer, formula: Answer | None, floor: Array) -> bool:
    """Whether two effects do better than the formula that the search shows in their place.

    They are the best of hundreds of pairs.
    """
    return formula is None or supports(log, formula.judged, pair.left, floor)


def _competing_with(
    found: Found, best: Answer, tried: tuple[Tried, ...], before: Array, floor: Array
) -> tuple[str, ...]:
    """Effects that explain the log as well as the one that is named, by other columns."""
    (member,) = best.members
    known = {member.name, *best.aliases.get(member.name, ())}
    error, without = (rms(counted(residual, floor)) for residual in (best.judged, before))
    others = [one for one in tried if one.name not in known]
    return tuple(one.name for one in others if one.competes_with(found, member, error, without))


def _with_equals(
    found: Found, best: Answer, tried: tuple[Tried, ...], before: Array, floor: Array
) -> Answer:
    """The best single effect with those that explain as much by nearly the same columns."""
    (member,) = best.members
    error, without = (rms(counted(residual, floor)) for residual in (best.judged, before))
    equal = [one.name for one in tried if one.equals_to(found, member, error, without)]
    known = best.aliases.get(member.name, ())
    both = tuple(dict.fromkeys((*known, *equal)))
    return replace(best, aliases={**best.aliases, member.name: both})


def _shown(found: Found, tried: tuple[Tried, ...]) -> bool:
    """Whether the search shows the best single effect where hardly anything is left to explain."""
    chosen = {m.name for m in found.selection.members}
    return bool(tried) and (tried[0].name in chosen or tried[0].ranked.z >= CERTAIN_Z)


def _competing(tried: tuple[Tried, ...]) -> tuple[str, ...]:
    """Effects of which each alone explains the log as well as the others; () where one leads."""
    return (tried[0].name, *tried[0].competing) if tried and tried[0].competing else ()


def _near(log: Telemetry, before: Array, answer: Answer, left: Unexplained, floor: Array) -> str:
    """What decided narrowly, in words."""
    said = []
    if left.near:
        said.append(
            f"the held-out error is {left.heldout_over_floor:.2f} times the noise floor, and "
            f"{MOST_OVER_FLOOR:g} decides"
        )
    if answer.claims:
        formula = answer.proposal is not None
        if not supports(log, before, NEAR_ERROR * answer.left, floor, formula=formula):
            said.append(f"a held-out error {100 * (NEAR_ERROR - 1):.0f} % larger would not do")
    return "; ".join(said)
