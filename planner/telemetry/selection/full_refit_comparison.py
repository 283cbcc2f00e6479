"""Model comparison: competing sets of effects, fitted in full and ranked.

    ranked = FullFits(log, base, examination).compare(selection)
    ranked[0].names, ranked[0].ties

Gram matrices are linear around one model. Far from it, one strong effect can look like two or three
weaker ones, like a sensor fault, or like another effect. Before anything is named, several models
are fitted with all parameters free: the selection, its subsets, sets with one member replaced or
one more, and the best single effects and pairs. The penalised likelihood ranks them. An alternative
is tied unless it is clearly behind, cluster by cluster (Vuong's test).

A likelihood sees little of what is far above the noise: rows count at the clip, and whitening takes
what is slow for noise. So held-out runs may overrule it: a set goes before those that they support
it against, and is not tied with them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner.arrays import Array
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import Examination, solve
from planner.telemetry.holdout import heldout_residual, rms, supports
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import clipped, counted
from planner.telemetry.other_terms import measured_residual
from planner.telemetry.sampling import cluster_numbers
from planner.telemetry.selection.select_effects import Selection
from planner.telemetry.selection.subset_search import CompetingModel
from planner.telemetry.terms import Addition, fit_with

MOST_OTHERS = 3
"""Best single effects, and as many best pairs, that are fitted beside a larger set."""
MOST_NEIGHBOURS = 4
"""Sets in which one member is replaced that are fitted."""
MOST_LARGER = 2
"""Sets with one member more that are fitted: around a model that lacks several effects, one of them
looks smaller beside the others than it is."""
LEAST_LARGER_FALL = 0.1
"""Share of the selection's held-out error that such a set must take off: the catalogue's form of an
effect is never quite the robot's, and another effect may take what that leaves."""
ALIAS_GAIN = 2.0
"""Log-likelihood; an alternative that trails by less is tied whatever its z."""
ALIAS_Z = 1.64
"""z of the difference over clusters, below which an alternative within SURE_GAIN is tied."""
SURE_GAIN = 8.0
"""Log-likelihood of a clear lead; a sensor fault needs it over everything without one."""
LEAST_OVERRULING_RUNS = 5
"""Runs from which held-out runs overrule a likelihood: with fewer, every fold is a single run."""
FAR_BEHIND = 60.0
"""Score by which a set may trail around one linearisation and still be fitted."""


@dataclass(frozen=True, eq=False)
class Refit:
    """A competing model, fitted in full.

    Attributes:
        alternative: the competing model.
        score: log-likelihood less penalty.
        by_cluster: (clusters,) log-likelihood.
        left: (n,) W, held-out residual; () where nothing competes.
        ties: name of a member → names that explain the log as well in its place.
        sizes: name of a member → effect size ρ beside the others, where these were fitted alone.
        shown: names of members that held-out runs support beside the others, by as much as a
            formula needs.
    """

    alternative: CompetingModel
    score: float
    by_cluster: Array
    left: Array = field(default_factory=lambda: np.zeros(0))
    aliases: dict[str, tuple[str, ...]] = field(default_factory=dict)
    sizes: dict[str, float] = field(default_factory=dict)
    shown: frozenset[str] = frozenset()

    @property
    def names(self) -> frozenset[str]:
        """Of the members."""
        return self.alternative.names


@dataclass(frozen=True)
class FullFits:
    """Fits of competing models with all parameters free.

    Attributes:
        log: the rows.
        base: the model without additions, fitted.
        examination: of the same rows.
        check: called before every fit; raises when the caller was cancelled.
    """

    log: Telemetry
    base: Fit
    examination: Examination
    check: Callable[[], None] = lambda: None

    def compare(self, selection: Selection, known: Sequence[CompetingModel] = ()) -> list[Refit]:
        """Fit competing models and rank them, best first.

        Args:
            selection: the best set around one linearisation, and its alternatives.
            known: alternatives of earlier rounds, which this linearisation may misjudge.

        Returns:
            Those that do not trail far; later rounds may try them again.
        """
        competing = _competing(selection, known)
        if len(competing) == 1:
            return [Refit(competing[0], competing[0].score, np.zeros(0))]
        clusters = cluster_numbers(self.log)
        entries = []
        for model in competing:
            fitted = self._fitted(model)
            rows, surprise = self._likelihood(*fitted, exact=selection.exact)
            by_cluster = np.bincount(clusters, rows).astype(float)
            score = float(by_cluster.sum()) - model.penalty - surprise
            left = self._left(*fitted, exact=selection.exact)
            entries.append(Refit(model, score, by_cluster, left))

        def rank(entry: Refit) -> float:
            # A sensor fault is named only when it is clearly ahead of everything without one.
            return entry.score - SURE_GAIN * any(m.sensor for m in entry.alternative.members)

        chosen = frozenset(m.name for m in selection.members)
        kept = {model.names for model in known}
        entries = without_idle(entries, chosen, kept, self.log, self.examination.spread)
        entries.sort(key=rank, reverse=True)
        entries = predicting_best_first(entries, self.log, self.examination.spread)
        entries = [e for e in entries if entries[0].score - e.score < FAR_BEHIND]
        rows, _ = self.row_likelihood(CompetingModel((), ()), exact=selection.exact)
        nothing, count = np.bincount(clusters, rows).astype(float), len(self.log)
        return simpler_first(
            [
                replace(
                    e,
                    aliases=aliases_of(e, self._undecided(e, entries)),
                    sizes=sizes_of(e, entries, nothing, count),
                    shown=shown_in(e, entries, self.log, self.examination.spread),
                )
                for e in entries
            ]
        )

    def confirmed(self, selection: Selection, kind: str, *, again: bool = False) -> bool:
        """Whether a sensor fault makes the log likelier once everything else is fitted in full.

        Args:
            selection: what was selected.
            kind: a member of it.
            again: it was corrected before, supported by held-out runs, which it needs otherwise.
        """
        rest = tuple(m for m in selection.members if m.name != kind)
        with_it, without = (
            CompetingModel(some, tuple(selection.ranked(m.name).coefficients for m in some))
            for some in (selection.members, rest)
        )
        scores = []
        for model in (with_it, without):
            rows, surprise = self.row_likelihood(model)
            scores.append(float(rows.sum()) - surprise)
        if not scores[0] - scores[1] > SURE_GAIN:
            return False
        if again:
            return True
        before, after = (self._left(*self._fitted(each)) for each in (without, with_it))
        return supports(self.log, before, after, self.examination.spread)

    def row_likelihood(
        self, alternative: CompetingModel, *, exact: bool = True
    ) -> tuple[Array, float]:
        """(n,) log-likelihood of every row under a competing model, up to a constant.

        The second value is the log-likelihood that its sensors' errors cost, by how unusual their
        sizes are. Unless data sheet and sensors are taken for ``exact``, so do their usual errors,
        which then explain what they can.
        """
        return self._likelihood(*self._fitted(alternative), exact=exact)

    def _likelihood(
        self, corrected: Telemetry, fitted: Fit, sizes: dict[str, float], *, exact: bool
    ) -> tuple[Array, float]:
        """``row_likelihood`` of what ``_fitted`` gave."""
        log, examination = self.log, self.examination
        residual = measured_residual(fitted.residual, sizes)
        spread = examination.spread
        # What refitting and usual errors of data sheet and sensors can change.
        both = np.column_stack([fitted.columns, examination.given])
        beside = both[:, :0] if exact else both
        white = examination.noise.whiten(
            log, examination.watts, spread, np.column_stack([beside, clipped(residual, spread)])
        )
        left, cost = _relaxed(white, examination.given.shape[1] if not exact else 0)
        usual = {sensor.kind: sensor.usual for sensor in examination.competitors.sensors}
        cost += sum(0.5 * (size / usual[kind]) ** 2 for kind, size in sizes.items())
        return np.asarray(-0.5 * left**2), cost

    def _left(
        self, corrected: Telemetry, fitted: Fit, sizes: dict[str, float], *, exact: bool = True
    ) -> Array:
        """(n,) W, held-out residual of what ``_fitted`` gave, in watts as measured.

        Unless data sheet and sensors are ``exact``, their usual errors explain what they can where
        that predicts better.
        """
        given = [None] if exact else [None, self.examination.given]
        each = (heldout_residual(corrected, fitted, columns) for columns in given)
        return measured_residual(min(each, key=rms), sizes)

    def _undecided(self, winner: Refit, entries: Sequence[Refit]) -> list[Refit]:
        """The entries that held-out runs do not put behind one of them."""
        return [e for e in entries if not leads(winner, e, self.log, self.examination.spread)]

    def _fitted(self, alternative: CompetingModel) -> tuple[Telemetry, Fit, dict[str, float]]:
        """The log corrected for sensors' errors, the fit to it, and the sizes of these errors."""
        self.check()
        examination, corrected = self.examination, self.log
        library = examination.competitors.library
        additions, sizes = [], {}
        for member, values in zip(alternative.members, alternative.coefficients, strict=True):
            if not member.sensor:
                additions.append(Addition.of(library, member.term, values))
                continue
            sensor = next(s for s in examination.competitors.sensors if s.kind == member.name)
            sizes[sensor.kind] = size = float(values[0])
            corrected = sensor.correct(corrected, size)
        noise, within = examination.noise, library.model
        fitted = fit_with(self.base.model, corrected, additions, noise=noise, within=within)
        return corrected, fitted, sizes


def _relaxed(white: Array, given: int) -> tuple[Array, float]:
    """What columns (n, p + given + 1) leave of the last one, and what that costs.

    The ``given`` last columns before it have coefficients of standard deviation 1.
    """
    columns, residual = white[:, :-1], white[:, -1]
    if not columns.shape[1]:
        return residual, 0.0
    known = np.zeros(columns.shape[1])
    known[len(known) - given :] = 1.0
    found = solve(columns.T @ columns + np.diag(known), columns.T @ residual)
    return residual - columns @ found, float(0.5 * known @ found**2)


def predicting_best_first(entries: list[Refit], log: Telemetry, spread: Array) -> list[Refit]:
    """Move the set before the others that held-out runs support against the likeliest one.

    Of several, that which predicts them best, and so on from there. A sensor fault neither gains
    nor loses by it.

    Args:
        entries: likeliest first.
        log: the rows.
        spread: (n,) W, standard deviation of single rows.
    """
    best = entries[0]
    for each in sorted(entries, key=lambda entry: -rms(entry.left)):
        if leads(each, best, log, spread, chosen=True):
            best = each
    return [best, *(each for each in entries if each is not best)]


def leads(one: Refit, other: Refit, log: Telemetry, spread: Array, *, chosen: bool = False) -> bool:
    """Whether held-out runs support a set of effects against another one.

    One that is ``chosen`` out of several by its error needs as much as a formula.
    """
    sets = one.alternative, other.alternative
    if any(m.sensor for each in sets for m in each.members) or not len(one.left):
        return False
    # Where every fold is a single run, a rival may suit the few runs better by chance.
    if len(np.unique(log.run)) < LEAST_OVERRULING_RUNS:
        return False
    return supports(log, other.left, one.left, spread, formula=chosen)


def without_idle(
    entries: Sequence[Refit],
    chosen: frozenset[str],
    kept: Collection[frozenset[str]],
    log: Telemetry,
    spread: Array,
) -> list[Refit]:
    """The entries without larger sets that predict held-out runs little better than the chosen one.

    Args:
        entries: in any order.
        chosen: names of the members of the selection, which is among the entries.
        kept: names of the members of sets that stay, as an earlier round had them.
        log: the rows.
        spread: (n,) W, standard deviation of single rows.
    """
    selected = next(e for e in entries if e.names == chosen)
    enough = (1.0 - LEAST_LARGER_FALL) * rms(counted(selected.left, spread))

    def stays(entry: Refit) -> bool:
        if not chosen < entry.names or entry.names in kept:
            return True
        shown = leads(entry, selected, log, spread, chosen=True)
        return shown and rms(counted(entry.left, spread)) <= enough

    return [entry for entry in entries if stays(entry)]


def shown_in(
    winner: Refit, entries: Sequence[Refit], log: Telemetry, spread: Array
) -> frozenset[str]:
    """Members that held-out runs support beside the others, where these were fitted without it."""
    without = [e for e in entries if e.names < winner.names and len(winner.names - e.names) == 1]
    return frozenset[str]().union(
        *(winner.names - e.names for e in without if leads(winner, e, log, spread, chosen=True))
    )


def simpler_first(entries: list[Refit]) -> list[Refit]:
    """Move one sensor's error before several effects, each of which is tied with it.

    One faulty sensor is likelier than two missing effects that look like it.
    """
    aliased = [set(names) for names in entries[0].aliases.values()]
    if len(aliased) < 2:
        return entries
    for number, entry in enumerate(entries):
        members = entry.alternative.members
        alone = len(members) == 1 and members[0].sensor
        near = entries[0].score - entry.score < SURE_GAIN
        if alone and near and all(members[0].name in names for names in aliased):
            return [entry, *entries[:number], *entries[number + 1 :]]
    return entries


def aliases_of(winner: Refit, entries: Sequence[Refit]) -> dict[str, tuple[str, ...]]:
    """By member, what explains the log as well in its place."""
    aliases: dict[str, list[str]] = {name: [] for name in winner.names}
    for other in entries:
        gone, come = winner.names - other.names, other.names - winner.names
        if len(gone) != 1 or len(come) != 1:
            continue
        difference = winner.by_cluster - other.by_cluster
        scatter = float(difference.std()) * np.sqrt(len(difference)) + 1e-12
        gain, z = winner.score - other.score, float(difference.sum()) / scatter
        if gain < ALIAS_GAIN or (z < ALIAS_Z and gain < SURE_GAIN):
            aliases[next(iter(gone))].append(next(iter(come)))
    return {name: tuple(alternatives) for name, alternatives in aliases.items()}


def sizes_of(
    winner: Refit, entries: Sequence[Refit], nothing: Array, rows: int
) -> dict[str, float]:
    """By member, effect size beside the others, or alone, where these were fitted without it."""
    sizes = {}
    fitted = [(other.names, other.by_cluster) for other in entries]
    for names, by_cluster in [*fitted, (frozenset[str](), nothing)]:
        gone = winner.names - names
        if names < winner.names and len(gone) == 1:
            gain = max(0.0, float((winner.by_cluster - by_cluster).sum()))
            sizes[next(iter(gone))] = math.sqrt(2.0 * gain / rows)
    return sizes


def _competing(selection: Selection, known: Sequence[CompetingModel]) -> list[CompetingModel]:
    """The selection, its subsets, near alternatives, and the best singles and pairs."""
    chosen = CompetingModel(selection.members, ()).names
    wanted = {
        frozenset(some)
        for count in range(1, len(chosen) + 1)
        for some in itertools.combinations(sorted(chosen), count)
    }
    competing: dict[frozenset[str], CompetingModel] = {}
    counts = {1: 0, 2: 0}
    neighbours = larger = 0
    best = max((r.score for r in selection.alternatives), default=0.0)
    for alternative in selection.alternatives:  # best first
        names, size = alternative.names, len(alternative.members)
        if names in competing:
            continue
        near = len(names & chosen) == len(chosen) - 1 and size == len(chosen)
        if names in wanted:
            competing[names] = alternative
        elif chosen < names and size == len(chosen) + 1 and larger < MOST_LARGER:
            larger += 1
            competing[names] = alternative
        elif near and neighbours < MOST_NEIGHBOURS and best - alternative.score < FAR_BEHIND:
            neighbours += 1
            competing[names] = alternative
        elif len(chosen) > 1 and size in counts and counts[size] < MOST_OTHERS:
            counts[size] += 1
            competing[names] = alternative
    for alternative in known:
        competing.setdefault(alternative.names, alternative)
    return list(competing.values())
