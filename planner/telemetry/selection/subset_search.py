"""Subsets of what competes, scored: likelihood gained less a penalty, within what physics allows.

    chooser = Chooser(examination)
    chosen = chooser.search()               # numbers of the members of the best subset
    chosen, tests = chooser.checked(chosen) # without those that do not pass on their own

The penalty grows with the number of independent blocks (as in the Bayesian information criterion)
and of candidates; sensors' errors count by how usual their size is. A member has to pass a test
given the others, corrected for the number of candidates, and to be of a size that does not drown in
noise and in what any model leaves.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from planner.arrays import Array
from planner.telemetry.evidence import Examination, Test
from planner.telemetry.terms import Atom

MOST_EFFECTS = 3
SIGNIFICANT = 0.01
"""Probability of naming something when nothing is missing, over all candidates together."""
OVERSHOOT = 3.0
"""Times its bound that a coefficient may be in the sums, which are linear; a fit keeps to it."""
SENSOR_SIGNIFICANT = 1e-4
"""The same for errors of sensors, which overrule everything else that a log says."""
LEAST_SIZE = 0.15
"""ρ below which an effect is not named: what it adds, over the noise."""
LEAST_BESIDE = 0.08
"""Size of a member relative to the largest: the catalogue's form of an effect is never quite that
of the robot, and what it leaves over must not be taken for a second effect."""
LEAST_CORRECTION = 0.05
"""The same for an error of a sensor that was found and corrected already."""
LEAST_SENSOR_SIZE = 0.13
"""The same for the error of a sensor."""


@dataclass(frozen=True)
class Member:
    """One way of acting that competes: an atom of the catalogue, or an error of a sensor."""

    name: str
    columns: tuple[int, ...]
    sensor: bool
    atom: Atom | None
    scanned: bool

    @property
    def term(self) -> Atom:
        """The atom of a member that is no sensor; sensors have none, and callers leave them out."""
        assert self.atom is not None
        return self.atom


@dataclass(frozen=True)
class Rival:
    """A subset that was scored.

    Attributes:
        members: of the subset.
        coefficients: of each member.
        penalty: that its likelihood is charged.
        score: likelihood less penalty.
    """

    members: tuple[Member, ...]
    coefficients: tuple[Array, ...]
    penalty: float
    score: float


def members_of(examination: Examination) -> list[Member]:
    """All ways of acting that compete."""
    competitors = examination.competitors
    members = [
        Member(
            atom.effect,
            tuple(competitors.candidate(n) for n in atom.columns),
            False,
            atom,
            atom.scanned,
        )
        for atom in examination.atoms
    ]
    for number, sensor in enumerate(competitors.sensors):
        column = competitors.sensor(number)
        if examination.evidence.kept_share(column) > 2e-3:
            members.append(Member(sensor.kind, (column,), True, None, False))
    return members


class Chooser:
    """Scores subsets of everything that competes in one examination."""

    def __init__(self, examination: Examination) -> None:
        self.examination = examination
        self.evidence = examination.evidence
        self.members = members_of(examination)
        self.low, self.high = _limits(examination)
        self.least = np.zeros(self.evidence.columns)
        self.usual = np.full(self.evidence.columns, np.inf)
        for number, sensor in enumerate(examination.competitors.sensors):
            self.least[examination.competitors.sensor(number)] = sensor.least
            self.usual[examination.competitors.sensor(number)] = sensor.usual
        names = {m.name for m in self.members}
        self.name_count = max(len(names), 2)
        # Of parameters that do the same, the one that its effect declares first is taken.
        self.lateness = _lateness(self.members)
        self.scored: dict[tuple[int, ...], float] = {(): 0.0}
        self.gains: dict[tuple[int, ...], tuple[float, Array]] = {(): (0.0, np.zeros(0))}

    def columns(self, chosen: Sequence[int]) -> list[int]:
        return [c for k in chosen for c in self.members[k].columns]

    def penalty(self, chosen: Sequence[int]) -> float:
        blocks = 0.5 * np.log(max(self.evidence.block_count, 2))
        each = [
            blocks * len(self.members[k].columns)
            + np.log(self.name_count)
            + self.lateness[k]
            + (0.5 if self.members[k].scanned else 0.0)
            for k in chosen
        ]
        return float(sum(each))

    def gain(self, chosen: tuple[int, ...]) -> tuple[float, Array] | None:
        """Log-likelihood and coefficients; None when the physics forbids their sign or size."""
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
        best_pairs: list[tuple[int, ...]] = []
        for count in range(1, MOST_EFFECTS + 1):
            if count <= 2:
                subsets = list(itertools.combinations(everyone, count))
            else:
                subsets = sorted(
                    {tuple(sorted({*pair, k})) for pair in best_pairs for k in everyone}
                )
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
            best_pairs = [chosen for _, chosen in sorted(level, reverse=True)[:25]]
        return max(self.scored, key=lambda chosen: self.scored[chosen])

    def admit(self, chosen: tuple[int, ...]) -> None:
        """Score a subset whatever its coefficients are, so that it can be fitted."""
        if chosen not in self.scored:
            self.gains[chosen] = self.evidence.gain(self.columns(chosen))
            self.scored[chosen] = self.gains[chosen][0] - self.penalty(chosen)

    def find(self, members: Sequence[Member]) -> tuple[int, ...]:
        """The subset of given members."""
        return tuple(sorted(self.members.index(m) for m in members))

    def rivals(self, kept: tuple[int, ...], most: int = 400) -> tuple[Rival, ...]:
        """The best subsets, in the order of their score, and ``kept`` whatever its score."""
        ranked = sorted(self.scored, key=lambda chosen: -self.scored[chosen])
        best = {*[c for c in ranked if c][:most], kept}
        rivals = []
        for chosen in [c for c in ranked if c and c in best]:
            parts, start = [], 0
            for k in chosen:
                stop = start + len(self.members[k].columns)
                parts.append(self.gains[chosen][1][start:stop])
                start = stop
            members = tuple(self.members[k] for k in chosen)
            charged = self.penalty(chosen)
            rivals.append(Rival(members, tuple(parts), charged, self.scored[chosen]))
        return tuple(rivals)

    def checked(
        self, chosen: tuple[int, ...], fitted: Mapping[str, float] = MappingProxyType({})
    ) -> tuple[tuple[int, ...], dict[str, Test]]:
        """Drop members that are not significant, or too small, given the others.

        ``fitted`` are sizes out of full fits, which see more of an effect than the sums.
        """
        while chosen:
            tests, sizes = {}, {}
            for k in chosen:
                rest = self.columns([q for q in chosen if q != k])
                mine = self.members[k].columns
                tests[self.members[k].name] = test = self.evidence.test(mine, given=rest)
                size = self.evidence.size(mine, test.coefficients, rest)
                sizes[k] = max(size, fitted.get(self.members[k].name, 0.0))
            worst, worst_k = -1.0, -1
            for k in chosen:
                p = min(1.0, tests[self.members[k].name].p_value * self.name_count)
                least, significant = LEAST_SIZE, SIGNIFICANT
                if self.members[k].sensor:
                    significant = SENSOR_SIGNIFICANT
                    known = self.least[self.members[k].columns[0]] == 0.0
                    least = LEAST_CORRECTION if known else LEAST_SENSOR_SIZE
                least = max(least, LEAST_BESIDE * max(sizes.values()))
                fault = max(p / significant, least / max(sizes[k], 1e-12))
                if fault > worst:
                    worst, worst_k = fault, k
            if worst <= 1.0:
                return chosen, tests
            chosen = tuple(q for q in chosen if q != worst_k)
        return (), {}

    def largest(self, chosen: tuple[int, ...]) -> float:
        """ρ of the largest member of a subset, 0 for none."""
        sizes = [0.0]
        for k in chosen:
            rest = self.columns([q for q in chosen if q != k])
            mine = self.members[k].columns
            test = self.evidence.test(mine, given=rest)
            sizes.append(self.evidence.size(mine, test.coefficients, rest))
        return max(sizes)


def _lateness(members: Sequence[Member]) -> list[float]:
    first: dict[str, int] = {}
    for member in members:
        first[member.name] = min(first.get(member.name, member.columns[0]), member.columns[0])
    return [0.0 if m.scanned else float(m.columns[0] > first[m.name]) for m in members]


def _limits(examination: Examination) -> tuple[Array, Array]:
    """Range of every column's coefficient that the physics allows."""
    competitors = examination.competitors
    low = np.full(examination.evidence.columns, -np.inf)
    high = np.full(examination.evidence.columns, np.inf)
    for number, column in enumerate(competitors.library.candidates):
        at = competitors.candidate(number)
        # Linearised around the null value, a coefficient may overshoot its bound somewhat.
        low[at], high[at] = OVERSHOOT * column.low, OVERSHOOT * column.high
    for number, sensor in enumerate(competitors.sensors):
        at = competitors.sensor(number)
        low[at], high[at] = -sensor.limit, sensor.limit
    return low, high
