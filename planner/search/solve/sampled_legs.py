"""OMPL's part of an answer: its search in each leg's tube, or on the whole map, refined.

found = ompl_legs(run, attempt, seconds)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from planner.arrays import Array
from planner.search.solve.grid_planner import Attempt
from planner.search.solve.run import Run
from planner.search.waypoints import refine


@dataclass(frozen=True)
class OmplLegs:
    """What OMPL came to.

    Attributes:
        legs: refined paths with their costs, one for each leg.
        said: of the search, for the answer's ``planner``.
        nothing: whether all of the paths are the grid's.
    """

    legs: list[tuple[Array, float]]
    said: dict[str, Any]
    nothing: bool

    @property
    def note(self) -> str | None:
        """What the user ought to know of it, if anything."""
        without = self.said["legs_without_ompl"]
        if without and self.nothing:
            return "OMPL found no way in the time it had: the route is the grid's alone"
        if without:
            return (
                f"OMPL found no way on {without} of {len(self.legs)} legs in the time it had: "
                "the grid's stand in there"
            )
        return None


def ompl_legs(run: Run, attempt: Attempt, seconds: float) -> OmplLegs:
    """OMPL's refined paths, and what to say of its search.

    Where OMPL finds nothing in its time, the grid's refined path stands in and is counted.

    Args:
        run: the request.
        attempt: of the grid, with paths.
        seconds: for all legs, unless the request limits the iterations.
    """
    assert attempt.paths is not None
    assert attempt.refined is not None  # there was a way
    field = attempt.field
    # OMPL is slow to import and leaves objects behind at exit: only where it is used.
    from planner.search.ompl import Plane, Tube, WholeMap, solve

    request = run.request
    cheapest = run.situation.lattice(request.objective, field).cheapest
    legs: list[tuple[Array, float]] = []
    iterations, evaluations, searched, without = 0, 0, 0, 0
    whole = request.planner == "plane"
    places = run.places
    for path, own, a, b in zip(
        attempt.paths, attempt.refined, places[:-1], places[1:], strict=True
    ):
        if a == b:
            legs.append(own)
            continue
        plane: Plane = WholeMap(field, a, b, cheapest) if whole else Tube(field, path, cheapest)
        result = solve(
            plane,
            seed=request.seed,
            seconds=seconds / len(attempt.paths),
            iterations=request.iterations,
            token=run.token,
        )
        searched += 1
        iterations += result.iterations
        evaluations += result.evaluations
        best = own
        if result.path is not None:
            polyline = result.path.copy()
            polyline[0], polyline[-1] = a, b
            toll = run.situation.toll(request.objective)
            [best] = refine(field, polyline, tolls=[toll], knot_cells=4.0)
        if result.path is None or not math.isfinite(best[1]):
            best = own
            without += 1
        legs.append(best)
    said: dict[str, Any] = {
        "space": "plane" if whole else "tube",
        "iterations": iterations,
        "edges_evaluated": evaluations,
        "legs_without_ompl": without,
    }
    if searched and not without:
        # Where the grid stands in, there is no figure of OMPL's own.
        said |= {"library": "OMPL BIT*", "ompl_cost": sum(cost for _, cost in legs)}
    return OmplLegs(legs, said, without == searched)
