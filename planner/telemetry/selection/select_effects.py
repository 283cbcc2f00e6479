"""Select effects: the best subset of competing terms, a ranking, and a shape beyond them.

    selection = select(examination)
    selection.members        # strongest first; () when nothing is missing
    selection.ranking      # ranking of all effects
    selection.shape          # what the catalogue does not explain, or None

The search is subset_search; off_catalogue looks for shapes outside the catalogue, and
full_refit_comparison finds ties.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from planner.arrays import Array
from planner.telemetry.evidence import Examination, Test
from planner.telemetry.other_terms import tolerance_of
from planner.telemetry.selection.off_catalogue import (
    ShapeFound,
    prefer_sensor_fault,
    shape_beyond,
    two_sided,
)
from planner.telemetry.selection.subset_search import CompetingModel, Member, SubsetScorer


@dataclass(frozen=True)
class RankedTerm:
    """How a single effect stands.

    Attributes:
        gain: log-likelihood that it gains alone over the model.
        z: its own test, given the other members if it was selected.
        size: ρ.
        probability: share of the weight of all subsets that have it.
        member: its best way of acting.
        coefficients: in the units of its parameters.
    """

    name: str
    gain: float
    z: float
    p_value: float
    size: float
    probability: float
    member: Member
    coefficients: Array

    @property
    def stderr(self) -> float:
        """Standard error of the first coefficient, by its test."""
        return abs(float(self.coefficients[0])) / max(self.z, 1e-9)


@dataclass(frozen=True)
class Selection:
    """What was found.

    Attributes:
        members: selected, strongest first.
        ties: name → names of alternatives that explain as much.
        ranking: every identifiable effect, best first.
        shape: what remains, or None.
        alternatives: subsets that were scored, best first, the members' own among them.
        exact: an error of a sensor is among the members; data sheet and sensors are otherwise taken
            for exact beside it. Without one, their usual errors stand beside every effect.
    """

    members: tuple[Member, ...]
    aliases: dict[str, tuple[str, ...]]
    ranking: tuple[RankedTerm, ...]
    shape: ShapeFound | None
    alternatives: tuple[CompetingModel, ...]
    exact: bool = False

    def ranked(self, name: str) -> RankedTerm:
        """The entry in the ranking of an effect or a sensor."""
        return next(ranked for ranked in self.ranking if ranked.name == name)


def select(
    examination: Examination,
    members: Sequence[Member] | None = None,
    sizes: Mapping[str, float] = MappingProxyType({}),
    *,
    exact: bool | None = None,
    shown: Collection[str] = (),
) -> Selection:
    """Choose among all competing terms.

    Args:
        examination: the log, summed up.
        members: take these instead of the best subset, as far as they pass the tests. Where they
            blame no sensor, none is blamed instead of a shape either: it has lost already.
        sizes: of members that were fitted in full.
        exact: as in Selection; None finds out whether a sensor is to blame.
        shown: names of members that held-out runs show beside the others; these need no test.
    """
    if exact is None:
        first = select(examination, members, sizes, exact=True, shown=shown)
        if any(_beyond_tolerance(examination, first, m) for m in first.members if m.sensor):
            return first
        exact = False
    scorer = SubsetScorer(examination, exact=exact)
    best = scorer.search()
    if members is not None:
        best = tuple(sorted(scorer.members.index(m) for m in members))
    chosen, tests = scorer.checked(best, sizes, shown)
    scorer.admit(chosen)
    shape = shape_beyond(scorer, chosen)
    honest = members is not None and not any(m.sensor for m in members)
    if shape is not None and not honest:
        chosen, tests, shape = prefer_sensor_fault(scorer, chosen, tests, shape)
    if shape is not None and shape.alone:
        chosen, tests = (), {}
    scorer.admit(chosen)  # a sensor may have taken the place of a shape
    order = sorted(chosen, key=lambda k: -scorer.gains.get((k,), (0.0,))[0])
    strongest_first = tuple(scorer.members[k] for k in order)
    ranking = _ranking(scorer, chosen, tests)
    return Selection(strongest_first, {}, ranking, shape, scorer.alternatives(chosen), exact)


def _beyond_tolerance(examination: Examination, selection: Selection, member: Member) -> bool:
    """Whether a sensor's error is larger than what may well be an error of the data sheet."""
    vehicle = examination.competitors.library.model.vehicle
    ranked = selection.ranked(member.name)
    size = abs(float(ranked.coefficients[0]))
    return size > tolerance_of(member.name, vehicle, ranked.stderr)


def _ranking(
    scorer: SubsetScorer, chosen: tuple[int, ...], tests: dict[str, Test]
) -> tuple[RankedTerm, ...]:
    shares = _shares(scorer, scorer.scored)
    best_subset: dict[str, int] = {}
    for k, member in enumerate(scorer.members):
        if (k,) not in scorer.gains:
            continue
        known = best_subset.get(member.name)
        if known is None or scorer.scored[k,] > scorer.scored[known,]:
            best_subset[member.name] = k
    picked = {scorer.members[k].name: k for k in chosen}
    best_subset |= picked
    singles = sorted({c for m in scorer.members for c in m.columns})
    z = dict(zip(singles, scorer.evidence.test_each(singles)[0], strict=True)) if singles else {}
    ranking = []
    for name, k in best_subset.items():
        member = scorer.members[k]
        gain, found = scorer.gains.get((k,), (0.0, np.zeros(len(member.columns))))
        test = tests.get(name)
        strongest = max(float(z[c]) for c in member.columns)
        if test is not None:
            found, strongest = test.coefficients, test.z
        p_value = test.p_value if test else two_sided(strongest)
        size = scorer.evidence.size(list(member.columns), found)
        share = shares[name]
        ranking.append(RankedTerm(name, gain, strongest, p_value, size, share, member, found))
    return tuple(sorted(ranking, key=lambda s: _rank(s, picked)))


def _rank(ranked: RankedTerm, picked: Collection[str]) -> tuple[bool, float, float]:
    return ranked.name not in picked, -ranked.probability, -ranked.gain


def _shares(scorer: SubsetScorer, scores: Mapping[tuple[int, ...], float]) -> dict[str, float]:
    """Name → share of the weight of all subsets that those with it have."""
    highest = max(scores.values())
    weights = {subset: float(np.exp(score - highest)) for subset, score in scores.items()}
    shares, total = {member.name: 0.0 for member in scorer.members}, sum(weights.values())
    for subset, weight in weights.items():
        for name in {scorer.members[k].name for k in subset}:
            shares[name] += weight / total
    # Rounding may add up to more than all.
    return {name: min(share, 1.0) for name, share in shares.items()}


def with_robust_probabilities(examination: Examination, selection: Selection) -> Selection:
    """The selection with probabilities that noise of any correlation does not inflate.

    A search weighs thousands of subsets by their likelihood, which is quick. What is told needs
    the scatter over clusters and runs (SubsetScorer.robust_scores).

    Args:
        examination: that the selection was made from.
        selection: whose members may have become fewer.
    """
    scorer = SubsetScorer(examination, exact=selection.exact)
    scorer.search()
    chosen = tuple(sorted(scorer.members.index(m) for m in selection.members))
    scorer.admit(chosen)
    shares = _shares(scorer, scorer.robust_scores(chosen))
    names = {m.name for m in selection.members}
    ranking = (replace(ranked, probability=shares[ranked.name]) for ranked in selection.ranking)
    return replace(selection, ranking=tuple(sorted(ranking, key=lambda s: _rank(s, names))))
