"""Subset search: sets of candidate terms, scored by penalised likelihood within physical bounds.

    scorer = SubsetScorer(examination)
    chosen = scorer.search()               # numbers of the members of the best subset
    chosen, tests = scorer.checked(chosen) # without members that fail their own test

The penalty grows with the number of clusters (as in the Bayesian information criterion) and of
candidates. A sensor's error also costs the more the less usual its size is. A member must pass a
test given the others, corrected for the number of candidates. It must also be large enough against
the noise and against the misfit of any model.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from planner.arrays import Array
from planner.telemetry.evidence import Examination, Test
from planner.telemetry.terms import Term

MOST_EFFECTS = 3
"""Members of the largest set that is searched."""
GROWN_SETS = 25
"""Best pairs that a third member is tried with."""
SIGNIFICANCE = 0.01
"""p-value over all candidates together, above which an effect is not named."""
BOUND_OVERSHOOT = 3.0
"""Factor by which a linearised coefficient may exceed its bound; a fit keeps to the bound."""
SENSOR_SIGNIFICANCE = 1e-4
"""p-value over all candidates for a sensor fault, which overrules everything else in a log."""
LEAST_SIZE = 0.15
"""Effect size ρ (rms over the noise) below which an effect is not named."""
LEAST_RELATIVE_SIZE = 0.08
"""Size of a member over the largest. The catalogue's form of an effect is never quite the robot's,
and the misfit must not pass for a second effect."""
LEAST_REPEATED_SENSOR_SIZE = 0.05
"""Effect size below which a sensor that was corrected already is not corrected again."""
UNEXPECTED = 2.5
"""Log-likelihood that errors of sensors and data sheet beyond the usual ones gain for a candidate
of any log. On drawn logs a candidate that nobody named was there twelve times as rarely as its own
gain says (tests.benchmarks.naming --laboratory)."""
NEGLIGIBLE = 12.0
"""Log-likelihood below the best subset's from which a subset has no share in a probability."""
LEAST_SENSOR_SIZE = 0.13
"""Effect size below which a sensor fault is not named."""


@dataclass(frozen=True)
class Member:
    """What may be in a set: a term of the catalogue, or the error of a sensor.

    Attributes:
        name: slug of the effect, or kind of the sensor.
        columns: of the design matrix.
        catalogue_term: None for a sensor.
    """

    name: str
    columns: tuple[int, ...]
    catalogue_term: Term | None = None

    @property
    def sensor(self) -> bool:
        """Whether it is the error of a sensor."""
        return self.catalogue_term is None

    @property
    def term(self) -> Term:
        """The term; callers leave sensors out, which have none."""
        assert self.catalogue_term is not None
        return self.catalogue_term


@dataclass(frozen=True)
class CompetingModel:
    """A subset that was scored.

    Attributes:
        members: of the subset.
        coefficients: of each member.
        penalty: that its likelihood is charged.
        score: likelihood less penalty.
    """

    members: tuple[Member, ...]
    coefficients: tuple[Array, ...]
    penalty: float = 0.0
    score: float = 0.0

    @property
    def names(self) -> frozenset[str]:
        """Of the members."""
        return frozenset(member.name for member in self.members)


def members_of(examination: Examination, *, exact: bool = True) -> list[Member]:
    """All terms that compete; where data sheet and sensors are ``exact``, their errors too."""
    competitors = examination.competitors
    members = [
        Member(term.effect, tuple(competitors.candidate(n) for n in term.columns), term)
        for term in examination.terms
    ]
    for number, sensor in enumerate(competitors.sensors if exact else ()):
        column = competitors.sensor(number)
        if examination.exact.tolerance(column) > 2e-3:
            members.append(Member(sensor.kind, (column,)))
    return members


class SubsetScorer:
    """Scores subsets of terms of one examination.

    Args:
        examination: of the log.
        exact: take data sheet and sensors for exact; then errors of sensors compete, too.
            Otherwise their usual errors stand beside every subset.
    """

    def __init__(self, examination: Examination, *, exact: bool = False) -> None:
        self.examination, self.exact = examination, exact
        self.evidence = examination.exact if exact else examination.evidence
        self.members = members_of(examination, exact=exact)
        self.low, self.high = _limits(examination)
        self.least = np.zeros(self.evidence.columns)
        self.usual = np.full(self.evidence.columns, np.inf)
        for number, sensor in enumerate(examination.competitors.sensors):
            self.least[examination.competitors.sensor(number)] = sensor.least
            self.usual[examination.competitors.sensor(number)] = sensor.usual
        names = {m.name for m in self.members}
        self.name_count = max(len(names), 2)
        self.charges = _charges(self.members)
        self.scored: dict[tuple[int, ...], float] = {(): 0.0}
        self.gains: dict[tuple[int, ...], tuple[float, Array]] = {(): (0.0, np.zeros(0))}

    def columns(self, chosen: Sequence[int]) -> list[int]:
        return [c for k in chosen for c in self.members[k].columns]

    def penalty(self, chosen: Sequence[int]) -> float:
        column = 0.5 * np.log(max(self.evidence.cluster_count, 2))
        each = [
            column * len(self.members[k].columns) + np.log(self.name_count) + self.charges[k]
            for k in chosen
        ]
        return float(sum(each))

    def gain(self, chosen: tuple[int, ...]) -> tuple[float, Array] | None:
        """Log-likelihood gain and coefficients; None when physics forbids their sign or size."""
        return next(((value, found) for _, value, found in self._gains([chosen])), None)

    def _gains(self, subsets: Sequence[tuple[int, ...]]) -> Iterator[tuple[int, float, Array]]:
        """Place in ``subsets``, log-likelihood and coefficients of those that physics allows."""
        by_length: dict[int, list[tuple[int, list[int]]]] = {}
        for place, chosen in enumerate(subsets):
            at = self.columns(chosen)
            by_length.setdefault(len(at), []).append((place, at))
        for alike in by_length.values():
            columns = np.array([at for _, at in alike], int)
            values, found = self.evidence.gains(columns)
            # Sign and size must be possible.
            able = (found >= self.low[columns]) & (found <= self.high[columns])
            able &= np.abs(found) >= self.least[columns]
            # Large errors of sensors are rare: half the square over the usual size counts against.
            values -= 0.5 * np.sum((found / self.usual[columns]) ** 2, axis=1)
            for number in np.flatnonzero(able.all(axis=1)):
                yield alike[number][0], float(values[number]), found[number]

    def search(self) -> tuple[int, ...]:
        """Score subsets up to MOST_EFFECTS; the best one."""
        everyone = range(len(self.members))
        best: list[tuple[int, ...]] = []
        for count in range(1, MOST_EFFECTS + 1):
            subsets = list(itertools.combinations(everyone, min(count, 2)))
            if count > 2:
                subsets = sorted({tuple(sorted({*some, k})) for some in best for k in everyone})
            subsets = [
                chosen
                for chosen in subsets
                if len(chosen) == count and len({self.members[k].name for k in chosen}) == count
            ]
            level = []
            for place, value, found in sorted(self._gains(subsets), key=lambda entry: entry[0]):
                chosen = subsets[place]
                self.gains[chosen] = value, found
                self.scored[chosen] = value - self.penalty(chosen)
                level.append((value, chosen))
            best = [chosen for _, chosen in sorted(level, reverse=True)[:GROWN_SETS]]
        return max(self.scored, key=lambda chosen: self.scored[chosen])

    def robust_scores(self, chosen: tuple[int, ...]) -> dict[tuple[int, ...], float]:
        """Scores of all subsets; of what they add to the chosen one, by the scatter of clusters.

        A likelihood takes the rows for as independent as the whitening says. Errors of sensors last
        longer, and gain likelihood wherever they go along with a column. How much its score
        scatters over clusters and runs says what such a gain is worth, less what is UNEXPECTED.
        """
        scores = dict(self.scored)
        base, kept = scores[chosen], set(chosen)
        best = base
        for subset in sorted(self.scored, key=lambda each: -self.scored[each]):
            score = self.scored[subset]
            if score < best - NEGLIGIBLE:
                break
            added = [k for k in subset if k not in kept]
            if added and kept <= set(subset):
                gain = self.evidence.robust_gain(self.columns(added), self.columns(chosen))
                gain -= self.penalty(added) + UNEXPECTED * len(added)
                score = scores[subset] = min(score, base + gain)
            best = max(best, score)
        return scores

    def admit(self, chosen: tuple[int, ...]) -> None:
        """Score a subset whatever its coefficients are, so that it can be fitted."""
        if chosen not in self.scored:
            self.gains[chosen] = self.evidence.gain(self.columns(chosen))
            self.scored[chosen] = self.gains[chosen][0] - self.penalty(chosen)

    def alternatives(self, kept: tuple[int, ...], most: int = 400) -> tuple[CompetingModel, ...]:
        """The best subsets, in the order of their score, and ``kept`` whatever its score."""
        ranked = sorted(self.scored, key=lambda chosen: -self.scored[chosen])
        best = {*[c for c in ranked if c][:most], kept}
        alternatives = []
        for chosen in [c for c in ranked if c and c in best]:
            members = tuple(self.members[k] for k in chosen)
            ends = np.cumsum([len(m.columns) for m in members])[:-1]
            parts = tuple(np.split(self.gains[chosen][1], ends))
            alternatives.append(
                CompetingModel(members, parts, self.penalty(chosen), self.scored[chosen])
            )
        return tuple(alternatives)

    def checked(
        self,
        chosen: tuple[int, ...],
        fitted: Mapping[str, float] = MappingProxyType({}),
        shown: Collection[str] = (),
    ) -> tuple[tuple[int, ...], dict[str, Test]]:
        """Drop members that are not significant, or too small, given the others.

        ``fitted`` are sizes out of full fits, which see more of an effect than the sums. So do
        held-out runs: what they have ``shown`` stays. Sums let parameters of the model pass the
        ends of their ranges, and there these may do what the effect does.
        """
        while chosen:
            tests, sizes = self._tested(chosen, fitted)
            worst, worst_k = -1.0, -1
            for k in chosen:
                member = self.members[k]
                if member.name in shown:
                    continue
                p = min(1.0, tests[member.name].p_value * self.name_count)
                least, significant = LEAST_SIZE, SIGNIFICANCE
                if member.sensor:
                    significant = SENSOR_SIGNIFICANCE
                    known = self.least[member.columns[0]] == 0.0
                    least = LEAST_REPEATED_SENSOR_SIZE if known else LEAST_SENSOR_SIZE
                least = max(least, LEAST_RELATIVE_SIZE * max(sizes.values()))
                fault = max(p / significant, least / max(sizes[k], 1e-12))
                if fault > worst:
                    worst, worst_k = fault, k
            if worst <= 1.0:
                return chosen, tests
            chosen = tuple(q for q in chosen if q != worst_k)
        return (), {}

    def largest(self, chosen: tuple[int, ...]) -> float:
        """ρ of the largest member of a subset, 0 for none."""
        return max(self._tested(chosen)[1].values(), default=0.0)

    def _tested(
        self, chosen: tuple[int, ...], fitted: Mapping[str, float] = MappingProxyType({})
    ) -> tuple[dict[str, Test], dict[int, float]]:
        """Test by name, and effect size by number, of every member given the others."""
        tests, sizes = {}, {}
        for k in chosen:
            rest = self.columns([q for q in chosen if q != k])
            mine, name = self.members[k].columns, self.members[k].name
            tests[name] = test = self.evidence.test(mine, given=rest)
            size = self.evidence.size(mine, test.coefficients, rest)
            sizes[k] = max(size, fitted.get(name, 0.0))
        return tests, sizes


def _charges(members: Sequence[Member]) -> list[float]:
    """Log-likelihood that a form costs: half for a scanned shape, one for a later parameter."""
    first: dict[str, int] = {}
    for member in members:
        first[member.name] = min(first.get(member.name, member.columns[0]), member.columns[0])
    later = [float(m.columns[0] > first[m.name]) for m in members]
    terms = [m.catalogue_term for m in members]
    return [0.5 if t and t.scanned else late for t, late in zip(terms, later, strict=True)]


def _limits(examination: Examination) -> tuple[Array, Array]:
    """Range of every column's coefficient that the physics allows."""
    competitors = examination.competitors
    low = np.full(examination.evidence.columns, -np.inf)
    high = np.full(examination.evidence.columns, np.inf)
    for number, column in enumerate(competitors.library.candidates):
        at = competitors.candidate(number)
        # Linearised around the null value, a coefficient may overshoot its bound somewhat.
        low[at], high[at] = BOUND_OVERSHOOT * column.low, BOUND_OVERSHOOT * column.high
    for number, sensor in enumerate(competitors.sensors):
        at = competitors.sensor(number)
        low[at], high[at] = -sensor.limit, sensor.limit
    return low, high
