"""Explanations fitted in full and compared: is a simple one as good as several effects together?

    ranked, near = contest(log, base, examination, selection)
    ranked[0].members, ranked[0].ties

Sums are linear around one model. Far from it a single strong effect can look like two or three
weaker ones, like the error of a sensor, or like another effect. So before anything is named, the
selection, its subsets, rivals that come near it and the best single effects and pairs are fitted
with all parameters free. The likelihood less the penalty of the selection decides; what is not
clearly behind, block by block (Vuong's test), is a tie.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner.arrays import Array
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import Examination
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import clipped
from planner.telemetry.other_terms import seen_after
from planner.telemetry.sampling import block_numbers
from planner.telemetry.selection.select_effects import Selection
from planner.telemetry.selection.subset_search import Rival
from planner.telemetry.terms import Addition, fit_with

MOST_OTHERS = 3
"""Best single effects, and as many best pairs, that are fitted beside a larger set."""
MOST_NEIGHBOURS = 4
"""Sets in which one member is replaced that are fitted."""
TIE_GAIN = 2.0
TIE_Z = 1.64
SURE_GAIN = 8.0
"""A rival is tied that trails by less than the first, or, at less than this z, than the last."""
FAR_BEHIND = 60.0
"""Score by which such a set may trail in the sums and still be fitted."""


@dataclass(frozen=True, eq=False)
class Refit:
    """A competing model, fitted in full.

    Attributes:
        rival: the model.
        score: log-likelihood less penalty.
        by_cluster: (clusters,) log-likelihood.
        ties: name of a member → names that explain the log as well in its place.
        sizes: name of a member → effect size ρ beside the others, where these were fitted alone.
    """

    rival: Rival
    score: float
    by_cluster: Array
    ties: dict[str, tuple[str, ...]] = field(default_factory=dict)
    sizes: dict[str, float] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Of the members."""
        return self.rival.names


def contest(
    log: Telemetry,
    base: Fit,
    examination: Examination,
    selection: Selection,
    known: Sequence[Rival] = (),
    check: Callable[[], None] = lambda: None,
) -> list[Refit]:
    """Fit competing models in full and rank them, best first.

    Args:
        log: the rows.
        base: the model without additions, fitted.
        examination: of the same rows.
        selection: what the sums say; its rivals are tried.
        known: rivals from before, which the sums around another model may not do justice to.
        check: called before every fit; raises when the caller was cancelled.

    Returns:
        Those that do not trail far; later rounds may try them again.
    """
    competing = _competing(selection, known)
    if len(competing) == 1:
        return [Refit(competing[0], competing[0].score, np.zeros(0))]
    clusters = block_numbers(log)
    entries = []
    for rival in competing:
        check()
        rows, surprise = row_likelihood(log, base, examination, rival)
        by_cluster = np.bincount(clusters, rows).astype(float)
        entries.append(Refit(rival, float(by_cluster.sum()) - rival.penalty - surprise, by_cluster))

    def rank(entry: Refit) -> float:
        # A sensor fault is named only when it is clearly ahead of everything without one.
        return entry.score - SURE_GAIN * any(m.sensor for m in entry.rival.members)

    entries.sort(key=rank, reverse=True)
    entries = [e for e in entries if entries[0].score - e.score < FAR_BEHIND]
    check()
    rows, _ = row_likelihood(log, base, examination, Rival((), ()))
    nothing = np.bincount(clusters, rows).astype(float)
    return simpler_first(
        [
            replace(e, ties=ties_of(e, entries), sizes=sizes_of(e, entries, nothing, len(log)))
            for e in entries
        ]
    )


def simpler_first(entries: list[Refit]) -> list[Refit]:
    """Move one sensor's error before several effects, each of which is tied with it.

    One faulty sensor is likelier than two missing effects that look like it.
    """
    tied = [set(names) for names in entries[0].ties.values()]
    if len(tied) < 2:
        return entries
    for number, entry in enumerate(entries):
        members = entry.rival.members
        alone = len(members) == 1 and members[0].sensor
        near = entries[0].score - entry.score < SURE_GAIN
        if alone and near and all(members[0].name in names for names in tied):
            return [entry, *entries[:number], *entries[number + 1 :]]
    return entries


def ties_of(winner: Refit, entries: Sequence[Refit]) -> dict[str, tuple[str, ...]]:
    """By member, what explains the log as well in its place."""
    ties: dict[str, list[str]] = {name: [] for name in winner.names}
    for other in entries:
        gone, come = winner.names - other.names, other.names - winner.names
        if len(gone) != 1 or len(come) != 1:
            continue
        difference = winner.by_cluster - other.by_cluster
        scatter = float(difference.std()) * np.sqrt(len(difference)) + 1e-12
        gain, z = winner.score - other.score, float(difference.sum()) / scatter
        if gain < TIE_GAIN or (z < TIE_Z and gain < SURE_GAIN):
            ties[next(iter(gone))].append(next(iter(come)))
    return {name: tuple(rivals) for name, rivals in ties.items()}


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


def _competing(selection: Selection, known: Sequence[Rival]) -> list[Rival]:
    """The selection, its subsets, the best singles and pairs, and near rivals of one member."""
    chosen = Rival(selection.members, ()).names
    wanted = {
        frozenset(some)
        for count in range(1, len(chosen) + 1)
        for some in itertools.combinations(sorted(chosen), count)
    }
    competing: dict[frozenset[str], Rival] = {}
    counts = {1: 0, 2: 0}
    neighbours = 0
    best = max((r.score for r in selection.rivals), default=0.0)
    for rival in selection.rivals:  # best first
        names, size = rival.names, len(rival.members)
        if names in competing:
            continue
        near = len(names & chosen) == len(chosen) - 1 and size == len(chosen)
        if names in wanted:
            competing[names] = rival
        elif near and neighbours < MOST_NEIGHBOURS and best - rival.score < FAR_BEHIND:
            neighbours += 1
            competing[names] = rival
        elif len(chosen) > 1 and size in counts and counts[size] < MOST_OTHERS:
            counts[size] += 1
            competing[names] = rival
    for rival in known:
        competing.setdefault(rival.names, rival)
    return list(competing.values())


def confirmed(
    log: Telemetry,
    base: Fit,
    examination: Examination,
    selection: Selection,
    kind: str,
    check: Callable[[], None] = lambda: None,
) -> bool:
    """Whether a selected sensor's error makes the log likelier once all the rest is fitted in full.

    Arguments as ``contest``; ``kind`` is a member of the selection.
    """
    members = selection.members
    rest = tuple(m for m in members if m.name != kind)
    scores = []
    for some in (members, rest):
        check()
        sizes = tuple(selection.standing(m.name).coefficients for m in some)
        rows, surprise = row_likelihood(log, base, examination, Rival(some, sizes))
        scores.append(float(rows.sum()) - surprise)
    return scores[0] - scores[1] > SURE_GAIN


def row_likelihood(
    log: Telemetry, base: Fit, examination: Examination, rival: Rival
) -> tuple[Array, float]:
    """(n,) log-likelihood of every row under a rival, all parameters fitted, up to a constant.

    And how unusual the sizes of its sensors' errors are, as a log-likelihood.
    """
    additions = []
    library = examination.competitors.library
    corrected, factor, delay, surprise = log, 1.0, 0.0, 0.0
    for member, values in zip(rival.members, rival.coefficients, strict=True):
        if member.sensor:
            sensor = next(s for s in examination.competitors.sensors if s.kind == member.name)
            size = float(values[0])
            corrected = sensor.correct(corrected, size)
            surprise += 0.5 * (size / sensor.usual) ** 2
            if sensor.kind == "power_scale":
                factor *= 1.0 + size  # residuals count in the watts that were measured
            elif sensor.kind == "power_delay":
                delay = size
        else:
            additions.append(Addition.of(library, member.term, values))
    fitted = fit_with(
        base.model, corrected, additions, noise=examination.noise, within=library.model
    )
    residual = factor * fitted.residual
    if delay:
        # Against the power as it was measured: between two rows, noise would average out.
        modelled = factor * (corrected.power - fitted.residual)
        residual = log.power - seen_after(log, modelled, -delay)
    spread = examination.spread
    counted = clipped(residual, spread)[:, None]
    white = examination.noise.whiten(log, examination.watts, spread, counted)
    return np.asarray(-0.5 * white[:, 0] ** 2), surprise
