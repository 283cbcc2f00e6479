"""Shapes beyond a selection: evidence for an effect outside the catalogue.

    found = shape_beyond(scorer, chosen)      # a ShapeFound, or None

The evidence is a shape of the dictionary that is significant beyond the chosen effects, or alone
explains more than they do. Three explanations come first: a sensor fault that does the same,
effects that are not identifiable and collinear with the shape, and an effect of the catalogue that
does as well, though not clearly enough to be named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from planner.arrays import Array
from planner.telemetry.evidence import Examination, Test
from planner.telemetry.holdout import LinearHeldout, rms, supports
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import counted
from planner.telemetry.prediction import Readings
from planner.telemetry.quantities_of_motion import STANDSTILL
from planner.telemetry.selection.subset_search import SubsetScorer

LEAST_RELATIVE_SHAPE_SIZE = 0.2
"""Size of a shape over the largest member's; a shape fits the misfit of a member's form easily."""
LEAST_SHAPE_GAIN = 8.0
"""Log-likelihood that a shape must gain."""
SHAPE_SIGNIFICANCE = 0.002
"""p-value over all shapes together."""
LEAST_SHAPE_SIZE = 0.2
"""Effect size ρ below which a shape is not reported: a formula needs more than an effect."""
SENSOR_GAIN_SHARE = 0.8
"""Share of a shape's gain from which an error of a sensor explains the same."""
ALONE_Z = 1.64
"""z, by clusters, from which a shape alone explains more than the selection."""
LEAST_LEAD = 3.0
"""Log-likelihood by which a shape must beat the catalogue."""


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

    def weighs(self, by_effects: float, by_formula: float) -> bool:
        """Whether it is more than the misfit of the effects beside it, once fitted in full.

        Args:
            by_effects, by_formula: W², of the squared error that these take off, one after the
                other.
        """
        return by_formula >= LEAST_RELATIVE_SHAPE_SIZE**2 * by_effects


def two_sided(z: float) -> float:
    """Probability of a normal deviate at least as far out as z, on either side."""
    return float(2.0 * norm.sf(z))


def shape_beyond(scorer: SubsetScorer, chosen: tuple[int, ...]) -> ShapeFound | None:
    """The strongest shape of the dictionary beyond the selection, if it means something."""
    examination, evidence = scorer.examination, scorer.evidence
    competitors = examination.competitors
    columns = [competitors.first_shape + k for k in examination.shapes]
    if not columns:
        return None
    mine = scorer.columns(chosen)
    z, found, _ = evidence.test_each(columns, given=mine)
    best = int(np.argmax(z))
    p = min(1.0, two_sided(float(z[best])) * len(columns))
    size = evidence.size([columns[best]], found[[best]], mine)
    least = max(LEAST_SHAPE_SIZE, LEAST_RELATIVE_SHAPE_SIZE * scorer.largest(chosen))
    significant = p < SHAPE_SIGNIFICANCE and 0.5 * z[best] ** 2 > LEAST_SHAPE_GAIN and size > least
    if chosen:
        # Would one shape alone do what the selection does? The strongest one alone is asked.
        alone_z, alone_found, alone_info = evidence.test_each(columns)
        gains = 0.5 * alone_found**2 * alone_info
        strongest = int(np.argmax(gains))
        gain, vuong = evidence.compare([columns[strongest]], mine)
        member_like = max((evidence.collinearity(c, columns[strongest]) for c in mine), default=0.0)
        better = gain > LEAST_LEAD and vuong > ALONE_Z and member_like < 0.9
        simpler = len(chosen) >= 2 and gain > -0.5 * np.log(
            max(evidence.cluster_count, 2)
        ) - np.log(scorer.name_count)
        if better or simpler:
            number, column = examination.shapes[strongest], columns[strongest]
            size = evidence.size([column], alone_found[[strongest]])
            near = _collinear_effects(examination, column)
            return ShapeFound(number, column, float(alone_z[strongest]), size, True, near)
    if not significant:
        return None
    near = _collinear_effects(examination, columns[best])
    if not chosen:
        near = tuple(dict.fromkeys((*near, *_as_good(scorer, columns[best]))))
    number = examination.shapes[best]
    return ShapeFound(number, columns[best], float(z[best]), size, not chosen, near)


def overlooked_shape(
    log: Telemetry, examination: Examination, floor: Array, most: float = math.inf
) -> ShapeFound | None:
    """The shape that alone predicts held-out runs best; None where these support no shape.

    Args:
        log: rows in memory.
        examination: of these rows.
        floor: (n,) W, spread of single rows.
        most: W, the held-out error that it must undercut.
    """
    linear = LinearHeldout(log, examination)
    competitors = examination.competitors
    dictionary = competitors.dictionary
    without = best_left = linear.residual_with([])
    best, least = -1, min(rms(counted(without, floor)), most)
    for number in examination.shapes:
        columns = [competitors.first_shape + number]
        if dictionary.shapes[number].kind in ("cos", "sin"):
            columns.append(competitors.first_shape + dictionary.quadrature(number))
        left = linear.residual_with(columns)
        if (error := rms(counted(left, floor))) < least:
            best, least, best_left = number, error, left
    if best < 0 or not supports(log, without, best_left, floor):
        return None
    # What is the same at all speeds is no effect over one: brakes, motors that hold and wheels that
    # push against each other look alike at rest.
    speed = dictionary.axes(log.rows_for(competitors.library.model.surfaces))["speed"]
    moving = Readings.as_shown(log, np.tanh(speed / STANDSTILL)[:, None])
    if rms(counted(linear.residual_beside(moving), floor)) <= least:
        return None
    column = competitors.first_shape + best
    if _collinear_effects(examination, column):
        return None
    z, found, _ = examination.evidence.test_each([column])
    size = examination.evidence.size([column], found)
    return ShapeFound(best, column, float(z[0]), size, True, ())


def _as_good(scorer: SubsetScorer, column: int) -> list[str]:
    """Effects of the catalogue that alone do what a shape does, though too weakly for a name."""
    shape = scorer.evidence.gain([column])[0]
    found = [(m.name, scorer.gain((k,))) for k, m in enumerate(scorer.members) if not m.sensor]
    return [name for name, gain in found if gain is not None and gain[0] > shape - LEAST_LEAD]


def prefer_sensor_fault(
    scorer: SubsetScorer, chosen: tuple[int, ...], tests: dict[str, Test], shape: ShapeFound
) -> tuple[tuple[int, ...], dict[str, Test], ShapeFound | None]:
    """An error of a sensor that does what a shape does is the likelier explanation."""
    kept = () if shape.alone else chosen
    start = scorer.gains[kept][0] if kept in scorer.gains else 0.0
    mine = scorer.columns(kept)
    by_shape = scorer.evidence.gain([*mine, shape.column])[0] - start
    best: tuple[float, tuple[int, ...]] | None = None
    for k, member in enumerate(scorer.members):
        both = tuple(sorted({*kept, k}))
        if member.sensor and k not in kept:
            found = scorer.gain(both)
            if found is not None and found[0] - start > SENSOR_GAIN_SHARE * by_shape:
                scorer.gains.setdefault(both, found)
                scorer.scored.setdefault(both, found[0] - scorer.penalty(both))
                if best is None or found[0] > best[0]:
                    best = (found[0], both)
    if best is None:
        return chosen, tests, shape
    passed, new_tests = scorer.checked(best[1])
    if not any(scorer.members[k].sensor for k in passed):
        return chosen, tests, shape
    return passed, new_tests, None


def _collinear_effects(examination: Examination, column: int) -> tuple[str, ...]:
    """Effects that are not identifiable from this log and collinear with a shape."""
    evidence, competitors = examination.evidence, examination.competitors
    near = []
    for number, candidate in enumerate(competitors.library.candidates):
        at = competitors.candidate(number)
        untold = examination.testable.get(candidate.effect) is not None
        seen = evidence.partial[at, at] > 1e-9 * evidence.total[at, at]
        if untold and seen and evidence.collinearity(at, column) > 0.9:
            near.append(candidate.effect)
    return tuple(dict.fromkeys(near))
