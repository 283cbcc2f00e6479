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
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.arrays import Array
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import Examination
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import clipped
from planner.telemetry.other_terms import seen_after
from planner.telemetry.sampling import block_numbers
from planner.telemetry.selection.select_effects import Selection
from planner.telemetry.selection.subset_search import Member, Rival
from planner.telemetry.terms import Addition, fit_with

OTHERS = 3
"""How many of the best singles, and of the best pairs, stand against several effects."""
NEIGHBOURS = 4
"""How many sets in which one member is replaced are fitted."""
TIE_GAIN = 2.0
TIE_Z = 1.64
SURE_GAIN = 8.0
"""A rival is tied that trails by less than the first, or, at less than this z, than the last."""
FAR_BEHIND = 60.0
"""Score by which such a set may trail in the sums and still be fitted."""


def coefficients_of(selection: Selection, name: str) -> Array:
    """What the selection estimates for one of its effects, in units of its parameters."""
    return next(s.coefficients for s in selection.standings if s.name == name)


@dataclass(frozen=True)
class Outcome:
    """How one explanation came out of a contest.

    Attributes:
        members: of it.
        ties: name of a member → names that explain the log as well in its place.
        sizes: name of a member → ρ of what it adds to the others, where these were fitted alone.
    """

    members: tuple[Member, ...]
    ties: dict[str, tuple[str, ...]]
    sizes: dict[str, float]


class Entry(NamedTuple):
    """A rival that was fitted: names of its members, score, and (blocks,) log-likelihood."""

    rival: Rival
    names: frozenset[str]
    score: float
    by_block: Array


def contest(
    log: Telemetry,
    base: Fit,
    examination: Examination,
    selection: Selection,
    known: Sequence[Rival] = (),
    check: Callable[[], None] = lambda: None,
) -> tuple[list[Outcome], tuple[Rival, ...]]:
    """The members that explain the log when everything is fitted, best first, and their equals.

    Args:
        log: the rows.
        base: the model without additions, fitted.
        examination: of the same rows.
        selection: what the sums say; its rivals are tried.
        known: rivals from before, which the sums around another model may not do justice to.
        check: called before every fit; raises when the caller was cancelled.

    Returns:
        Outcomes that do not trail far, and their rivals, to be tried again later.
    """
    field = _field(selection, known)
    if len(field) == 1:
        only = field[0]
        return [Outcome(only.members, {m.name: () for m in only.members}, {})], (only,)
    blocks = block_numbers(log)
    entries = []
    for rival in field:
        check()
        rows, surprise = row_likelihood(log, base, examination, rival)
        by_block = np.bincount(blocks, rows).astype(float)
        score = float(by_block.sum()) - rival.penalty - surprise
        entries.append(Entry(rival, frozenset(m.name for m in rival.members), score, by_block))

    def rank(entry: Entry) -> float:
        # A sensor is blamed only when it is clearly ahead of everything that blames none.
        return entry.score - SURE_GAIN * any(m.sensor for m in entry.rival.members)

    entries.sort(key=rank, reverse=True)
    entries = [e for e in entries if entries[0].score - e.score < FAR_BEHIND]
    check()
    rows, _ = row_likelihood(log, base, examination, Rival((), (), 0.0, 0.0))
    nothing = np.bincount(blocks, rows).astype(float)
    outcomes = [
        Outcome(e.rival.members, ties_of(e, entries), sizes_of(e, entries, nothing, len(log)))
        for e in entries
    ]
    return simpler_first(outcomes, entries), tuple(e.rival for e in entries)


def simpler_first(outcomes: list[Outcome], entries: Sequence[Entry]) -> list[Outcome]:
    """The error of one sensor before several effects, each of which is tied with it.

    That two effects are missing at once and look like one faulty sensor is the odder story.
    """
    tied = [set(names) for names in outcomes[0].ties.values()]
    if len(tied) < 2:
        return outcomes
    for number, (outcome, entry) in enumerate(zip(outcomes, entries, strict=True)):
        alone = len(outcome.members) == 1 and outcome.members[0].sensor
        near = entries[0].score - entry.score < SURE_GAIN
        if alone and near and all(outcome.members[0].name in names for names in tied):
            return [outcome, *outcomes[:number], *outcomes[number + 1 :]]
    return outcomes


def ties_of(winner: Entry, entries: Sequence[Entry]) -> dict[str, tuple[str, ...]]:
    """By member, what explains the log as well in its place."""
    ties: dict[str, list[str]] = {name: [] for name in winner.names}
    for other in entries:
        gone, come = winner.names - other.names, other.names - winner.names
        if len(gone) != 1 or len(come) != 1:
            continue
        difference = winner.by_block - other.by_block
        scatter = float(difference.std()) * np.sqrt(len(difference)) + 1e-12
        gain, z = winner.score - other.score, float(difference.sum()) / scatter
        if gain < TIE_GAIN or (z < TIE_Z and gain < SURE_GAIN):
            ties[next(iter(gone))].append(next(iter(come)))
    return {name: tuple(rivals) for name, rivals in ties.items()}


def sizes_of(
    winner: Entry, entries: Sequence[Entry], nothing: Array, rows: int
) -> dict[str, float]:
    """By member, ρ of what it adds to the others, or to nothing, where these were fitted alone."""
    sizes = {}
    fitted = [(other.names, other.by_block) for other in entries]
    for names, by_block in [*fitted, (frozenset[str](), nothing)]:
        gone = winner.names - names
        if names < winner.names and len(gone) == 1:
            gain = max(0.0, float((winner.by_block - by_block).sum()))
            sizes[next(iter(gone))] = math.sqrt(2.0 * gain / rows)
    return sizes


def _field(selection: Selection, known: Sequence[Rival]) -> list[Rival]:
    """The selection, its subsets, the best singles and pairs, and near rivals of one member."""
    chosen = frozenset(m.name for m in selection.members)
    wanted = {
        frozenset(some)
        for count in range(1, len(chosen) + 1)
        for some in itertools.combinations(sorted(chosen), count)
    }
    field: dict[frozenset[str], Rival] = {}
    counts = {1: 0, 2: 0}
    neighbours = 0
    best = max((r.score for r in selection.rivals), default=0.0)
    for rival in selection.rivals:  # best first
        names = frozenset(m.name for m in rival.members)
        if names in field:
            continue
        size = len(names)
        near = len(names & chosen) == len(chosen) - 1 and size == len(chosen)
        if names in wanted:
            field[names] = rival
        elif near and neighbours < NEIGHBOURS and best - rival.score < FAR_BEHIND:
            neighbours += 1
            field[names] = rival
        elif len(chosen) > 1 and size in counts and counts[size] < OTHERS:
            counts[size] += 1
            field[names] = rival
    for rival in known:
        field.setdefault(frozenset(m.name for m in rival.members), rival)
    return list(field.values())


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
        sizes = tuple(coefficients_of(selection, m.name) for m in some)
        rows, surprise = row_likelihood(log, base, examination, Rival(some, sizes, 0.0, 0.0))
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
