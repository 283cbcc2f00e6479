"""The best route for the time that is given, and what contributed to it.

    found = best_route(run, run.field("energy"))

The grid with refinement answers first, for the request's objective and, on the other core, for the
shortest and the fastest route: whatever is found counts for all three. Time that is left goes into
further candidates (anytime). Every motion is priced by the power model, and
the best one is the answer. Who cancels once there is a route gets the best so far.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from planner.arrays import Array
from planner.errors import Cancelled
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, polyline_cost
from planner.search.resolution import MARGIN
from planner.search.results import Route
from planner.search.solve.anytime import improve
from planner.search.solve.drive_candidates import drive_legs
from planner.search.solve.grid_planner import Attempt, on_grid
from planner.search.solve.run import Run
from planner.search.trajectory import broken_limits

BASELINES = {"shortest": "length", "fastest": "time"}
UNHURRIED = 5.0
"""Seconds given from which baselines are looked for as patiently as answers are. On steep relief
that takes up to two seconds; of less time the answer needs them all."""
CLOSE = 0.02
"""Another aim's way that is dearer by less is driven for the request's objective as well."""


@dataclass
class Found:
    """What a search came to.

    Attributes:
        route: the best one, or None with a reason.
        baselines: "shortest" and "fastest".
        absent: why there is none of these, by name.
        planner: how it was found.
        notes: what the user ought to know, in sentences.
    """

    planner: dict[str, Any]
    route: Route | None = None
    baselines: dict[str, Route] = field(default_factory=dict)
    absent: dict[str, str] = field(default_factory=dict)
    reason: str = ""
    notes: list[str] = field(default_factory=list)


def value_of(route: Route, objective: str) -> float:
    """What an objective wants little of: J, s or m."""
    return {"energy": route.energy_j, "time": route.duration_s, "length": route.length_m}[objective]


def shortest_and_fastest(pool: Sequence[Route]) -> dict[str, Route]:
    """The baselines among some routes, by name."""
    return {
        name: min(pool, key=partial(value_of, objective=aim)) for name, aim in BASELINES.items()
    }


def best_route(run: Run, field: CostField) -> Found:
    """The best route for a request, and how it was found.

    Args:
        run: the request.
        field: map and costs for its objective.
    """
    request = run.request
    objective = request.objective
    begun = time.perf_counter()
    found = Found({"name": request.planner, "objective": objective, "seed": request.seed})
    run.step(0.1, "least-cost fields, refinement, yaw, speed")
    attempt, candidates = _by_grid(run, field)
    from_grid = set(candidates)
    found.planner["slope_margin"] = attempt.field.margin
    if attempt.refined is not None:
        found.planner["grid_cost"] = sum(cost for _, cost in attempt.refined)
    if candidates:
        found.planner["grid_energy_j"] = min(route.energy_j for route in candidates.values())
    try:
        if attempt.paths is not None and attempt.refined is not None:
            improve(run, attempt, candidates, found.planner, found.notes, begun)
    except Cancelled:
        if not candidates:
            raise
        found.notes.append("stopped early: this is the best route up to then")

    def keeps_limits(name: str) -> bool:
        motion = candidates[name].motion
        # Many are tried in the time that is given, and one of them may slip through.
        if motion is None or name in from_grid:
            return True
        return not broken_limits(field, run.around, motion, finely=True)

    names = sorted(candidates, key=lambda name: value_of(candidates[name], objective))
    chosen = next(filter(keeps_limits, names), None)
    if chosen is not None:
        found.planner["chosen"] = chosen
        found.route = candidates[chosen]
        # Found in time that was given, a route may be chosen, but is none to compare with.
        pool = [found.route, *(candidates[name] for name in candidates if name in from_grid)]
        found.baselines = shortest_and_fastest(pool)
    elif attempt.route is not None:
        found.planner["chosen"] = "grid"
        found.route = attempt.route
        assert attempt.stuck is not None  # as every route that does not keep to the limits
        place = f"x {attempt.stuck.x:.2f}, y {attempt.stuck.y:.2f}"
        found.notes.append(f"no way keeps to all limits: at {place} {attempt.stuck.what}")
        reason = "no route was found that keeps to all limits"
        found.absent = dict.fromkeys(BASELINES, reason)
    else:
        found.reason = attempt.reason
    return found


def _by_grid(run: Run, field: CostField) -> tuple[Attempt, dict[str, Route]]:
    """What the grid comes to for the request's objective, and all routes within the limits by name.

    A request for time or length gets the routes of the other objectives' requests as well. So its
    answer is no worse than what any of these compares with.
    """
    objective = run.request.objective
    fields = {aim: run.field(aim, MARGIN, field.factor) for aim in ("energy", *BASELINES.values())}
    given = "time_budget_s" in run.request.model_fields_set
    patient = given and run.request.time_budget_s >= UNHURRIED
    compare = partial(on_grid, compared=True, patient=patient)
    waiting = {
        name: run.other_core.submit(partial(compare, run, fields[aim], aim))
        for name, aim in BASELINES.items()
    }
    aims = ["energy"] if objective == "energy" else [objective, *(fields.keys() - {objective})]
    own = {aim: on_grid(run, fields[aim], aim) for aim in aims}
    others = {name: run.other_core.result(task) for name, task in waiting.items()}
    routes: dict[str, Route | None] = {}
    for aim, attempt in own.items():
        grid = "grid" if aim == objective else f"grid, {aim}"
        routes[grid] = attempt.route if attempt.kept else None
        ways = {name: other for name, other in others.items() if BASELINES[name] != aim}
        if aim != "energy":
            ways["least energy"] = own["energy"]
        driven: set[bytes] = set()
        for name, other in ways.items():
            if other.refined is None or (way := _way(other.refined)) in driven:
                continue
            if _worth_driving(run, attempt, other, aim):
                driven.add(way)
                route = drive_legs(run, attempt.field, other.refined, aim)
                routes[f"{grid}, way of the {name}"] = route if isinstance(route, Route) else None
    routes |= {f"grid, {name}": other.route for name, other in others.items()}
    return own[objective], {name: route for name, route in routes.items() if route is not None}


def _way(refined: list[tuple[Array, float]]) -> bytes:
    """What tells one way from another: both baselines may be straight."""
    return b"".join(path.tobytes() for path, _ in refined)


def _worth_driving(run: Run, own: Attempt, other: Attempt, objective: str) -> bool:
    """Whether another aim's way may be better for an objective once it is driven for it."""
    route = own.route if own.kept else None
    if route is None or other.route is None:
        return route is None
    assert other.refined is not None  # a route has a way
    if objective == "energy":
        # No motion along it dissipates less than its metres do, whatever it does at its bends.
        field = own.field
        metres = sum(polyline_cost(field, path, field.step) for path, _ in other.refined)
        dissipated = route.energy_j - run.around.mass * STANDARD_GRAVITY * route.rise_m
        if metres >= dissipated and math.isfinite(metres):
            return False
    return value_of(other.route, objective) < (1.0 + CLOSE) * value_of(route, objective)
