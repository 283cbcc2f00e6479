"""The candidates of a diagnosis: how each effect stands, and how it could be adopted.

    candidates_of(found, decision, fitted, after_w)     # the table, what is named first
    adoptable(found, answer)                            # slug → how to add it

An effect's size is that of the fit where it is named, else of the linear search.
"""

from __future__ import annotations

import numpy as np

from planner.power.catalogue import all_effects
from planner.telemetry.diagnosis.answer import Answer, Decision
from planner.telemetry.diagnosis.results import Candidate, Estimate
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import Examination
from planner.telemetry.holdout import LinearHeldout, heldout_residual, rms
from planner.telemetry.selection import Found, RankedTerm
from planner.telemetry.terms import Addition


def adoptable(found: Found, answer: Answer) -> dict[str, Addition]:
    """How to add everything that could be adopted, supported by the log or not."""
    examination = found.examination
    library = examination.competitors.library
    additions: dict[str, Addition] = {}
    for slug, effect in all_effects().items():
        if not effect.base and slug not in library.own:
            additions[slug] = Addition.usual(effect, library.model)
    for ranked in _ranking(found):
        addition = Addition.of(library, ranked.member.term, ranked.coefficients)
        additions[ranked.name] = addition.completed(library)
    for member, addition in zip(answer.members, answer.additions, strict=True):
        additions[member.name] = addition
    if answer.proposal is not None:
        additions[answer.proposal.outside.name] = answer.proposal.addition
    return additions


def _ranking(found: Found) -> list[RankedTerm]:
    """Competing effects."""
    return [ranked for ranked in found.selection.ranking if not ranked.member.sensor]


def candidates_of(
    found: Found, decision: Decision, fitted: Fit, after_w: float
) -> tuple[Candidate, ...]:
    entries = []
    examination, answer = found.examination, decision.answer
    selected = {m.name for m in answer.members}
    in_full = {one.name: rms(heldout_residual(found.log, one.fit)) for one in decision.tried}
    if decision.searched is not None and not selected:
        names = [m.name for m in decision.searched.members]
        in_full = {
            **dict.fromkeys(names, rms(heldout_residual(found.log, decision.searched.fit))),
            **in_full,
        }
    linear = LinearHeldout(found.log, examination, exact=True)
    order = sorted(_ranking(found), key=lambda ranked: ranked.name not in selected)
    for ranked in order:
        chosen = ranked.name in selected
        if chosen:
            parameters = _fitted_estimates(fitted, ranked.name)
        else:
            parameters = _linear_estimates(examination, ranked)
        # An effect alone; a selected one with all that were selected.
        probability: float | None = ranked.probability
        if chosen:
            heldout = after_w
        elif ranked.name in in_full:
            heldout = in_full[ranked.name]
        else:
            heldout = linear.rmse(ranked.member.columns)
        if chosen != (ranked.probability >= 0.5):
            # The weights are those of the search, which held-out runs have overruled.
            probability = None
        known = ranked.name, probability, heldout, parameters
        test = ranked.z, ranked.p_value, ranked.size, ranked.gain
        aliases = tuple(answer.aliases.get(ranked.name, ())) if chosen else ()
        entries.append(Candidate(*known, *test, len(ranked.member.columns), aliases))
    listed = {entry.effect for entry in entries}
    rest = sorted(examination.testable.items(), key=lambda item: (item[1] is not None, item[0]))
    for slug, why in rest:
        if slug not in listed:
            # Testable and not ranked: the log asks for a sign or size that the effect cannot have.
            entries.append(Candidate(slug, 0.0, None, {}, 0.0, 1.0, 0.0, 0.0, 0, (), why))
    return tuple(entries)


def _fitted_estimates(fitted: Fit, slug: str) -> dict[str, Estimate]:
    estimates = {}
    keys = [key[:2] for key in fitted.model.parameter_names]
    for parameter in fitted.parameters:
        if parameter.effect == slug:
            several = keys.count((slug, parameter.name)) > 1
            name = f"{parameter.name} {parameter.element}" if several else parameter.name
            estimates[name] = Estimate(parameter.value, parameter.stderr, parameter.unit)
    return estimates


def _linear_estimates(examination: Examination, ranked: RankedTerm) -> dict[str, Estimate]:
    library = examination.competitors.library
    estimates = {}
    clear = examination.evidence.partial
    member = ranked.member
    each = zip(member.term.columns, member.columns, ranked.coefficients, strict=True)
    for number, column, value in each:
        candidate = library.candidates[number]
        _, _, parameter, _ = library.model.slots[candidate.place]
        null = parameter.null or 0.0
        stderr = float(1.0 / np.sqrt(max(clear[column, column], 1e-300)))
        bounded = float(np.clip(null + value, *parameter.bounds))
        estimates[candidate.parameter] = Estimate(bounded, stderr, parameter.unit)
    return estimates
