"""The energy of one leg without more ado: grid path, refinement, motion, and nothing beside it.

    route = driven_leg(situation, field, path, yaws, stop=stop)

For questions that need the energy of many routes: planner.search.matrix and planner.search.reach.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.search.drive import energy_of, move, price
from planner.search.edge_energy import Motion
from planner.search.grid_route import MARGINS, grid_route
from planner.search.ground import CostField
from planner.search.refine import VARIANTS, refine
from planner.search.request import PlanRequest, PoseRequest
from planner.search.route import Route
from planner.search.run import Run
from planner.search.situation import Situation
from planner.search.stopping import Stop

Array = NDArray[np.float64]


def driven_leg(
    situation: Situation,
    field: CostField,
    path: Array,
    yaws: tuple[float | None, float | None] = (None, None),
    *,
    stop: Stop,
) -> Route | None:
    """The best motion near a path; None where there is none even with more caution.

    Args:
        situation: map and model.
        field: of the situation, for energy.
        path: (k, 2) from the grid.
        yaws: at both ends, None where it is free.
        stop: the caller's wish to, which raises Cancelled.
    """
    best, least = None, math.inf
    toll = situation.toll("energy")
    variants = {} if situation.ground.blocked.any() else VARIANTS
    for knot_cells, shares in variants.items():
        tolls = [share * toll for share in shares]
        for refined, _ in refine(field, path, tolls=tolls, knot_cells=knot_cells):
            motion = move(field, situation.around, [refined], yaws, objective=0)
            if isinstance(motion, Motion):
                energy = energy_of(field, situation.around, motion)
                if energy < least:
                    best, least = motion, energy
    if best is not None:
        return price(field, situation.around, best)
    # Among obstacles, or where a limit was broken: as carefully as for a single request.
    places = [
        PoseRequest(x=float(x), y=float(y), yaw=yaw)
        for (x, y), yaw in zip((path[0], path[-1]), yaws, strict=True)
    ]
    request = PlanRequest(map=situation.ground.terrain.name, start=places[0], goal=places[1])
    return grid_route(Run(request, situation, lambda _what, _share: None, stop), "energy")


def energy_field(situation: Situation) -> CostField:
    """Map and costs for energy, with the usual margin."""
    return situation.field("energy", MARGINS[0])
