"""Which effects, and how sure: best subset, test of nothing missing, ties, shapes outside.

    selection = select(examination)
    selection.effects        # atoms to adopt, strongest first; () when nothing is missing
    selection.ties           # slug → slugs that explain the log as well
    selection.shape          # what the catalogue does not explain, or None

Subsets of up to three ways of acting (effects, and errors of sensors) are scored by the
log-likelihood that they gain, less a penalty that grows with the number of independent blocks and
of candidates. Coefficients keep to the side that the physics allows. A subset then has to pass

    a test of each member given the others, corrected for the number of candidates;
    a least size: what it adds must not drown in noise and in what any model leaves;
    comparisons with all rivals (Vuong): one that explains the log as well is a tie.

A shape of the dictionary that is significant beyond the subset, or alone explains more than it,
says that something lies outside the catalogue.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.telemetry.candidates import Atom
from planner.telemetry.evidence import Test
from planner.telemetry.examine import Examination

Floats = NDArray[np.float64]

MOST_EFFECTS = 3
SIGNIFICANT = 0.01
"""Probability of naming something when nothing is missing, over all candidates together."""
LEAST_SIZE = 0.15
"""ρ below which an effect is not named: what it adds, over the noise."""
LEAST_BESIDE = 0.08
"""Size of a member relative to the largest: the catalogue's form of an effect is never quite that
of the robot, and what it leaves over must not be taken for a second effect."""
LEAST_SHAPE_BESIDE = 0.2
"""The same for a shape, which finds more easily what an effect of another form leaves over."""
LEAST_CORRECTION = 0.05
"""The same for an error of a sensor that was found and corrected already."""
LEAST_SENSOR_SIZE = 0.1
"""The same for the error of a sensor, which overrules everything else that a log says."""
TIE_GAIN = 2.0
TIE_Z = 1.64
SURE_GAIN = 8.0
SAME_DIRECTION = 0.97
SHAPE_SIGNIFICANT = 0.002
LEAST_SHAPE_SIZE = 0.12
AS_GOOD = 0.8
"""Share of a shape's gain from which an error of a sensor explains the same."""
FAR_BEHIND = 60.0
"""Log-likelihood by which a rival may trail and still be compared block by block."""


@dataclass(frozen=True)
class Member:
    """One way of acting that competes: an atom of the catalogue, or an error of a sensor."""

    name: str
    columns: tuple[int, ...]
    sensor: bool
    atom: Atom | None
    scanned: bool


@dataclass(frozen=True)
class Standing:
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
    coefficients: Floats


@dataclass(frozen=True)
class ShapeFound:
    """A significant shape.

    Attributes:
        number: in the dictionary.
        column: in the examination.
        z: of its test beyond the selection.
        size: ρ.
        coefficient: W per unit of the shape.
        alone: True when it explains the log better than the selection, which it replaces.
        near: slugs of untestable effects that look the same in this log.
    """

    number: int
    column: int
    z: float
    size: float
    coefficient: float
    alone: bool
    near: tuple[str, ...]


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
    coefficients: tuple[Floats, ...]
    penalty: float
    score: float


@dataclass(frozen=True)
class Selection:
    """What was found.

    Attributes:
        members: selected, strongest first.
        ties: name → names of rivals that explain as much.
        standings: every effect that could be told, best first.
        shape: what remains, or None.
        none_p: probability of the strongest candidate's score if nothing were missing.
        tests: of the members, by name.
        rivals: subsets that were scored, best first, the members' own among them.
    """

    members: tuple[Member, ...]
    ties: dict[str, tuple[str, ...]]
    standings: tuple[Standing, ...]
    shape: ShapeFound | None
    none_p: float
    tests: dict[str, Test] = field(default_factory=dict)
    rivals: tuple[Rival, ...] = ()


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


class _Chooser:
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
        self.gains: dict[tuple[int, ...], tuple[float, Floats]] = {(): (0.0, np.zeros(0))}

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

    def gain(self, chosen: tuple[int, ...]) -> tuple[float, Floats] | None:
        """Log-likelihood and coefficients; None when the physics forbids their sign or size."""
        at = self.columns(chosen)
        value, found = self.evidence.gain(at)
        if np.any(found < self.low[at]) or np.any(found > self.high[at]):
            return None
        if np.any(np.abs(found) < self.least[at]):
            return None
        # Large errors of sensors are rare: half the square over their usual size counts against.
        return value - 0.5 * float(np.sum((found / self.usual[at]) ** 2)), found

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
            level = []
            for chosen in subsets:
                names = {self.members[k].name for k in chosen}
                if len(chosen) != count or len(names) != count:
                    continue
                found = self.gain(chosen)
                if found is None:
                    continue
                self.gains[chosen] = found
                self.scored[chosen] = found[0] - self.penalty(chosen)
                level.append((found[0], chosen))
            best_pairs = [chosen for _, chosen in sorted(level, reverse=True)[:25]]
        return max(self.scored, key=lambda chosen: self.scored[chosen])

    def find(self, members: Sequence[Member]) -> tuple[int, ...]:
        """The subset of given members."""
        return tuple(sorted(self.members.index(m) for m in members))

    def rivals(self, most: int = 400) -> tuple[Rival, ...]:
        """Subsets in the order of their score."""
        order = sorted(self.scored, key=lambda chosen: -self.scored[chosen])
        rivals = []
        for chosen in [c for c in order if c][:most]:
            parts, start = [], 0
            for k in chosen:
                stop = start + len(self.members[k].columns)
                parts.append(self.gains[chosen][1][start:stop])
                start = stop
            members = tuple(self.members[k] for k in chosen)
            charged = self.penalty(chosen)
            rivals.append(Rival(members, tuple(parts), charged, self.scored[chosen]))
        return tuple(rivals)

    def checked(self, chosen: tuple[int, ...]) -> tuple[tuple[int, ...], dict[str, Test]]:
        """Drop members that are not significant, or too small, given the others."""
        while chosen:
            tests, sizes = {}, {}
            for k in chosen:
                rest = self.columns([q for q in chosen if q != k])
                mine = self.members[k].columns
                tests[self.members[k].name] = test = self.evidence.test(mine, given=rest)
                sizes[k] = self.evidence.size(mine, test.coefficients, rest)
            worst, worst_k = -1.0, -1
            for k in chosen:
                p = min(1.0, tests[self.members[k].name].p_value * self.name_count)
                least = LEAST_SIZE
                if self.members[k].sensor:
                    known = self.least[self.members[k].columns[0]] == 0.0
                    least = LEAST_CORRECTION if known else LEAST_SENSOR_SIZE
                least = max(least, LEAST_BESIDE * max(sizes.values()))
                fault = max(p / SIGNIFICANT, least / max(sizes[k], 1e-12))
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

    def ties(self, chosen: tuple[int, ...]) -> dict[str, tuple[str, ...]]:
        """Rivals of every member that explain the log as well."""
        value = self.gains[chosen][0]
        mine = self.columns(chosen)
        names = {self.members[k].name for k in chosen}
        ties: dict[str, list[str]] = {name: [] for name in names}
        for other, (rival, _) in self.gains.items():
            if len(other) != len(chosen):
                continue
            other_names = {self.members[k].name for k in other}
            if other_names == names or len(other_names & names) != len(names) - 1:
                continue
            replaced = (names - other_names).pop()
            by = (other_names - names).pop()
            if by in ties[replaced]:
                continue
            same = self._same_direction(chosen, other, replaced, by)
            if not same and value - rival > FAR_BEHIND:
                continue
            gain, z = self.evidence.compare(mine, self.columns(other))
            unlikely = self._surprise(other) - self._surprise(chosen)
            gain, z = gain + unlikely, z * max(1.0 + unlikely / max(gain, 1.0), 0.0)
            if same or gain < TIE_GAIN or (z < TIE_Z and gain < SURE_GAIN):
                ties[replaced].append(by)
        return {name: tuple(rivals) for name, rivals in ties.items()}

    def _surprise(self, chosen: tuple[int, ...]) -> float:
        """How unusual the sizes of the sensors' errors are, as a log-likelihood."""
        at = self.columns(chosen)
        return 0.5 * float(np.sum((self.gains[chosen][1] / self.usual[at]) ** 2))

    def _same_direction(
        self, chosen: tuple[int, ...], other: tuple[int, ...], replaced: str, by: str
    ) -> bool:
        first = next(self.members[k] for k in chosen if self.members[k].name == replaced)
        second = next(self.members[k] for k in other if self.members[k].name == by)
        if len(first.columns) > 1 or len(second.columns) > 1:
            return False
        shared = self.columns([k for k in chosen if k in other])
        alike = self.evidence.likeness(first.columns[0], second.columns[0], shared)
        return alike > SAME_DIRECTION


def _lateness(members: Sequence[Member]) -> list[float]:
    first: dict[str, int] = {}
    for member in members:
        first[member.name] = min(first.get(member.name, member.columns[0]), member.columns[0])
    return [0.0 if m.scanned else float(m.columns[0] > first[m.name]) for m in members]


def _limits(examination: Examination) -> tuple[Floats, Floats]:
    """Range of every column's coefficient that the physics allows."""
    competitors = examination.competitors
    low = np.full(examination.evidence.columns, -np.inf)
    high = np.full(examination.evidence.columns, np.inf)
    for number, column in enumerate(competitors.library.candidates):
        at = competitors.candidate(number)
        # Linearised around the null value, a coefficient may overshoot its bound somewhat.
        low[at], high[at] = 1.5 * column.low, 1.5 * column.high
    for number, sensor in enumerate(competitors.sensors):
        at = competitors.sensor(number)
        low[at], high[at] = -sensor.limit, sensor.limit
    return low, high


def select(
    examination: Examination,
    members: Sequence[Member] | None = None,
    check: Callable[[], None] = lambda: None,
) -> Selection:
    """Choose among everything that competes.

    Args:
        examination: the log, summed up.
        members: take these instead of the best subset, as far as they pass the tests.
        check: called between the parts; raises when the caller was cancelled.
    """
    chooser = _Chooser(examination)
    evidence = examination.evidence
    best = chooser.search()
    if members is not None:
        best = chooser.find(members)
    check()
    chosen, tests = chooser.checked(best)
    singles = sorted({c for m in chooser.members for c in m.columns})
    z, _, _ = evidence.test_each(singles) if singles else (np.zeros(0), None, None)
    none_p = float(min(1.0, _two_sided(float(z.max())) * len(z))) if len(z) else 1.0
    check()
    ties = chooser.ties(chosen) if chosen else {}
    check()
    shape = _shape(examination, chooser, chosen)
    if shape is not None:
        chosen, tests, shape = _rather_a_sensor(examination, chooser, chosen, tests, shape)
        ties = {name: ties.get(name, ()) for name in (chooser.members[k].name for k in chosen)}
    order = sorted(chosen, key=lambda k: -_single_gain(chooser, k))
    return Selection(
        tuple(chooser.members[k] for k in order),
        ties,
        _standings(chooser, chosen, tests, singles, z),
        shape,
        none_p,
        tests,
        chooser.rivals(),
    )


def _two_sided(z: float) -> float:
    from scipy.stats import norm

    return float(2.0 * norm.sf(z))


def _single_gain(chooser: _Chooser, k: int) -> float:
    found = chooser.gains.get((k,))
    return found[0] if found else 0.0


def _standings(
    chooser: _Chooser,
    chosen: tuple[int, ...],
    tests: dict[str, Test],
    singles: Sequence[int],
    z: Floats,
) -> tuple[Standing, ...]:
    weights = {s: np.exp(v - max(chooser.scored.values())) for s, v in chooser.scored.items()}
    total = sum(weights.values())
    best_way: dict[str, int] = {}
    for k, member in enumerate(chooser.members):
        if (k,) not in chooser.gains:
            continue
        known = best_way.get(member.name)
        score = chooser.scored[k,]
        if known is None or score > chooser.scored[known,]:
            best_way[member.name] = k
    for k in chosen:
        best_way[chooser.members[k].name] = k
    place = {column: n for n, column in enumerate(singles)}
    standings = []
    for name, k in best_way.items():
        member = chooser.members[k]
        gain, found = chooser.gains.get((k,), (0.0, np.zeros(len(member.columns))))
        test = tests.get(name)
        strongest = max(float(z[place[c]]) for c in member.columns)
        if test is not None:
            found, strongest = test.coefficients, test.z
        probability = sum(
            w for s, w in weights.items() if any(chooser.members[q].name == name for q in s)
        )
        standings.append(
            Standing(
                name,
                gain,
                strongest,
                test.p_value if test else _two_sided(strongest),
                chooser.examination.size(list(member.columns), found),
                float(probability / total),
                member,
                found,
            )
        )
    picked = {chooser.members[k].name for k in chosen}
    return tuple(sorted(standings, key=lambda s: (s.name not in picked, -s.probability, -s.gain)))


def _shape(
    examination: Examination, chooser: _Chooser, chosen: tuple[int, ...]
) -> ShapeFound | None:
    """The strongest shape of the dictionary beyond the selection, if it means something."""
    evidence, competitors = examination.evidence, examination.competitors
    columns = [competitors.first_shape + k for k in examination.shapes]
    if not columns:
        return None
    mine = chooser.columns(chosen)
    z, found, information = evidence.test_each(columns, given=mine)
    best = int(np.argmax(z))
    del information
    p = min(1.0, _two_sided(float(z[best])) * len(columns))
    size = evidence.size([columns[best]], found[[best]], mine)
    least = max(LEAST_SHAPE_SIZE, LEAST_SHAPE_BESIDE * chooser.largest(chosen))
    significant = p < SHAPE_SIGNIFICANT and 0.5 * z[best] ** 2 > SURE_GAIN and size > least
    if chosen:
        # Would one shape alone do what the selection does? The strongest one alone is asked.
        alone_z, alone_found, alone_info = evidence.test_each(columns)
        gains = 0.5 * alone_found**2 * alone_info
        strongest = int(np.argmax(gains))
        gain, vuong = evidence.compare([columns[strongest]], mine)
        member_like = max((evidence.likeness(c, columns[strongest]) for c in mine), default=0.0)
        better = gain > 3.0 and vuong > TIE_Z and member_like < 0.9
        simpler = len(chosen) >= 2 and gain > -0.5 * np.log(max(evidence.block_count, 2)) - np.log(
            chooser.name_count
        )
        if better or simpler:
            return ShapeFound(
                examination.shapes[strongest],
                columns[strongest],
                float(alone_z[strongest]),
                evidence.size([columns[strongest]], alone_found[[strongest]]),
                float(alone_found[strongest]),
                True,
                _look_alikes(examination, columns[strongest]),
            )
    if not significant:
        return None
    return ShapeFound(
        examination.shapes[best],
        columns[best],
        float(z[best]),
        size,
        float(found[best]),
        not chosen,
        _look_alikes(examination, columns[best]),
    )


def _rather_a_sensor(
    examination: Examination,
    chooser: _Chooser,
    chosen: tuple[int, ...],
    tests: dict[str, Test],
    shape: ShapeFound,
) -> tuple[tuple[int, ...], dict[str, Test], ShapeFound | None]:
    """An error of a sensor that does what a shape does is the likelier explanation."""
    kept = () if shape.alone else chosen
    start = chooser.gains[kept][0] if kept in chooser.gains else 0.0
    mine = chooser.columns(kept)
    by_shape = examination.evidence.gain([*mine, shape.column])[0] - start
    best: tuple[float, tuple[int, ...]] | None = None
    for k, member in enumerate(chooser.members):
        both = tuple(sorted({*kept, k}))
        if member.sensor and k not in kept:
            found = chooser.gain(both)
            if found is not None and found[0] - start > AS_GOOD * by_shape:
                chooser.gains.setdefault(both, found)
                chooser.scored.setdefault(both, found[0] - chooser.penalty(both))
                if best is None or found[0] > best[0]:
                    best = (found[0], both)
    if best is None:
        return chosen, tests, shape
    passed, new_tests = chooser.checked(best[1])
    if not any(chooser.members[k].sensor for k in passed):
        return chosen, tests, shape
    return passed, new_tests, None


def _look_alikes(examination: Examination, column: int) -> tuple[str, ...]:
    """Effects that this log cannot tell and that run along with a shape."""
    evidence, competitors = examination.evidence, examination.competitors
    near = []
    for number, candidate in enumerate(competitors.library.candidates):
        at = competitors.candidate(number)
        if examination.testable.get(candidate.effect) is None:
            continue
        if evidence.clear[at, at] > 1e-9 * evidence.total[at, at]:
            if evidence.likeness(at, column) > 0.9:
                near.append(candidate.effect)
    return tuple(dict.fromkeys(near))
