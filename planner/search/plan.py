"""Plan a route: from a request to an answer.

    answer = plan_route({"map": "warehouse", "start": {"x": 2, "y": 2}, "goal": {"x": 27, "y": 17}})

From a request to its answer: map and model → costs of steady driving → one of OMPL's planners, by
default joulepath's own (least-cost field on the grid, smoothing, yaw, speed) → energy. Baselines
(shortest, fastest) and alternatives use the same pipeline with a different cost, and one model
prices all of them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from os import PathLike
from typing import Any

import numpy as np

from planner.amounts import joules, seconds, share
from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.progress import Progress, silent
from planner.search.conditions import assumptions
from planner.search.goals import check_places, settled
from planner.search.ompl import answer, solved
from planner.search.requests import (
    PlanRequest,
    PoseRequest,
    RegionRequest,
    RequestLike,
    SituationRequest,
)
from planner.search.resolution import MARGIN
from planner.search.results import Answer, Baseline, Route
from planner.search.run import Run
from planner.search.situation import Situation
from planner.search.solve import Found, find_alternatives, on_grid, summary_of, with_bounds
from planner.search.tradeoff import in_time
from planner.terrain.heightmap import Terrain

BEYOND_LOG = 1.05
"""Speed or payload of a route over the largest of the log that its model was fitted to, from which
it is another regime: a fit bends little within 5 %."""
STEEPER_THAN_LOG = math.radians(1.0)
"""rad; slopes along the travel this much beyond the log's are another regime, a level floor's are
not."""
LEAST_BEYOND = 0.1
"""Share of its time that a route must spend there for an answer to say so."""
LEAST_RETURNED = 0.01
"""Share of the energy drawn that must flow back for an answer to say so."""


def plan_route(
    request: PlanRequest | RequestLike = None,
    *,
    terrain: Terrain | None = None,
    model: PowerModel | str | PathLike[str] | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    **fields: Any,
) -> Answer:
    """Plan the route that costs least energy.

    Args:
        request: a PlanRequest, a mapping with its fields, or the path of a REQUEST.json; or give
            the fields as keyword arguments.
        terrain: a terrain that is already there, instead of the request's ``map``.
        model: a power model that is already there, instead of the request's vehicle or model;
            a text or a path is the request's field ``model``.
        progress: called with the share done, 0 to 1, and what is being done.
        cancelled: asked often; True raises Cancelled.
        fields: fields of the request, over those of ``request``; ``map`` may be a Terrain,
            ``vehicle`` a Vehicle and ``model`` a PowerModel.

    Returns:
        An Answer of status "ok", or "no_route" with the reason.

    Raises:
        RequestError, MapError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` returned True.
    """
    begun = time.perf_counter()
    say = progress or silent
    say(0.0, "reading map and model")
    request, situation = Situation.asked(PlanRequest, request, fields, terrain, model)
    with CancellationToken(cancelled) as token:
        return _plan(Run(request, situation, say, token, begun=begun))


def _plan(run: Run) -> Answer:
    request, objective = run.request, run.request.objective
    run.step(0.05, "costs of steady driving")
    refused = check_places(run, run.field(objective, MARGIN))
    terrain, model = run.ground.terrain, run.conditions.model.describe()
    blank = Answer("no_route", terrain, model, summary_of(run), notes=_notes(run))
    if refused is not None:
        return replace(blank, reason=refused.what, cause=refused.to_json())
    open_ended = run
    run, found = _arriving(run, objective)
    latest = request.max_duration_s or math.inf
    if found.route is not None and request.max_duration_s is not None:
        found = found.on_time(latest, lambda: in_time(open_ended, latest))
    best = found.route
    if best is None:
        cause = None if found.cause is None else found.cause.to_json()
        return replace(blank, reason=found.reason, cause=cause, planner=found.summary)
    routes: tuple[Route, ...] = (best,)
    notes = [*blank.notes, *found.notes]
    summary = found.summary
    if request.alternatives > 1 and not run.cancelled():
        run.step(0.9, "alternatives")
        routes, note = find_alternatives(
            best,
            request.alternatives,
            lambda factor: _with_factor(run, factor),
            run.field(objective, MARGIN),
            lambda route: route.value(objective),
        )
        notes += [note] if note else []
        routes = tuple(route for route in routes if route.duration_s <= latest)
    routes, how, note = with_bounds(run, routes)
    notes += [note] if note else []
    notes += [*_assumed_of(best, run.conditions.model), *_rests_of(best)]
    notes += _beyond_log(best, run.conditions.model, request.payload.mass)
    summary = replace(summary, **how)
    every = request.poses_every_s
    if every is not None:
        routes = tuple(route.with_poses_every(every) for route in routes)
    run.progress(1.0, "done")
    return replace(
        blank,
        status="ok",
        routes=routes,
        baselines={
            name: Baseline(route, _beyond(route.energy_j, best.energy_j))
            for name, route in found.baselines.items()
        },
        planner=summary,
        notes=tuple(notes),
        goal=_arrived(request.goal, best),
    )


def _arriving(run: Run, objective: str) -> tuple[Run, Found]:
    """The run with one place for a goal, and what its search comes to; if possible with a route."""
    first: tuple[Run, Found] | None = None
    for one in settled(run, objective):
        found = answer(one)
        if found.route is not None:
            return one, found
        first = first or (one, found)
    assert first is not None  # a goal has a place
    return first


def _beyond(energy: float, least: float) -> float:
    """Energy beyond another one as a share of its size; above 0 also where the other flows back."""
    return (energy - least) / abs(least) if least else 0.0


def _assumed_of(route: Route, model: PowerModel) -> list[str]:
    """What a route's energy rests on that no key of a vehicle file states."""
    back = route.returned_j
    limited = any(effect.slug == "regeneration_limit" for effect in model.effects)
    if limited or back <= LEAST_RETURNED * (route.energy_j + back):
        return []
    return [
        f"{joules(back)} of braking flow back to the source and count in full, as the model has "
        "no regeneration_limit"
    ]


def _beyond_log(route: Route, model: PowerModel, payload_kg: float) -> list[str]:
    """Where a route leaves what its model was fitted to: the interval knows nothing of that."""
    covered = None if model.energy_error is None else model.energy_error.covered
    if covered is None:
        return []
    times, lengths = np.diff(route.arrays["t"]), np.diff(route.distance_m)
    driven = (times > 0.0) & (lengths > 0.0)
    speeds = lengths[driven] / times[driven]
    slopes = np.arcsin(np.clip(np.diff(route.arrays["z"])[driven] / lengths[driven], -1.0, 1.0))
    parts = {
        f"faster than {covered.speed_mps:.3g} m/s": speeds > BEYOND_LOG * covered.speed_mps,
        f"steeper than {math.degrees(covered.slope_rad):.2g}°": (
            np.abs(slopes) > covered.slope_rad + STEEPER_THAN_LOG
        ),
    }
    shares = {what: float(times[driven] @ there) / times.sum() for what, there in parts.items()}
    found = [
        f"{what} for {share(part)} of the time"
        for what, part in shares.items()
        if part > LEAST_BEYOND
    ]
    if payload_kg > BEYOND_LOG * covered.payload_kg:
        found.append(f"a payload above {covered.payload_kg:.3g} kg")
    if not found:
        return []
    return [
        f"beyond the log that the model was fitted to: {', '.join(found)}; the energy interval "
        "does not cover that"
    ]


def _rests_of(route: Route) -> list[str]:
    """What a user ought to know of rests: standing still may look like a failure."""
    motion = route.motion
    steps = () if motion is None else motion.rests
    if motion is None or not len(steps):
        return []
    longest = steps[np.diff(motion.time)[steps].argmax()]
    whole = float(np.diff(motion.time)[steps].sum())
    count = "rests once" if len(steps) == 1 else f"rests {len(steps)} times"
    where = f"x {motion.x[longest]:.2f}, y {motion.y[longest]:.2f}"
    return [
        f"the robot {count} for its motors to cool, {seconds(whole)} in all, longest at {where}"
    ]


def _with_factor(run: Run, factor: Array) -> Route | None:
    """The best feasible route of the grid with a factor (ny, nx) on the cost of the ground."""
    objective = run.request.objective
    attempt, _ = solved(
        run, lambda run: on_grid(run, run.field(objective, MARGIN, factor), objective)
    )
    return attempt.route


def _arrived(asked: PoseRequest | RegionRequest, route: Route) -> Mapping[str, float] | None:
    """Where a route ends that could choose: x, y, yaw and, of several places, which."""
    if not isinstance(asked, RegionRequest):
        return None
    end = {name: float(route.arrays[name][-1]) for name in ("x", "y", "yaw")}

    def off(place: PoseRequest) -> tuple[float, float]:
        turn = 0.0 if place.yaw is None else place.yaw - end["yaw"]
        away = math.hypot(place.x - end["x"], place.y - end["y"])
        return away, abs(math.remainder(turn, 2.0 * math.pi))

    if asked.any is not None:
        apart = [off(place) for place in asked.any]
        end["number"] = apart.index(min(apart))
    return end


def _notes(run: Run) -> tuple[str, ...]:
    notes = [*assumptions(run.request, run.conditions, run.ground.terrain)]
    ends = {"start": run.request.start, "goal": run.request.goal}
    ends |= {f"via[{k}]": place for k, place in enumerate(run.request.via)}
    for name, place in ends.items():
        if place.yaw is not None and abs(place.yaw) > 2.0 * math.pi:
            notes.append(
                f"{name}.yaw of {place.yaw:g} rad is more than a turn; if degrees were meant, "
                f"{place.yaw:g}° are {math.radians(place.yaw):.4g} rad"
            )
    return tuple(notes)


@lru_cache(maxsize=1)  # done once, keeps nothing
def warm_up() -> None:
    """Load everything a first request would load; for workers that wait for one."""
    model = PowerModel.from_vehicle(load_vehicle(SituationRequest.default_vehicle))
    model.kernel, model.limits_kernel  # noqa: B018
