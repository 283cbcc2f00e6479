"""Answers with a formula, for what the catalogue does not explain.

    formula = without_effects(found, formula_of_shape(found), floor)     # or None
    other = overlooked_formula(found, floor, little)                     # or None

planner.telemetry.diagnosis.decision chooses among them and effects of the catalogue.
"""

from __future__ import annotations

import math

from planner.arrays import Array
from planner.telemetry.diagnosis.answer import Answer
from planner.telemetry.diagnosis.unexplained import MOST_OVER_FLOOR
from planner.telemetry.diagnosis.unknown_effect import propose
from planner.telemetry.holdout import rms, supports
from planner.telemetry.noise import counted
from planner.telemetry.selection import Found, Member, ShapeFound
from planner.telemetry.terms import Addition


def formula_of_shape(found: Found) -> Answer | None:
    """A formula for the shape that the catalogue does not explain, beside what was selected."""
    shape = found.selection.shape
    members = tuple(m for m in found.selection.members if not m.sensor)
    if shape is None:
        return None
    if shape.near and (shape.alone or not members) and not found.corrections:
        return None
    if shape.alone:
        return _with_formula(found, shape)
    return _with_formula(found, shape, members, found.additions)


def without_effects(found: Found, formula: Answer | None, floor: Array) -> Answer | None:
    """A formula without those effects beside it that held-out runs do not miss.

    Effects are selected before a formula. One of them may be what comes nearest to it in the
    catalogue, and is not needed beside it. Where the shape itself looks like an effect, they stay:
    it may be what they leave.

    Args:
        found: state of the search.
        formula: what ``formula_of_shape`` gave.
        floor: (n,) W.
    """
    shape = found.selection.shape
    if formula is None or shape is None or shape.near:
        return formula
    while formula.members:
        fewer = []
        for dropped in formula.members:
            kept = tuple(m for m in formula.members if m != dropped)
            rest = [a for a in formula.additions if a.declaration.slug != dropped.name]
            fewer.append(_with_formula(found, shape, kept, tuple(rest)))
        best = min(fewer, key=lambda one: rms(one.judged))
        if supports(found.log, best.judged, formula.judged, floor):
            break
        formula = best
    return formula


def overlooked_formula(found: Found, floor: Array, little: Array | None) -> Answer | None:
    """A formula for the shape that predicts held-out runs best, where the search found none good.

    A search tests by the scatter within the log. Of what lasts for a run, few runs say little, and
    beside effects that are not there a shape looks smaller than it is. The floor may take it for
    slow noise, too. Then the shape must show that the floor is too high by what decides.

    Args:
        found: state of the search.
        floor: (n,) W.
        little: (n,) W, held-out residual of the model, where that is near the floor; else None.
    """
    most = math.inf if little is None else rms(counted(little, floor)) / MOST_OVER_FLOOR
    shape = found.overlooked_shape(floor, most)
    return None if shape is None else _with_formula(found, shape)


def _with_formula(
    found: Found,
    shape: ShapeFound,
    kept: tuple[Member, ...] = (),
    additions: tuple[Addition, ...] = (),
) -> Answer:
    """A formula over the axis of a shape, beside members that are kept."""
    axis = found.examination.competitors.dictionary.shapes[shape.number].axis
    given = [column for m in kept for column in m.columns]
    proposal = propose(found.examination, axis, shape, found.log, found.origin, additions, given)
    left = found.heldout(proposal.fit)
    beside = found.left_beside_base(proposal.fit)
    aliases = dict(found.selection.aliases)
    return Answer(proposal.fit, left, kept, additions, proposal, aliases, beside)
