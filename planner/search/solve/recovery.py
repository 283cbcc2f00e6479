"""What to do where a path cannot be driven: strategies, each of which searches more cautiously.

    caution = first_caution(run, field, patient=True)
    caution = next_caution(caution, attempt)           # None where nothing is left to try

A speed that breaks a limit on a bend asks for another place or for less steep ground. A body that
cannot turn in time, or only at much cost, asks for paths with more room. Motors that get too warm
ask for paths with less ground on which they give more than their continuous torque, and then past
the places where they are warmest.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from planner.arrays import Array
from planner.power.motion_row import set_motion
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.resolution import MARGIN
from planner.search.run import Run
from planner.search.solve.pipeline import Attempt

SLOPE_MARGINS = (MARGIN, 0.95, 0.9, 0.8)
"""Shares of the slope limit to search with, until the finished trajectory keeps to all limits."""
FEW_SLOPE_MARGINS = (MARGIN, 0.9)
"""The same for a baseline: few answers wait for one."""
CLEARANCE_PENALTIES = (0.0, 0.4, 1.0, 2.0, 5.0, 16.0)
"""Shares by which ground costs more where the body fits with hardly a yaw, tried in this order."""
HEAT_WEIGHTS = (1.0, 8.0)
"""Factors on the excess heat of ground above the continuous torque, tried in this order."""
HEAT_SLOPES, HEAT_YAWS = 65, 16
"""Slopes and yaw angles at which the torque of driving uphill is worked out."""
MOST_EXCESS = 10.0
"""Largest excess heat: beyond it, costs would lose digits."""
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
        heat_weights: weights of hot ground that are left to try.
        excess_heat: gives the excess heat of the ground, (ny, nx).
    """

    factor: Array
    slope_margins: tuple[float, ...]
    clearance_penalties: tuple[float, ...]
    places_left: int
    places_each: int
    heat_weights: tuple[float, ...]
    excess_heat: Callable[[], Array]

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


def first_caution(run: Run, field: CostField, patient: bool) -> Caution:
    """No caution; what may follow is shorter for a baseline that few answers wait for."""
    penalties = CLEARANCE_PENALTIES if run.ground.blocked.any() else CLEARANCE_PENALTIES[:1]
    margins, places = (SLOPE_MARGINS, PENALISED_PLACES) if patient else (FEW_SLOPE_MARGINS, 0)
    heat = HEAT_WEIGHTS if patient else HEAT_WEIGHTS[1:]
    hot = partial(excess_heat, run, field)
    return Caution(field.factor, margins, penalties, places, places, heat, hot)


def more_clearance(caution: Caution, attempt: Attempt) -> Caution | None:
    """A stronger clearance penalty, where the body lacks room or turning costs much."""
    infeasible = attempt.infeasible
    if not caution.obstructed or not (infeasible is None or infeasible.for_want_of_room):
        return None
    return replace(caution, clearance_penalties=caution.clearance_penalties[1:])


def cooler_ground(caution: Caution, attempt: Attempt) -> Caution | None:
    """A penalty on ground above the continuous torque, where motors get too warm.

    On a steady slope the torque does not depend on the speed, and so only another path helps.
    """
    infeasible = attempt.infeasible
    if infeasible is None or not infeasible.too_warm or not caution.heat_weights:
        return None
    factor = caution.factor * (1.0 + caution.heat_weights[0] * caution.excess_heat())
    return replace(caution, factor=factor, heat_weights=caution.heat_weights[1:])


def past_the_place(caution: Caution, attempt: Attempt) -> Caution | None:
    """A penalty near the places where a limit is broken: another path past them may do.

    Motors that are too warm by a few per cent cool down on a short way round.
    """
    infeasible = attempt.infeasible
    if infeasible is None or infeasible.for_want_of_room or not caution.places_left:
        return None
    factor = caution.factor * _penalty_near(attempt.field, infeasible)
    return replace(caution, factor=factor, places_left=caution.places_left - 1)


def gentler_slopes(caution: Caution, attempt: Attempt) -> Caution | None:
    """Less of the slope limit everywhere, which costs more than another path past one place."""
    infeasible = attempt.infeasible
    if infeasible is None or infeasible.too_warm or len(caution.slope_margins) == 1:
        return None
    margins = caution.slope_margins[1:]
    return replace(caution, slope_margins=margins, places_left=caution.places_each)


STRATEGIES: tuple[Callable[[Caution, Attempt], Caution | None], ...] = (
    cooler_ground,
    more_clearance,
    past_the_place,
    gentler_slopes,
)
"""In the order in which they are tried: the first that applies is taken."""


def next_caution(caution: Caution, attempt: Attempt) -> Caution | None:
    """How to search after an attempt; None where no strategy is left."""
    found = (strategy(caution, attempt) for strategy in STRATEGIES)
    return next((changed for changed in found if changed is not None), None)


def _penalty_near(field: CostField, place: Infeasible) -> Array:
    """Factor (ny, nx) that makes a few cells round every such place cost more."""
    ny, nx = field.heights.shape
    x, y = field.x0 + field.dx * np.arange(nx), field.y0 + field.dy * np.arange(ny)
    factor = np.ones((ny, nx))
    for at_x, at_y in place.places:
        cells = np.hypot((x - at_x)[None, :] / field.dx, (y - at_y)[:, None] / field.dy)
        factor[cells < PENALISED_CELLS] = PENALTY
    return factor


def excess_heat(run: Run, field: CostField) -> Array:
    """Heat of driving straight up every node's slope over that of the continuous torque, less 1.

    (ny, nx), 0 where the motors give no more than that. Heat goes with the square of the torque,
    and that with the slope.
    """
    conditions = run.conditions
    slopes = np.linspace(0.0, float(field.limit.max()), HEAT_SLOPES)
    yaws = 2.0 * np.pi * np.arange(HEAT_YAWS) / HEAT_YAWS
    crawl = float(conditions.limits[0]) / HEAT_YAWS
    gentle = np.empty(len(conditions.class_rows))
    for number, own in enumerate(conditions.class_rows):
        rows = np.repeat(own[None], len(slopes) * len(yaws), axis=0)
        for row, (slope, yaw) in zip(rows, itertools.product(slopes, yaws), strict=True):
            set_motion(row, slope, 0.0, yaw, 0.0, crawl)
        torque = conditions.model.power_and_limits(rows)[:, 4].reshape(len(slopes), -1).min(axis=1)
        allowed = conditions.model.vehicle.limits.continuous_torque
        gentle[number] = max(float(np.interp(allowed, torque, slopes)), slopes[1])
    steepness = np.hypot(*np.gradient(field.heights, field.dy, field.dx))
    excess: Array = np.clip((steepness / gentle[field.ground]) ** 2 - 1.0, 0.0, MOST_EXCESS)
    return excess
