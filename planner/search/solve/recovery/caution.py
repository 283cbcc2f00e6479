"""What to do where a path cannot be driven: strategies, each of which searches more cautiously.

    caution = first_caution(run, field, "energy", patient=True)
    caution = next_caution(caution, attempt)           # None where nothing is left to try

A speed that breaks a limit on a bend asks for another place or for less steep ground. A body that
cannot turn in time, or only at much cost, asks for paths with more room. Motors that get too warm
ask for paths past the places where they are warmest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.resolution import MARGIN
from planner.search.run import Run
from planner.search.solve.pipeline import Attempt

SLOPE_MARGINS = (MARGIN, 0.95, 0.9, 0.8)
"""Shares of the slope limit to search with, until the finished trajectory keeps to all limits."""
FEW_SLOPE_MARGINS = {"energy": (MARGIN, 0.9), "time": (MARGIN, 0.9), "length": (MARGIN,)}
"""The same for a baseline, by objective: few answers wait for one. What is shortest with less of
the limit is hardly ever shorter than the fastest route."""
CLEARANCE_PENALTIES = (0.0, 0.4, 1.0, 2.0, 5.0, 16.0)
"""Shares by which ground costs more where the body fits with hardly a yaw, tried in this order."""
PENALISED_PLACES = 4
"""Paths whose places where a limit was broken get a penalty, before less of the slope limit is
used; then as many again."""
PENALTY, PENALISED_CELLS = 2.0, 3.0
"""Factor on the cost near such a place, and how many cells round it count as near."""


@dataclass(frozen=True)
class Caution:
    """How cautiously the grid is searched.

    Attributes:
        factor: on the cost of the ground, (ny, nx) or (1, 1).
        slope_margins: share of the slope limit to search with, and those to try after it.
        clearance_penalties: clearance penalty to search with, and those to try after it.
        places_left: how many more paths' places may get a penalty with this slope margin.
        places_each: how many with every margin.
    """

    factor: Array
    slope_margins: tuple[float, ...]
    clearance_penalties: tuple[float, ...]
    places_left: int
    places_each: int

    @property
    def obstructed(self) -> bool:
        """Whether a stronger clearance penalty is left to try."""
        return len(self.clearance_penalties) > 1

    def field(self, run: Run, objective: str) -> CostField:
        """Map and costs to search with."""
        factor = self.factor
        if self.clearance_penalties[0] > 0.0:
            factor = factor * run.ground.clearance_penalty(self.clearance_penalties[0])
        return run.field(objective, self.slope_margins[0], np.ascontiguousarray(factor))

    def unobstructed_field(self, run: Run, objective: str) -> CostField:
        """Map and costs without a clearance penalty, for a search that knows the yaw."""
        return run.field(objective, self.slope_margins[0], self.factor)


def first_caution(run: Run, field: CostField, objective: str, *, patient: bool) -> Caution:
    """No caution; what may follow is shorter for a baseline that few answers wait for."""
    penalties = CLEARANCE_PENALTIES if run.ground.blocked.any() else CLEARANCE_PENALTIES[:1]
    margins = SLOPE_MARGINS if patient else FEW_SLOPE_MARGINS[objective]
    places = PENALISED_PLACES if patient else 0
    return Caution(field.factor, margins, penalties, places, places)


def more_clearance(caution: Caution, attempt: Attempt) -> Caution | None:
    """A stronger clearance penalty, where the body lacks room or turning costs much."""
    infeasible = attempt.infeasible
    if not caution.obstructed or not (infeasible is None or infeasible.for_want_of_room):
        return None
    return replace(caution, clearance_penalties=caution.clearance_penalties[1:])


def past_the_place(caution: Caution, attempt: Attempt) -> Caution | None:
    """A penalty near the places where a limit is broken: another path past them may do.

    Motors that are too warm by a few per cent cool down on a short way round. On a steady slope the
    torque does not depend on the speed, and so only another path helps.
    """
    infeasible = attempt.infeasible
    if infeasible is None or infeasible.for_want_of_room or not caution.places_left:
        return None
    factor = caution.factor * penalty_near(attempt.field, infeasible)
    return replace(caution, factor=factor, places_left=caution.places_left - 1)


def gentler_slopes(caution: Caution, attempt: Attempt) -> Caution | None:
    """Less of the slope limit everywhere, which costs more than another path past one place."""
    infeasible = attempt.infeasible
    if infeasible is None or infeasible.too_warm or len(caution.slope_margins) == 1:
        return None
    margins = caution.slope_margins[1:]
    return replace(caution, slope_margins=margins, places_left=caution.places_each)


STRATEGIES: tuple[Callable[[Caution, Attempt], Caution | None], ...] = (
    more_clearance,
    past_the_place,
    gentler_slopes,
)
"""In the order in which they are tried: the first that applies is taken."""


def next_caution(caution: Caution, attempt: Attempt) -> Caution | None:
    """How to search after an attempt; None where no strategy is left."""
    found = (strategy(caution, attempt) for strategy in STRATEGIES)
    return next((changed for changed in found if changed is not None), None)


def penalty_near(field: CostField, place: Infeasible) -> Array:
    """Factor (ny, nx) that makes a few cells round all places of one path cost more."""
    ny, nx = field.heights.shape
    x, y = field.x0 + field.dx * np.arange(nx), field.y0 + field.dy * np.arange(ny)
    factor = np.ones((ny, nx))
    for at_x, at_y in place.places:
        cells = np.hypot((x - at_x)[None, :] / field.dx, (y - at_y)[:, None] / field.dy)
        factor[cells < PENALISED_CELLS] = PENALTY
    return factor
