"""Shapes beyond a selection: does something lie outside the catalogue?

    found = shape_beyond(examination, chooser, chosen)      # a ShapeFound, or None

A shape of the dictionary that is significant beyond the chosen effects, or alone explains more than
they do, says so. Three doubts come first: an error of a sensor that does the same is the likelier
explanation, effects that this log cannot tell may look the same, and an effect of the catalogue may
do as well, though not clearly enough for a name.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from planner.telemetry.evidence import Examination, Test
from planner.telemetry.selection.subset_search import Chooser

LEAST_SHAPE_BESIDE = 0.2
"""The same for a shape, which finds more easily what an effect of another form leaves over."""
SURE_GAIN = 8.0
SHAPE_SIGNIFICANT = 0.002
LEAST_SHAPE_SIZE = 0.12
AS_GOOD = 0.8
"""Share of a shape's gain from which an error of a sensor explains the same."""
TIE_Z = 1.64
CLEARLY_MORE = 3.0
"""Log-likelihood by which a shape must do better than what the catalogue has."""


@dataclass(frozen=True)
class ShapeFound:
    """A significant shape.

    Attributes:
        number: in the dictionary.
        column: in the examination.
        z: of its test beyond the selection.
        size: ρ.
        alone: True when it explains the log better than the selection, which it replaces.
        near: slugs of effects that look the same in this log.
    """

    number: int
    column: int
    z: float
    size: float
    alone: bool
    near: tuple[str, ...]


def two_sided(z: float) -> float:
    """Probability of a normal deviate at least as far out as z, on either side."""
    return float(2.0 * norm.sf(z))


def shape_beyond(
    examination: Examination, chooser: Chooser, chosen: tuple[int, ...]
) -> ShapeFound | None:
    """The strongest shape of the dictionary beyond the selection, if it means something."""
    evidence, competitors = examination.evidence, examination.competitors
    columns = [competitors.first_shape + k for k in examination.shapes]
    if not columns:
        return None
    mine = chooser.columns(chosen)
    z, found, _ = evidence.test_each(columns, given=mine)
    best = int(np.argmax(z))
    p = min(1.0, two_sided(float(z[best])) * len(columns))
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
        better = gain > CLEARLY_MORE and vuong > TIE_Z and member_like < 0.9
        simpler = len(chosen) >= 2 and gain > -0.5 * np.log(max(evidence.block_count, 2)) - np.log(
            chooser.name_count
        )
        if better or simpler:
            number, column = examination.shapes[strongest], columns[strongest]
            size = evidence.size([column], alone_found[[strongest]])
            near = _look_alikes(examination, column)
            return ShapeFound(number, column, float(alone_z[strongest]), size, True, near)
    if not significant:
        return None
    near = _look_alikes(examination, columns[best])
    if not chosen:
        near = tuple(dict.fromkeys((*near, *_as_good(examination, chooser, columns[best]))))
    number = examination.shapes[best]
    return ShapeFound(number, columns[best], float(z[best]), size, not chosen, near)


def _as_good(examination: Examination, chooser: Chooser, column: int) -> list[str]:
    """Effects of the catalogue that alone do what a shape does, though too weakly for a name."""
    shape = examination.evidence.gain([column])[0]
    found = [(m.name, chooser.gain((k,))) for k, m in enumerate(chooser.members) if not m.sensor]
    return [name for name, gain in found if gain is not None and gain[0] > shape - CLEARLY_MORE]


def rather_a_sensor(
    examination: Examination,
    chooser: Chooser,
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
        untold = examination.testable.get(candidate.effect) is not None
        seen = evidence.clear[at, at] > 1e-9 * evidence.total[at, at]
        if untold and seen and evidence.likeness(at, column) > 0.9:
            near.append(candidate.effect)
    return tuple(dict.fromkeys(near))
