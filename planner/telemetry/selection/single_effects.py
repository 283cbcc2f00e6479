"""Single effects fitted in full, judged on held-out runs: what a search on sums may overlook.

    tried = fitted_singles(found, linear, before, floor)
    tried[0].name, tried[0].residual, tried[0].supported

A search works around one linearisation, and with one picture of the noise. A strong effect may bend
both, and a whole run on other ground may look like a few outliers. Held-out runs then still show
the effect. The best ones by their linear held-out error are fitted with everything free.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from planner.arrays import Array
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import Examination
from planner.telemetry.holdout import (
    LinearHeldout,
    rms,
    supports,
)
from planner.telemetry.noise import counted
from planner.telemetry.selection.found import Found
from planner.telemetry.selection.select_effects import RankedTerm
from planner.telemetry.selection.subset_search import Member
from planner.telemetry.terms import Addition

MOST_TRIED = 4
"""Effects that are fitted in full."""
LEAST_TRIED_Z = 3.0
"""Standard errors of its own test, from which an effect is tried whatever its linear error."""
EQUAL_SHARE = 0.8
"""Share of the squared error that the best one takes off, from which another explains a log as
well. Errors of sensors that no column describes look a little like many effects."""

SHIFT_DRAG = {"wheel_imbalance", "com_offset"}
"""Effects that shift drag from wheel to wheel: a mass off the centre loads the wheels unevenly, so
that several columns of the one together are what the other does."""


@dataclass(frozen=True)
class Tried:
    """One effect, fitted in full with the model.

    Attributes:
        ranked: its entry in the ranking.
        addition: how it was added.
        fit: of the model with it.
        residual: (n,) W on held-out runs.
        beside: (n,) W, the same while the base model keeps its stated parts.
        error_w: W, its root mean square, rows far out counted at the clip.
        supported: whether held-out runs support it.
        equals: slugs of its aliases that explain the log as well, of the best one.
        competing: slugs that explain it as well by other columns, of the best one.
    """

    ranked: RankedTerm
    addition: Addition
    fit: Fit
    residual: Array
    beside: Array
    error_w: float
    supported: bool
    equals: tuple[str, ...] = ()
    competing: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Slug of the effect."""
        return self.ranked.name

    def competes_with(self, found: Found, member: Member, error_w: float, before_w: float) -> bool:
        """Whether it explains the log as well as another effect does, by other columns.

        Args:
            found: state of the search that selected the other effect.
            member: the other effect.
            error_w: W, the held-out error with that.
            before_w: W, the error without any of them.
        """
        as_good = self.error_w <= _enough(error_w, before_w)
        return as_good and not _are_aliased(found.examination, member, self.ranked.member)

    def equals_to(self, found: Found, member: Member, error_w: float, before_w: float) -> bool:
        """Whether it explains the log as well as another effect, by the same columns."""
        as_good = self.error_w <= _enough(error_w, before_w) and self.name != member.name
        return as_good and _are_aliased(found.examination, member, self.ranked.member)


def fitted_singles(
    found: Found,
    linear: LinearHeldout,
    before: Array,
    floor: Array,
    competing_with: Member | None = None,
) -> tuple[Tried, ...]:
    """The most promising effects, each fitted alone; supported ones first, by held-out error.

    Args:
        found: state of the search.
        linear: held-out errors around its last linearisation.
        before: (n,) W, held-out residual of the model without anything added.
        floor: (n,) W, spread of single rows.
        competing_with: fit none unless some other effect may explain the log as well as this one.
    """
    library = found.examination.competitors.library
    # Around the same linearisation: what is given may be wrong in both.
    error = linear.rmse([])
    enough, own = math.inf, ""
    if competing_with is not None:
        own = competing_with.name
        enough = _enough(linear.rmse(competing_with.columns), error)
    competed, promising = False, []
    for ranked in found.selection.ranking:
        if ranked.member.sensor:
            continue
        expected = linear.rmse(ranked.member.columns)
        competed |= ranked.name != own and expected <= enough
        if expected < error or ranked.z >= LEAST_TRIED_Z:
            promising.append((expected, ranked))
    tried: list[Tried] = []
    if not competed:
        return ()
    for _, ranked in sorted(promising, key=lambda entry: entry[0])[:MOST_TRIED]:
        addition = Addition.of(library, ranked.member.term, ranked.coefficients)
        addition = addition.completed(library)
        fitted = found.refit((addition,))
        left = found.heldout(fitted)
        beside = found.left_beside_base(fitted)
        beside = left if beside is None else beside
        supported = supports(found.log, before, beside, floor)
        kept = rms(counted(beside, floor))
        tried.append(Tried(ranked, addition, fitted, left, beside, kept, supported))
    tried.sort(key=lambda one: (not one.supported, one.error_w))

    def clear(one: Tried, other: Tried) -> bool:
        return supports(found.log, other.beside, one.beside, floor)

    def aliased(one: Tried, other: Tried) -> bool:
        return _are_aliased(found.examination, one.ranked.member, other.ranked.member)

    return with_equals(tried, rms(counted(before, floor)), aliased, clear)


def _are_aliased(examination: Examination, one: Member, other: Member) -> bool:
    """Whether two effects have the same columns, up to a factor or together."""
    if {one.name, other.name} == SHIFT_DRAG:
        return True
    pairs = itertools.product(one.columns, other.columns)
    return any(examination.evidence.aliased(*pair) for pair in pairs)


def with_equals(
    tried: Sequence[Tried],
    before_w: float,
    aliased: Callable[[Tried, Tried], bool],
    clear: Callable[[Tried, Tried], bool],
) -> tuple[Tried, ...]:
    """The same, best first, with the effects that explain the log as well as the best one.

    Args:
        tried: supported ones first, by their error.
        before_w: W, the error without any of them.
        aliased: whether two effects have the same columns, up to a factor.
        clear: whether held-out runs support the first against the second.
    """
    if not tried or not tried[0].supported:
        return tuple(tried)
    best, *others = tried
    enough = _enough(best.error_w, before_w)
    # What the search may have overlooked was chosen by its error, so it must lead clearly.
    equal = [
        one for one in others if one.error_w <= enough or (one.supported and not clear(best, one))
    ]
    alike = tuple(one.name for one in equal if aliased(best, one))
    competing = tuple(one.name for one in equal if one.name not in alike)
    return replace(best, equals=alike, competing=competing), *others


def _enough(error_w: float, before_w: float) -> float:
    """W, held-out error that takes off nearly as much of the squared error as another one does."""
    return math.sqrt(max(before_w**2 - EQUAL_SHARE * (before_w**2 - error_w**2), 0.0))
