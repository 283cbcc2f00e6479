"""Further routes in the time that is left once the grid has answered.

    improve(run, attempt, candidates, planner, notes, begun)

OMPL searches in a tube round the grid's path, or on the whole map. For the least energy the grid
then searches again: with its costs shaken a little, for ways that cost about the same end in other
valleys once they are refined, and away from what was found. The best of these ways are refined with
other knots and tolls, and the knots of the best ones are moved while their motions get cheaper.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from planner.arrays import Array
from planner.search.field import CostField, polyline_cost
from planner.search.results import Route
from planner.search.solve.alternatives import nearness
from planner.search.solve.drive_candidates import drive_legs
from planner.search.solve.grid_planner import Attempt, near_path_of
from planner.search.solve.run import Run
from planner.search.solve.sampled_legs import ompl_legs
from planner.search.trajectory import Stuck
from planner.search.waypoints import polish, refine

Legs = list[tuple[Array, float]]
"""Polylines (k, 2) from one fixed place to the next, with their costs."""

FOR_OMPL = 0.2
"""Share of the time left that OMPL has."""
DETOURS, SHAKEN_EACH = 2, 3
"""Searches away from what was found, at most, and searches with shaken costs before each."""
SEARCHES = 6
"""Of both where iterations are given, which make an answer reproducible."""
SHAKE, GRAIN = 0.03, 3.0
"""Standard deviation of the logarithm of a shaken cost, and of its grain in cells: ways that cost
about the same before they are refined come out in turn, and end in other valleys."""
FOR_REFINEMENT = 0.4
"""Share of the time given that is kept for other refinements."""
PROMISING = 4
"""Ways that are refined otherwise."""
DEARER = 0.1
"""By how much ground near a known route gets dearer for the next one."""
KNOTS, SHARES = (4.0, 8.0, 6.0, 12.0, 3.0, 16.0), (1.0, 0.3, 0.1, 3.0)
"""Cells between knots, and shares of a corner's toll, that ways are refined with in time left."""
FOR_POLISH, POLISH = 0.2, (1.0, 0.5, 0.5, 0.25, 0.25, 0.1)
"""Share of the time given that is kept for moving knots, and by how many cells they are moved."""
POLISHED = {24.0: 4, 12.0: 2, 16.0: 1}
"""How many ways get their knots moved, by the cells between these, one after the other."""
ENOUGH = 0.15
"""s left from which another search is begun."""


def improve(
    run: Run,
    attempt: Attempt,
    candidates: dict[str, Route],
    planner: dict[str, Any],
    notes: list[str],
    begun: float,
) -> None:
    """Further candidates in the time that is left.

    Args:
        run: the request.
        attempt: what the grid came to.
        candidates: routes by how they were found; gets more.
        planner, notes: of the answer; get what is to be said of the search.
        begun: time.perf_counter() when the search began.

    Raises:
        Cancelled: the caller wants to stop; what was found up to then is in ``candidates``.
    """
    request = run.request
    given = bool({"time_budget_s", "iterations"} & request.model_fields_set)
    if request.planner == "grid" or (request.planner == "auto" and not given):
        return

    def left() -> float:
        return request.time_budget_s - (time.perf_counter() - begun)

    if request.iterations is None and left() < ENOUGH:
        notes.append("the time given was up before OMPL could begin")
        return
    share = left() if request.planner != "auto" else FOR_OMPL * left()
    run.step(0.4, "OMPL")
    ompl = ompl_legs(run, attempt, share)
    planner |= ompl.said
    notes += [] if ompl.note is None else [ompl.note]
    legs, driven = ompl.legs, None
    if not ompl.nothing:
        driven = drive_legs(run, attempt.field, legs, request.objective)
    if isinstance(driven, Route):
        partly = ompl.said["legs_without_ompl"] > 0
        candidates["ompl and grid" if partly else "ompl"] = driven
        if not partly:
            planner["ompl_energy_j"] = driven.energy_j
    if request.planner != "auto" or request.objective != "energy":
        return
    driven_legs: list[tuple[Legs, Route]] = []
    ways: list[tuple[Route, list[Array]]] = []
    if attempt.route is not None:
        driven_legs.append((attempt.refined or [], attempt.route))
        ways.append((attempt.route, attempt.paths or []))
    if isinstance(driven, Route):
        driven_legs.append((legs, driven))
        ways.append((driven, [path for path, _ in legs]))
    others, kept = other_ways(run, attempt, candidates), FOR_REFINEMENT * request.time_budget_s
    for number in itertools.count():
        if request.iterations is not None:
            up = number == SEARCHES
        else:
            up = left() < max(ENOUGH, kept)
        if up or not candidates:
            break
        name, other = next(others)
        if other.route is not None:
            candidates[name] = other.route
            driven_legs.append((other.refined or [], other.route))
            ways.append((other.route, other.paths or []))
    if request.iterations is None:
        ways.sort(key=lambda way: way[0].energy_j)
        best = [paths for _, paths in ways[:PROMISING]]
        driven_legs += _refine_otherwise(run, attempt.field, best, candidates, left)
        move_knots(run, attempt.field, driven_legs, candidates, left)


def other_ways(
    run: Run, attempt: Attempt, candidates: dict[str, Route]
) -> Iterator[tuple[str, Attempt]]:
    """Attempts with shaken costs without end, and now and then one away from what was found."""
    objective, own = run.request.objective, attempt.field
    random = np.random.default_rng(run.request.seed)
    away, detours = np.ones(own.heights.shape), 0
    for number in itertools.count(1):
        run.step(0.7, "other ways")
        grain = gaussian_filter(random.standard_normal(own.heights.shape), GRAIN)
        shaken = own.factor * np.exp(SHAKE / grain.std() * grain)
        yield f"shaken {number}", near_path_of(run, own, shaken, objective)
        if number % SHAKEN_EACH == 0 and detours < DETOURS:
            detours += 1
            away = away * (1.0 + DEARER * nearness(list(candidates.values())[-1], own))
            yield f"detour {detours}", near_path_of(run, own, own.factor * away, objective)


def _refine_otherwise(
    run: Run,
    field: CostField,
    ways: list[list[Array]],
    candidates: dict[str, Route],
    left: Callable[[], float],
) -> list[tuple[Legs, Route]]:
    """Refine ways with other knots and tolls than a search has time for, two at once."""
    toll = run.situation.toll("energy")
    field = run.field("energy", field.margin)

    def refined(knots: float, share: float, way: list[Array]) -> tuple[Legs, Route | Stuck]:
        legs = [
            refine(field, path, tolls=[share * toll], knot_cells=knots, check=run.check)[0]
            for path in way
        ]
        return legs, drive_legs(run, field, legs, "energy")

    kinds = sorted(
        itertools.product(KNOTS, SHARES),
        key=lambda kind: KNOTS.index(kind[0]) + SHARES.index(kind[1]),
    )
    tasks = [partial(refined, *kind, way) for kind in kinds for way in ways if way]
    found: list[tuple[Legs, Route]] = []
    kept = FOR_POLISH * run.request.time_budget_s
    for first in range(0, len(tasks), 2):
        if left() < max(ENOUGH, kept):
            break
        run.step(0.85, "other refinements")
        for legs, route in run.other_core.all(tasks[first : first + 2]):
            if isinstance(route, Route):
                found.append((legs, route))
                best = candidates.get("refined otherwise", route)
                candidates["refined otherwise"] = min(best, route, key=lambda r: r.energy_j)
    return found


def move_knots(
    run: Run,
    field: CostField,
    ways: list[tuple[Legs, Route]],
    candidates: dict[str, Route],
    left: Callable[[], float],
) -> None:
    """Move the knots of the best ways, and then closer knots, while their motions get cheaper."""
    field = run.field("energy", field.margin)

    def steps() -> Iterator[float]:
        return itertools.takewhile(lambda _: left() > ENOUGH, POLISH)

    ways = list({round(route.energy_j, 6): (legs, route) for legs, route in ways}.values())
    for spacing, count in POLISHED.items():
        ways.sort(key=lambda way: way[1].energy_j)
        for k, (legs, route) in enumerate(ways[:count]):
            if left() < ENOUGH:
                return
            run.step(0.95, "other refinements")
            better = polish(
                field,
                run.around,
                [path for path, _ in legs],
                run.yaws,
                steps=steps(),
                spacing=spacing,
                both=run.other_core.all,
                check=run.check,
            )
            moved = [(leg, float(polyline_cost(field, leg, field.step))) for leg in better.legs]
            now = drive_legs(run, field, moved, "energy")
            if isinstance(now, Route) and now.energy_j < route.energy_j:
                ways[k] = moved, now
                best = candidates.get("polished", now)
                candidates["polished"] = min(best, now, key=lambda one: one.energy_j)
