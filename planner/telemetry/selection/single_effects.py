"""Single effects fitted in full, judged on held-out runs: what a search on sums may overlook.

    tried = fitted_singles(found, linear, before, floor)
    tried[0].name, tried[0].residual, tried[0].supported

A search works around one linearisation, and with one picture of the noise. A strong effect may bend
both, and a whole run on other ground may look like a few outliers. Held-out runs then still show
the effect. The best ones by their linear held-out error are fitted with everything free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from planner.arrays import Array
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import Examination
from planner.telemetry.holdout import (
    LinearHeldout,
    heldout_residual,
    rms,
    supports,
)
from planner.telemetry.noise import counted
from planner.telemetry.selection.select_effects import RankedTerm
from planner.telemetry.selection.selection_loop import Found
from planner.telemetry.terms import Addition

MOST_TRIED = 4
"""Effects that are fitted in full."""
LEAST_TRIED_Z = 3.0
"""Standard errors of its own test, from which an effect is tried whatever its linear error."""
EQUAL_RATIO = 1.01
"""Held-out error over the best one's, up to which two effects explain a log as well."""


@dataclass(frozen=True)
class Tried:
    """One effect, fitted in full with the model.

    Attributes:
        ranked: its entry in the ranking.
        addition: how it was added.
        fit: of the model with it.
        residual: (n,) W on held-out runs.
        error_w: W, its root mean square, rows far out counted at the clip.
        supported: whether held-out runs support it.
        equals: slugs that explain the log as well, of the best one.
    """

    ranked: RankedTerm
    addition: Addition
    fit: Fit
    residual: Array
    error_w: float
    supported: bool
    equals: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Slug of the effect."""
        return self.ranked.name


def fitted_singles(
    found: Found, linear: LinearHeldout, before: Array, floor: Array
) -> tuple[Tried, ...]:
    """The most promising effects, each fitted alone; supported ones first, by held-out error.

    Args:
        found: state of the search.
        linear: held-out errors around its last linearisation.
        before: (n,) W, held-out residual of the model without anything added.
        floor: (n,) W, spread of single rows.
    """
    library, examination = found.examination.competitors.library, found.examination
    error = rms(before)
    promising = []
    for ranked in found.selection.ranking:
        if ranked.member.sensor:
            continue
        columns = _local_columns(found, examination, ranked)
        expected = linear.rmse(columns)
        if expected < error or ranked.z >= LEAST_TRIED_Z:
            promising.append((expected, ranked))
    tried = []
    for _, ranked in sorted(promising, key=lambda entry: entry[0])[:MOST_TRIED]:
        addition = Addition.of(library, ranked.member.term, ranked.coefficients)
        addition = addition.completed(found.local.competitors.library)
        fitted = found.refit((addition,))
        left = heldout_residual(found.log, fitted)
        supported = supports(found.log, before, left, floor)
        kept = rms(counted(left, floor))
        tried.append(Tried(ranked, addition, fitted, left, kept, supported))
    tried.sort(key=lambda one: (not one.supported, one.error_w))
    return with_equals(tried)


def with_equals(tried: Sequence[Tried]) -> tuple[Tried, ...]:
    """The same, best first, with the effects that explain the log as well as the best one."""
    if not tried or not tried[0].supported:
        return tuple(tried)
    best, *others = tried
    enough = EQUAL_RATIO * best.error_w
    equals = tuple(one.name for one in others if one.supported and one.error_w <= enough)
    return replace(best, equals=equals), *others


def _local_columns(found: Found, examination: Examination, ranked: RankedTerm) -> list[int]:
    """Columns of a term in the examination of the rows in memory."""
    theirs = examination.competitors.library.candidates
    known = found.local.competitors.library.candidates
    return [
        found.local.competitors.candidate(known.index(theirs[n]))
        for n in ranked.member.term.columns
    ]
