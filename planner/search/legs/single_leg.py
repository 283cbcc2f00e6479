"""The energy of one leg without more ado: grid path, refinement, motion, and nothing beside it.

    leg = driven_leg(situation, field, path, yaws, token=token)
    leg.route.energy_j

For questions that need the energy of many routes: planner.search.matrix and planner.search.reach.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.field import CostField, polyline_cost
from planner.search.requests import PlanRequest, PoseRequest
from planner.search.resolution import MARGIN
from planner.search.results import Route, price
from planner.search.run import Run
from planner.search.situation import Situation
from planner.search.solve import on_grid
from planner.search.trajectory import Motion, move
from planner.search.waypoints import (
    VARIANTS,
    Driven,
    drive_roughly,
    polish,
    refine,
    worth_polishing,
)

Yaws = tuple[float | None, float | None]
MOST_SAVED = 0.004
"""Share of what a motion dissipates that moving its knots is expected to save at most."""


@dataclass(frozen=True)
class Leg:
    """A route from one place to another, and the polyline (k, 2) that it follows, if there is one.

    Attributes:
        route: with its energy.
        way: None where it came from a search with more care.
    """

    route: Route
    way: Array | None = None

    def dissipated(self, weight: float) -> float:
        """J, without what climbing stores; ``weight`` in N."""
        heights = self.route.arrays["z"]
        return self.route.energy_j - weight * float(heights[-1] - heights[0])


def driven_leg(
    situation: Situation,
    field: CostField,
    path: Array,
    yaws: Yaws = (None, None),
    *,
    token: CancellationToken,
) -> Leg | None:
    """The best motion near a path; None where there is none even with more caution.

    Args:
        situation: map and model.
        field: of the situation, for energy.
        path: (k, 2) from the grid.
        yaws: at both ends, None where it is free.
        token: the caller's wish to stop, which raises Cancelled.
    """
    toll = situation.toll("energy")
    variants = {} if situation.ground.blocked.any() else VARIANTS
    ways = (
        way
        for knot_cells, shares in variants.items()
        for way, _ in refine(
            field, path, tolls=[share * toll for share in shares], knot_cells=knot_cells
        )
    )
    leg = _best_of(situation, field, ways, yaws, math.inf, token)
    if leg is not None:
        return leg
    # Among obstacles, or where a limit was broken: as carefully as for a single request.
    places = [
        PoseRequest(x=float(x), y=float(y), yaw=yaw)
        for (x, y), yaw in zip((path[0], path[-1]), yaws, strict=True)
    ]
    request = PlanRequest(map=situation.ground.terrain.name, start=places[0], goal=places[1])
    run = Run(request, situation, silent, token)
    route = on_grid(run, run.field("energy", MARGIN), "energy").route
    return None if route is None else Leg(route)


def like_neighbour(
    situation: Situation,
    field: CostField,
    leg: Leg,
    way: Array,
    yaws: Yaws = (None, None),
    *,
    token: CancellationToken,
) -> Leg:
    """A leg, or one along the way to or from a place beside its own, whichever takes less.

    Args:
        situation, field, yaws, token: as for ``driven_leg``.
        leg: as it is.
        way: (k, 2), with its first or its last point elsewhere.
    """
    places = leg.route.arrays["x"][[0, -1]], leg.route.arrays["y"][[0, -1]]
    bent = way.copy()
    bent[[0, -1]] = np.column_stack(places)
    ways = [bent]
    if len(way) > 2:
        # The last bend may have been for the neighbour alone.
        at_start = math.dist(bent[0], way[0]) > math.dist(bent[-1], way[-1])
        moved = 1 if at_start else len(way) - 2
        ways.append(np.delete(bent, moved, axis=0))
    found = _best_of(situation, field, ways, yaws, leg.route.energy_j, token)
    return leg if found is None else found


def _best_of(
    situation: Situation,
    field: CostField,
    ways: Iterable[Array],
    yaws: Yaws,
    below: float,
    token: CancellationToken,
) -> Leg | None:
    """The cheapest of these ways, polished where that may help; None if it takes ``below`` J."""
    around = situation.around
    best = Driven(())
    for way in ways:
        token.check()
        if math.isfinite(polyline_cost(field, way, field.step)):
            found = drive_roughly(field, around, (way,), yaws)
            best = min(best, found, key=lambda one: one.energy)
    if best.motion is None or best.energy - MOST_SAVED * best.dissipated >= below:
        return None
    if worth_polishing(best.dissipated, polyline_cost(field, best.legs[0], field.step)):
        better = polish(field, around, best.legs, yaws, check=token.check)
        best = min(best, better, key=lambda one: one.energy)
    if best.energy >= below:
        return None
    motion = move(field, around, best.legs, yaws, objective=0)
    if not isinstance(motion, Motion):
        return None
    route = price(field, around, motion)
    return Leg(route, best.legs[0]) if route.energy_j < below else None
