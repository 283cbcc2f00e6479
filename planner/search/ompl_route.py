"""OMPL's part of an answer: its search in each leg's tube, or on the whole map, refined.

legs, said = ompl_legs(run, field, paths, refined)
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.search.ground import CostField
from planner.search.refine import refine
from planner.search.run import Run

Array = NDArray[np.float64]


def ompl_legs(
    run: Run, field: CostField, paths: list[Array], refined: list[tuple[Array, float]]
) -> tuple[list[Array], dict[str, Any]]:
    """OMPL's refined paths, one for each leg, and what there is to say about its search.

    Where OMPL finds nothing in its time, the grid's refined path stands in and is counted.
    """
    # OMPL is slow to import and leaves objects behind at exit: only where it is used.
    from planner.search.objective import Plane, Tube, WholeMap
    from planner.search.ompl_planner import solve

    request = run.request
    run.step("OMPL", 0.3)
    cheapest = run.situation.lattice(request.objective, field).cheapest
    legs, cost, iterations, evaluations, without = [], 0.0, 0, 0, 0
    for path, own, a, b in zip(paths, refined, run.places[:-1], run.places[1:], strict=True):
        if a == b:
            legs.append(own[0])
            continue
        plane: Plane
        if request.planner == "tube":
            plane = Tube(field, path, cheapest)
        else:
            plane = WholeMap(field, a, b, cheapest)
        result = solve(
            plane,
            seed=request.seed,
            seconds=request.time_budget_s / len(paths),
            iterations=request.iterations,
            cancelled=run.cancelled,
        )
        run.check()
        iterations += result.iterations
        evaluations += result.evaluations
        best = own
        if result.path is not None:
            polyline = result.path.copy()
            polyline[0], polyline[-1] = a, b
            best = refine(field, polyline, check=run.check)
        if result.path is None or not math.isfinite(best[1]):
            best = own
            without += 1
        legs.append(best[0])
        cost += best[1]
    said = {
        "library": "OMPL BIT*",
        "space": request.planner,
        "iterations": iterations,
        "edges_evaluated": evaluations,
        "ompl_cost": cost,
        "legs_without_ompl": without,
    }
    return legs, said
