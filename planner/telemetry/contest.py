"""Explanations fitted in full and compared: is a simple one as good as several effects together?

    outcome = contest(log, base, examination, selection)
    outcome.members, outcome.ties

Sums are linear around one model. Far from it a single strong effect can look like two or three
weaker ones, like the error of a sensor, or like another effect. So before anything is named, the
selection, its subsets, rivals that come near it and the best single effects and pairs are fitted
with all parameters free. The likelihood less the penalty of the selection decides; what is not
clearly behind, block by block (Vuong's test), is a tie.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.power.catalogue import find_effect
from planner.telemetry.blocks import block_numbers
from planner.telemetry.examine import Examination
from planner.telemetry.extend import Addition, addition_of, fit_with
from planner.telemetry.fit import Fit
from planner.telemetry.log import Telemetry
from planner.telemetry.noise import CLIP
from planner.telemetry.select_effects import Selection
from planner.telemetry.subsets import Member, Rival

Floats = NDArray[np.float64]

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


def coefficients_of(selection: Selection, name: str) -> Floats:
    """What the selection estimates for one of its effects, in units of its parameters."""
    return next(s.coefficients for s in selection.standings if s.name == name)


def addition_for(examination: Examination, member: Member, coefficients: Floats) -> Addition:
    """A member of a selection as an addition to a model."""
    assert member.atom is not None  # errors of sensors are no additions
    library = examination.competitors.library
    effects = {e.slug: e for e in library.model.effects}
    effect = effects.get(member.name) or find_effect(member.name)
    columns = [library.candidates[n] for n in member.atom.columns]
    return addition_of(columns, coefficients, effect)


@dataclass(frozen=True)
class Outcome:
    """Who won.

    Attributes:
        members: the winner.
        ties: name of a member → names that explain the log as well in its place.
        near: those that were fitted and did not trail far, to be tried again later.
    """

    members: tuple[Member, ...]
    ties: dict[str, tuple[str, ...]]
    near: tuple[Rival, ...]


def contest(
    log: Telemetry,
    base: Fit,
    examination: Examination,
    selection: Selection,
    known: Sequence[Rival] = (),
) -> Outcome:
    """The members that explain the log best when everything is fitted, and their equals.

    Args:
        log: the rows.
        base: the model without additions, fitted.
        examination: of the same rows.
        selection: what the sums say; its rivals are tried.
        known: rivals from before, which the sums around another model may not do justice to.
    """
    field = _field(selection, known)
    if len(field) == 1:
        only = field[0]
        return Outcome(only.members, {m.name: () for m in only.members}, (only,))
    blocks = block_numbers(log)
    entries: list[tuple[float, Rival, Floats]] = []
    for rival in field:
        rows, surprise = _row_likelihood(log, base, examination, rival)
        by_block = np.bincount(blocks, rows).astype(float)
        entries.append((float(by_block.sum()) - rival.penalty - surprise, rival, by_block))
    score, winner, mine = max(entries, key=lambda entry: entry[0])
    honest = [e for e in entries if not any(m.sensor for m in e[1].members)]
    if any(m.sensor for m in winner.members) and honest:
        # A sensor is blamed only when it is clearly ahead of everything that blames none.
        best = max(honest, key=lambda entry: entry[0])
        if score - best[0] < SURE_GAIN:
            score, winner, mine = best
    names = {m.name for m in winner.members}
    ties: dict[str, list[str]] = {name: [] for name in names}
    for other, rival, theirs in entries:
        other_names = {m.name for m in rival.members}
        if len(other_names) != len(names) or len(other_names & names) != len(names) - 1:
            continue
        difference = mine - theirs
        scatter = float(difference.std()) * np.sqrt(len(difference)) + 1e-12
        gain, z = score - other, float(difference.sum()) / scatter
        if gain < TIE_GAIN or (z < TIE_Z and gain < SURE_GAIN):
            ties[(names - other_names).pop()].append((other_names - names).pop())
    near = tuple(rival for other, rival, _ in entries if score - other < FAR_BEHIND)
    return Outcome(winner.members, {n: tuple(rivals) for n, rivals in ties.items()}, near)


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


def _row_likelihood(
    log: Telemetry, base: Fit, examination: Examination, rival: Rival
) -> tuple[Floats, float]:
    """(n,) log-likelihood of every row under a rival, all parameters fitted, up to a constant.

    And how unusual the sizes of its sensors' errors are, as a log-likelihood.
    """
    additions = []
    corrected, factor, surprise = log, 1.0, 0.0
    for member, values in zip(rival.members, rival.coefficients, strict=True):
        if member.sensor:
            sensor = next(s for s in examination.competitors.sensors if s.kind == member.name)
            size = float(values[0])
            corrected = sensor.correct(corrected, size)
            surprise += 0.5 * (size / sensor.usual) ** 2
            if sensor.kind == "power_scale":
                factor *= 1.0 + size  # residuals count in the watts that were measured
        else:
            additions.append(addition_for(examination, member, values))
    library = examination.competitors.library.model
    fitted = fit_with(base.model, corrected, additions, noise=examination.noise, within=library)
    spread = examination.spread
    clipped = np.clip(factor * fitted.residual, -CLIP * spread, CLIP * spread)
    white = examination.noise.whiten(log, examination.watts, spread, clipped[:, None])
    return np.asarray(-0.5 * white[:, 0] ** 2), surprise
