"""Paths of least cost on the grid for the legs of a request, and why there are none.

paths = leg_paths(run, field, "energy")     # or None, then
why_not(run, field, "energy").what
"""

from __future__ import annotations

import itertools
from dataclasses import replace

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.run import Run
from planner.search.situation import explain_no_route


def leg_paths(run: Run, field: CostField, objective: str) -> list[Array] | None:
    """One polyline for each leg from the exhaustive grid, or None if a leg has no path."""
    run.check()
    legs = []
    for a, b in itertools.pairwise(run.places):
        path = run.situation.path(objective, field, a, b, run.token)
        if path is None:
            return None
        legs.append(path)
    return legs


def path_exists(run: Run, field: CostField, objective: str) -> bool:
    """Whether every leg has a path on the grid."""
    return leg_paths(run, field, objective) is not None


def why_not(run: Run, field: CostField, objective: str) -> Infeasible:
    """What is in the way on the first leg without a path; a via place is named by its number."""
    places = run.places
    for number, ends in enumerate(itertools.pairwise(places), 1):
        if run.situation.path(objective, field, *ends, run.token) is not None:
            continue
        found = explain_no_route(run.situation, objective, field, ends, run.request)
        via = [(place.x, place.y) for place in run.request.via]
        if number < len(places) - 1 and ends[1] in via:
            name = f"via[{via.index(ends[1])}] cannot be reached: "
            return replace(found, what=name + found.what)
        return found
    return Infeasible(*places[-1], "no way from start to goal")
