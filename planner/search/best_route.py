"""The best route for the time that is given, and what contributed to it.

    found = best_route(run, run.field("energy"))

The grid with refinement answers first, for the request's objective and, on the other core, for
the shortest and the fastest route: whatever is found counts for all three. Time that is left goes
into further candidates (planner.search.time_left). Every motion is priced by the power model, and
the best one is the answer. Who cancels once there is a route gets the best so far.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import Cancelled
from planner.quantities import STANDARD_GRAVITY
from planner.search.grid_route import Attempt, drive_legs, on_grid
from planner.search.ground import CostField, polyline_cost
from planner.search.kept_limits import FINELY, FINENESS, broken_limits
from planner.search.route import Route
from planner.search.run import Run
from planner.search.steady import MARGIN
from planner.search.time_left import improve

Array = NDArray[np.float64]

BASELINES = {"shortest": "length", "fastest": "time"}
CLOSE = 0.02
"""Another aim's way that is dearer by less is driven for the request's objective as well."""


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
        improve(run, attempt, candidates, found.planner, found.notes, begun)
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
        if motion is None or (name in routes and name not in unchecked):
            return True
        # Many are tried in the time that is given, and one of them may slip through.
        fineness = FINENESS if name in unchecked else FINELY
        return not broken_limits(field, run.around, motion, fineness)

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
