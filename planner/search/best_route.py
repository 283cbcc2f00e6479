"""The best route for the time that is given, and what contributed to it.

    found = best_route(run, run.field("energy"))

The grid with refinement answers first, for the request's objective and, on the other core, for
the shortest and the fastest route: whatever is found counts for all three. With time left, OMPL
searches in a tube round the grid's path (or on the whole map), the grid searches again away from
what it found, and all of these ways are refined with other knots and tolls. Every motion is priced
by the power model, and the best one is the answer. Who cancels once there is a route gets the best
so far.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import Cancelled
from planner.quantities import STANDARD_GRAVITY
from planner.search.alternatives import nearness
from planner.search.drive import Stuck
from planner.search.grid_route import Attempt, drive_legs, on_grid
from planner.search.ground import CostField, polyline_cost
from planner.search.kept_limits import broken_limits
from planner.search.ompl_route import ompl_legs
from planner.search.refine import refine
from planner.search.route import Route
from planner.search.run import Run
from planner.search.steady import MARGIN

Array = NDArray[np.float64]

BASELINES = {"shortest": "length", "fastest": "time"}
DETOURS = 6
"""Searches away from what was found, at most."""
DEARER = 0.1
"""By how much ground near a known route gets dearer for the next one."""
CLOSE = 0.02
"""Another aim's way that is dearer by less is driven for the request's objective as well."""
KNOTS, SHARES = (4.0, 8.0, 6.0, 12.0, 3.0, 16.0), (1.0, 0.3, 0.1, 3.0)
"""Cells between knots, and shares of a corner's toll, that ways are refined with in time left."""
ENOUGH = 0.15
"""s left from which another search is begun."""


@dataclass
class Found:
    """What a search came to.

    Attributes:
        route: the best one, or None with a reason.
        baselines: "shortest" and "fastest".
        planner: how it was found.
        notes: what the user ought to know, in sentences.
    """

    planner: dict[str, Any]
    route: Route | None = None
    baselines: dict[str, Route] = field(default_factory=dict)
    reason: str = ""
    notes: list[str] = field(default_factory=list)


def value_of(route: Route, objective: str) -> float:
    """What an objective wants little of: J, s or m."""
    return {"energy": route.energy_j, "time": route.duration_s, "length": route.length_m}[objective]


def best_route(run: Run, field: CostField) -> Found:
    """The best route for a request, and how it was found.

    Args:
        run: the request.
        field: map and costs for its objective.
    """
    request = run.request
    begun = time.perf_counter()
    found = Found({"name": request.planner, "seed": request.seed})
    run.step("least-cost fields, refinement, yaw, speed", 0.1)
    waiting = {
        name: run.other_core.submit(
            partial(on_grid, run, run.field(aim, MARGIN, field.factor), aim)
        )
        for name, aim in BASELINES.items()
        if aim != request.objective
    }
    attempt = on_grid(run, field, request.objective)
    others = {name: run.other_core.result(task) for name, task in waiting.items()}
    if attempt.paths is None or attempt.refined is None:
        found.reason = attempt.reason
        return found
    routes = {"grid": attempt.route}
    # To compare with, limits between the stations do not matter; for an answer they do.
    unchecked = {f"grid, {name}" for name in others}
    ways: set[bytes] = set()
    for name, other in others.items():
        routes[f"grid, {name}"] = other.route
        if other.refined is None or (way := _way(other.refined)) in ways:
            continue
        if _worth_driving(run, field, other, attempt.route):
            ways.add(way)
            driven = drive_legs(run, field, other.refined, request.objective)
            routes[f"grid, way of the {name}"] = driven if isinstance(driven, Route) else None
    candidates = {name: route for name, route in routes.items() if route is not None}
    found.planner["slope_margin"] = attempt.field.margin
    found.planner["grid_cost"] = sum(cost for _, cost in attempt.refined)
    if candidates:
        found.planner["grid_energy_j"] = min(route.energy_j for route in candidates.values())
    try:
        _improve(run, attempt, candidates, found, begun)
    except Cancelled:
        if not candidates:
            raise
        found.notes.append("stopped early: this is the best route up to then")
    if not candidates:
        found.reason = attempt.reason
        return found

    def ranked(objective: str) -> list[str]:
        return sorted(candidates, key=lambda name: value_of(candidates[name], objective))

    def keeps_limits(name: str) -> bool:
        motion = candidates[name].motion
        return name not in unchecked or not (motion and broken_limits(field, run.around, motion))

    names = ranked(request.objective)
    found.planner["chosen"] = chosen = next(filter(keeps_limits, names), names[0])
    found.route = candidates[chosen]
    found.baselines = {name: candidates[ranked(aim)[0]] for name, aim in BASELINES.items()}
    return found


def _way(refined: list[tuple[Array, float]]) -> bytes:
    """What tells one way from another: both baselines may be straight."""
    return b"".join(path.tobytes() for path, _ in refined)


def _worth_driving(run: Run, field: CostField, other: Attempt, route: Route | None) -> bool:
    """Whether another aim's way may be better for this objective once it is driven for it."""
    objective = run.request.objective
    if route is None or other.route is None or other.refined is None:
        return route is None
    if objective == "energy":
        # No motion along it dissipates less than its metres do, whatever it does at its bends.
        metres = sum(polyline_cost(field, path, field.step) for path, _ in other.refined)
        dissipated = route.energy_j - run.around.mass * STANDARD_GRAVITY * route.rise_m
        if metres >= dissipated and math.isfinite(metres):
            return False
    return value_of(other.route, objective) < (1.0 + CLOSE) * value_of(route, objective)


def _improve(
    run: Run, attempt: Attempt, candidates: dict[str, Route], found: Found, begun: float
) -> None:
    """Further candidates in the time that is left."""
    request = run.request
    given = bool({"time_budget_s", "iterations"} & request.model_fields_set)
    if request.planner == "grid" or (request.planner == "auto" and not given):
        return

    def left() -> float:
        return request.time_budget_s - (time.perf_counter() - begun)

    if request.iterations is None and left() < ENOUGH:
        found.notes.append("the time given was up before OMPL could begin")
        return
    share = left() if request.planner != "auto" else 0.5 * left()
    run.step("OMPL", 0.4)
    legs, said = ompl_legs(run, attempt, share)
    found.planner |= said
    driven = drive_legs(run, attempt.field, legs, request.objective)
    if isinstance(driven, Route):
        candidates["ompl"] = driven
        found.planner["ompl_energy_j"] = driven.energy_j
    if request.planner != "auto" or request.objective != "energy":
        return
    factor = np.ones(attempt.field.heights.shape)
    ways = [attempt.paths or [], [path for path, _ in legs]]
    for number in range(DETOURS):
        if not candidates or (request.iterations is None and left() < ENOUGH):
            break
        run.step("other ways", 0.7 + 0.02 * number)
        latest = list(candidates.values())[-1]
        factor = factor * (1.0 + DEARER * nearness(latest, attempt.field))
        other = on_grid(run, run.field(request.objective, MARGIN, factor), request.objective)
        if other.route is None or other.paths is None:
            break
        candidates[f"detour {number + 1}"] = other.route
        ways.append(other.paths)
    if request.iterations is None:
        _refine_otherwise(run, attempt.field.margin, ways, candidates, left)


def _refine_otherwise(
    run: Run,
    margin: float,
    ways: list[list[Array]],
    candidates: dict[str, Route],
    left: Callable[[], float],
) -> None:
    """Refine ways with other knots and tolls than a search has time for, two at once."""
    objective = run.request.objective
    field, toll = run.field(objective, margin), run.situation.toll(objective)

    def refined(knots: float, share: float, way: list[Array]) -> Route | Stuck:
        legs = [
            refine(field, path, tolls=[share * toll], knot_cells=knots, check=run.check)[0]
            for path in way
        ]
        return drive_legs(run, field, legs, objective)

    kinds = sorted(
        itertools.product(KNOTS, SHARES),
        key=lambda kind: KNOTS.index(kind[0]) + SHARES.index(kind[1]),
    )
    tasks = [partial(refined, *kind, way) for kind in kinds for way in ways if way]
    for first in range(0, len(tasks), 2):
        if left() < ENOUGH:
            break
        run.step("other refinements", 0.85)
        for route in run.other_core.all(tasks[first : first + 2]):
            if isinstance(route, Route):
                best = candidates.get("refined otherwise", route)
                candidates["refined otherwise"] = min(best, route, key=lambda r: r.energy_j)
