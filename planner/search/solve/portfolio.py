"""The best route for the time that is given, and the baselines to compare it with.

    found = best_route(run)
    found.candidate.route, found.baselines["shortest"]

The grid answers first, for the request's objective and, on the other core, for the shortest and the
fastest route: every route found counts for all three. A time budget goes into further candidates
(anytime). One power model prices every candidate, and the best one is the answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from planner.arrays import Array
from planner.errors import Cancelled
from planner.search.field import polyline_cost
from planner.search.limit_places import Infeasible
from planner.search.resolution import MARGIN, OBJECTIVES
from planner.search.results import Route, SearchSummary
from planner.search.run import Run
from planner.search.second_core import Later
from planner.search.solve.anytime import further_candidates
from planner.search.solve.descent import dissipated
from planner.search.solve.grid_paths import path_exists
from planner.search.solve.grid_planner import on_grid
from planner.search.solve.pipeline import Attempt, Candidate, cheapest_near, drive_legs
from planner.search.solve.sketch import (
    ANSWER,
    BASELINE,
    PATIENT_BASELINE,
    Effort,
    Legs,
    with_costs,
)
from planner.search.turns import turning

BASELINES = {"shortest": "length", "fastest": "time"}
"""Baselines by name, and the objective that each is best for."""
ALSO_SOUGHT: dict[str, tuple[str, ...]] = {
    "energy": (),
    "time": ("energy",),
    "length": ("energy", "time"),
}
"""Other objectives by that of a request, whose best routes are looked for with the same effort. A
shortest route of its own hardly ever is a fast one."""
UNHURRIED = 5.0
"""s of time budget from which baselines are looked for as patiently as answers are. On steep relief
that takes up to two seconds; of less time the answer needs them all."""
CLOSE = 0.02
"""Share by which a route for another objective may be worse and its path still be driven for the
request's own."""


@dataclass(frozen=True)
class Found:
    """What a search came to.

    Attributes:
        summary: how it was found.
        candidate: the best one, or None with a reason.
        baselines: "shortest" and "fastest".
        cause: what is in the way, without a route.
        notes: what the user ought to know, in sentences.
    """

    summary: SearchSummary
    candidate: Candidate | None = None
    baselines: dict[str, Route] = field(default_factory=dict)
    reason: str = ""
    cause: Infeasible | None = None
    notes: tuple[str, ...] = ()

    @property
    def route(self) -> Route | None:
        """The best route."""
        return None if self.candidate is None else self.candidate.route

    @property
    def legs(self) -> Legs | None:
        """What the best route was driven along."""
        return None if self.candidate is None else self.candidate.legs

    def on_time(self, latest_s: float, timely: Callable[[], tuple[Route | None, str]]) -> Found:
        """The route of least energy that takes no longer, and the baselines that do not either.

        Args:
            latest_s: s from start to goal.
            timely: looks for such a route, where the best one is too slow.
        """
        known = [route for route in (self.route, *self.baselines.values()) if route is not None]
        pool = [route for route in known if route.duration_s <= latest_s]
        if self.candidate is None or self.candidate.route.duration_s <= latest_s:
            return replace(self, baselines=_baselines_among(pool) if self.baselines else {})
        route, late = timely()
        pool += [] if route is None else [route]
        if not pool:
            return Found(self.summary, reason=late)
        best = replace(self.candidate, route=min(pool, key=lambda one: one.energy_j))
        return replace(
            self,
            candidate=best,
            baselines=_baselines_among(pool) if self.baselines else {},
            summary=replace(self.summary, chosen="in time"),
        )


def _baselines_among(pool: Sequence[Route]) -> dict[str, Route]:
    """The shortest and the fastest of some routes, by name."""
    return {name: min(pool, key=lambda one: one.value(aim)) for name, aim in BASELINES.items()}


def summary_of(run: Run) -> SearchSummary:
    """What the request says of its search."""
    asked = run.request
    return SearchSummary(asked.planner, asked.space, asked.objective, asked.seed)


def best_route(run: Run) -> Found:
    """The best route for a request, and how it was found.

    Raises:
        Cancelled: the caller cancelled before there was a route. Afterwards the best route so far
            is returned, with a note.
    """
    run.step(0.1, "least-cost fields, smoothing, yaw, speed")
    attempt, candidates = _by_grid(run)
    energies = [one.route.energy_j for one in candidates]
    summary = replace(
        summary_of(run),
        slope_margin=attempt.field.margin,
        grid_energy_j=min(energies, default=None),
    )
    notes: list[str] = []
    if run.seconds_left <= 0.0:
        notes.append(
            "the time budget ended before the search that needs none was done: without a budget, "
            "route and baselines may be better"
        )
    others: list[Candidate] = []
    try:
        if attempt.legs is not None and attempt.paths is not None:
            with run.within_budget() as limited:
                for candidate in further_candidates(limited, attempt):
                    others.append(candidate)
    except Cancelled:
        if run.cancelled():
            if not candidates and not others:
                raise
            notes.append("stopped early: this is the best route up to then")
    best = _best(run, [*candidates, *others])
    if best is not None:
        # Found in a time budget, a route may be chosen, but is not one to compare with.
        pool = [best.route, *(one.route for one in candidates)]
        summary = replace(summary, chosen=best.source)
        return Found(summary, best, _baselines_among(pool), notes=tuple(notes))
    return Found(summary, reason=attempt.reason, cause=attempt.infeasible, notes=tuple(notes))


def best_along(
    run: Run, paths: list[Array], summary: SearchSummary, *, compared: bool = True
) -> Found:
    """The best route along paths of another planner, as they are or smoothed.

    Args:
        run: the request.
        paths: polylines (k, 2), one for each leg.
        summary: how they were found.
        compared: whether baselines are looked for.
    """
    waiting = baselines(run) if compared else dict
    objective = run.request.objective
    field = run.field(objective, MARGIN)
    attempt = cheapest_near(run, field, paths, objective)
    candidates = [attempt.candidate("smoothed path")]
    legs = with_costs(field, paths)
    as_it_is = drive_legs(run, field, legs, objective)
    if isinstance(as_it_is, Route):
        candidates.append(Candidate(as_it_is, "path as it is", legs))
    best = _best(run, [one for one in candidates if one is not None])
    if best is None:
        return Found(summary, reason=attempt.reason, cause=attempt.infeasible)
    pool = [best.route, *(other.route for other in waiting().values() if other.route)]
    return Found(replace(summary, chosen=best.source), best, _baselines_among(pool))


def _best(run: Run, candidates: Sequence[Candidate]) -> Candidate | None:
    """The best candidate by the request's objective."""
    objective = run.request.objective
    return min(candidates, key=lambda one: one.route.value(objective), default=None)


def _by_grid(run: Run) -> tuple[Attempt, list[Candidate]]:
    """What the grid comes to for the request's objective, and all feasible candidates.

    A request for time or length gets routes of other objectives' requests as well. So its answer is
    no worse than any route that it is compared with.
    """
    objective = run.request.objective
    field = run.field(objective, MARGIN)
    if not path_exists(run, field, objective):
        # Others would look for it on the same ground, and find as little.
        attempt = on_grid(run, field, objective)
        # Narrow passages have no path on the grid; with another torque there may be one.
        passed = attempt.candidate("narrow passages" if attempt.paths is None else "grid")
        return attempt, [] if passed is None else [passed]
    with run.within_budget() as limited:
        # Only now: on steep ground, this search leaves them prices that they need not find.
        others = baselines(limited)
        own: dict[str, Attempt] = {objective: on_grid(run, field, objective)}
        rest = run if own[objective].route is None else limited
        own |= {aim: _in_time(rest, aim) for aim in ALSO_SOUGHT[objective]}
        compared = others()
        found = [own[aim].candidate("grid" if aim == objective else f"grid, {aim}") for aim in own]
        found += [other.candidate(f"grid, {name}") for name, other in compared.items()]
        for aim, attempt in own.items():
            elsewhere = {name: other for name, other in compared.items() if BASELINES[name] != aim}
            if aim != "energy":
                elsewhere["least energy"] = own["energy"]
            driven: set[bytes] = set()
            for name, other in elsewhere.items():
                # Both baselines may be straight.
                path = b"".join(path.tobytes() for path, _ in other.legs or [])
                limited.check()
                if other.legs is None or path in driven:
                    continue
                if not _worth_driving(run, attempt, other, aim):
                    continue
                driven.add(path)
                route = drive_legs(limited, attempt.field, other.legs, aim)
                if isinstance(route, Route):
                    source = "grid" if aim == objective else f"grid, {aim}"
                    found.append(Candidate(route, f"{source}, path of the {name}", other.legs))
    return own[objective], [one for one in found if one is not None]


def _in_time(run: Run, objective: str, effort: Effort = ANSWER) -> Attempt:
    """What the grid comes to for an objective; nothing where the time budget ends before."""
    field = run.field(objective, MARGIN)
    try:
        return on_grid(run, field, objective, effort)
    except Cancelled:
        if run.seconds_left > 0.0:
            raise
        return Attempt(field)


def baselines(run: Run) -> Callable[[], dict[str, Attempt]]:
    """Begin to look for the shortest and the fastest route on the other core; call for them."""
    given = "time_budget_s" in run.request.model_fields_set
    unhurried = given and run.request.time_budget_s >= UNHURRIED

    def search(aim: str) -> Later[Attempt]:
        task = partial(_in_time, run, aim, PATIENT_BASELINE if unhurried else BASELINE)
        return run.other_core.submit(task)

    waiting = {name: search(aim) for name, aim in BASELINES.items()}
    return lambda: {name: run.other_core.result(task) for name, task in waiting.items()}


def _worth_driving(run: Run, own: Attempt, other: Attempt, objective: str) -> bool:
    """Whether another objective's path may be better for an objective once it is driven for it."""
    route = own.route
    if route is None or other.route is None:
        return route is None
    assert other.legs is not None  # a route has legs
    # No motion along it costs less than its metres do, whatever it does at its bends.
    field = own.field
    metres = sum(polyline_cost(field, path, field.step) for path, _ in other.legs)
    if objective == "time":
        # Nor is it quicker than with one ramp up and one down.
        ramps = turning(run.conditions, OBJECTIVES["time"]).stop
        return metres + ramps < route.duration_s or metres < ramps
    if objective == "energy" and metres >= dissipated(run, route) and math.isfinite(metres):
        return False
    return other.route.value(objective) < (1.0 + CLOSE) * route.value(objective)
