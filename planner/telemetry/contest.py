"""Explanations fitted in full and compared: is a simple one as good as several effects together?

    members = contest(log, base, examination, selection)

Sums are linear around one model. Far from it a single strong effect can look like two or three
weaker ones, or like the error of a sensor. So before several effects or a sensor are named, each of
them, their subsets, and the best single effects and pairs are fitted with all parameters free, and
the likelihood less the penalty of the selection decides.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.power.catalogue import find_effect
from planner.telemetry.examine import Examination
from planner.telemetry.extend import Addition, addition_of, fit_with
from planner.telemetry.fit import Fit
from planner.telemetry.log import Telemetry
from planner.telemetry.noise import CLIP
from planner.telemetry.select_effects import Member, Rival, Selection

Floats = NDArray[np.float64]

SINGLES, PAIRS = 3, 3
"""How many of the best ones stand beside the selection and its subsets."""


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


def contest(
    log: Telemetry, base: Fit, examination: Examination, selection: Selection
) -> tuple[Member, ...]:
    """The members that explain the log best when everything is fitted.

    Args:
        log: the rows.
        base: the model without additions, fitted.
        examination: of the same rows.
        selection: what the sums say; its rivals are tried.
    """
    best: tuple[float, tuple[Member, ...]] | None = None
    for rival in _field(selection):
        score = likelihood(log, base, examination, rival.members, rival.coefficients)
        score -= rival.penalty
        if best is None or score > best[0]:
            best = (score, rival.members)
    assert best is not None  # the selection itself is always there
    return best[1]


def _field(selection: Selection) -> list[Rival]:
    """The selection, its subsets, the best singles and the best pairs."""
    chosen = {m.name for m in selection.members}
    wanted = {
        frozenset(some)
        for count in range(1, len(chosen) + 1)
        for some in itertools.combinations(sorted(chosen), count)
    }
    field: dict[frozenset[str], Rival] = {}
    counts = {1: 0, 2: 0}
    for rival in selection.rivals:  # best first
        names = frozenset(m.name for m in rival.members)
        if names in field:
            continue
        size = len(names)
        if names in wanted:
            field[names] = rival
        elif size in counts and counts[size] < (SINGLES if size == 1 else PAIRS):
            counts[size] += 1
            field[names] = rival
    return list(field.values())


def likelihood(
    log: Telemetry,
    base: Fit,
    examination: Examination,
    members: Sequence[Member],
    coefficients: Sequence[Floats],
) -> float:
    """Log-likelihood of the log under some members, all parameters fitted, up to a constant."""
    additions = []
    corrected = log
    for member, values in zip(members, coefficients, strict=True):
        if member.sensor:
            sensor = next(s for s in examination.competitors.sensors if s.kind == member.name)
            corrected = sensor.correct(corrected, float(values[0]))
        else:
            additions.append(addition_for(examination, member, values))
    fitted = fit_with(base.model, corrected, additions, noise=examination.noise)
    return log_likelihood(log, fitted, examination)


def log_likelihood(log: Telemetry, fitted: Fit, examination: Examination) -> float:
    """Of a fit, under the noise that an examination found, up to a constant."""
    spread = examination.spread
    clipped = np.clip(fitted.residual, -CLIP * spread, CLIP * spread)
    white = examination.noise.whiten(log, examination.watts, spread, clipped[:, None])
    return float(-0.5 * (white**2).sum())
