"""The energy of one leg without more ado: grid path, refinement, motion, and nothing beside it.

    route = driven_leg(situation, field, path, yaws)

For questions that need the energy of many routes: planner.search.matrix and planner.search.reach.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from planner.search.drive import drive
from planner.search.grid_route import MARGINS, grid_route
from planner.search.ground import CostField
from planner.search.refine import VARIANTS, refine
from planner.search.request import PlanRequest, PoseRequest
from planner.search.route import Route
from planner.search.run import Run
from planner.search.situation import Situation

Array = NDArray[np.float64]


def driven_leg(
    situation: Situation,
    field: CostField,
    path: Array,
    yaws: tuple[float | None, float | None] = (None, None),
    *,
    cancelled: Callable[[], bool] = lambda: False,
) -> Route | None:
    """The best motion near a path; None where there is none even with more caution.

    Args:
        situation: map and model.
        field: of the situation, for energy.
        path: (k, 2) from the grid.
        yaws: at both ends, None where it is free.
        cancelled: asked often; True raises Cancelled.
    """
    best: Route | None = None
    toll = situation.toll("energy")
    for knot_cells, share in VARIANTS:
        refined, _ = refine(field, path, toll=share * toll, knot_cells=knot_cells)
        route = drive(field, situation.around, [refined], yaws, objective=0)
        if isinstance(route, Route) and (best is None or route.energy_j < best.energy_j):
            best = route
    if best is not None and not situation.ground.blocked.any():
        return best
    # Among obstacles, or where a limit was broken: as carefully as for a single request.
    places = [
        PoseRequest(x=float(x), y=float(y), yaw=yaw)
        for (x, y), yaw in zip((path[0], path[-1]), yaws, strict=True)
    ]
    request = PlanRequest(map=situation.ground.terrain.name, start=places[0], goal=places[1])
    found = grid_route(Run(request, situation, lambda _what, _share: None, cancelled), "energy")
    routes = [route for route in (best, found) if route is not None]
    return min(routes, key=lambda route: route.energy_j, default=None)


def energy_field(situation: Situation) -> CostField:
    """Map and costs for energy, with the usual margin."""
    return situation.field("energy", MARGINS[0])
