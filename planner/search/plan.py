"""Plan a route: from a request to an answer.

    answer = plan_route({"map": "warehouse", "start": {"x": 2, "y": 2}, "goal": {"x": 27, "y": 17}})

The way of a request: map and model → costs of steady driving → the least-cost field on the grid →
OMPL in a tube round the field's path → refinement → yaw → speed → energy. Baselines (shortest,
fastest) and alternatives go the same way with other costs, and all are priced by one model.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import Cancelled, RequestError
from planner.power.model import PowerModel
from planner.power.vehicle import Vehicle, load_vehicle
from planner.quantities import STANDARD_GRAVITY
from planner.search.alternatives import find_alternatives
from planner.search.conditions import Circumstances, circumstances
from planner.search.cost_to_go import cost_field_to, cost_floor, grid_path
from planner.search.drive import Stuck, drive
from planner.search.explain import check_hold, check_place, explain_no_route
from planner.search.ground import CostField, DrivingGround, driving_ground, polyline_cost
from planner.search.refine import refine
from planner.search.request import DEFAULT_VEHICLE, PlanRequest
from planner.search.route import Answer, Baseline, Route
from planner.search.steady import MARGIN, OBJECTIVES, steady_costs
from planner.terrain.catalogue import open_map
from planner.terrain.heightmap import Terrain

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

KINDS = ("sound", "printed/A", "printed/B")
MARGINS = (MARGIN, 0.95, 0.9, 0.8)
"""Shares of the slope limit to search with, until the finished motion keeps to all limits."""
ROOMS = (0.0, 0.4, 1.0, 2.0, 5.0, 16.0)
"""How much dearer ground gets where the body fits with hardly a yaw, until it can turn in time."""
MUCH = 1.1
"""Energy over that of even driving from which a way with more room is tried as well."""


BASELINES = {"shortest": "length", "fastest": "time"}


@dataclass
class _Run:
    """What the steps of one request share."""

    request: PlanRequest
    ground: DrivingGround
    around: Circumstances
    progress: Progress
    cancelled: Callable[[], bool]

    def step(self, what: str, share: float) -> None:
        """Tell how far it is, and stop if the caller wants to."""
        self.check()
        self.progress(what, share)

    def check(self) -> None:
        """Stop if the caller wants to."""
        if self.cancelled():
            raise Cancelled("cancelled by the caller")

    @property
    def places(self) -> list[tuple[float, float]]:
        """Start, via points and goal."""
        r = self.request
        return [(p.x, p.y) for p in (r.start, *r.via, r.goal)]

    @property
    def yaws(self) -> list[float | None]:
        """Yaw asked for at each of them."""
        r = self.request
        return [p.yaw for p in (r.start, *r.via, r.goal)]

    def field(self, objective: str, margin: float, factor: Array | None = None) -> CostField:
        """Map and costs for an objective."""
        costs = steady_costs(self.around.model, self.around.class_rows, objective)
        extra = self.around.wind_by_direction() if objective == "energy" else None
        return self.ground.field(costs, extra=extra, factor=factor, margin=margin)


def plan_route(
    request: PlanRequest | Mapping[str, Any] | None = None,
    *,
    terrain: Terrain | None = None,
    model: PowerModel | str | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    **fields: Any,
) -> Answer:
    """Plan the route that costs least energy.

    Args:
        request: a PlanRequest, or a mapping with its fields (REQUEST.json); or give the fields as
            keyword arguments.
        terrain: a terrain that is already there, instead of the request's ``map``.
        model: a power model that is already there, instead of the request's vehicle or model;
            a text is the request's field ``model``.
        progress: called with what is being done and the share done, 0 to 1.
        cancelled: asked often; True raises Cancelled.
        fields: fields of the request, over those of ``request``.

    Returns:
        An Answer of status "ok", or "no_route" with the reason.

    Raises:
        RequestError, MapError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` returned True.
    """
    if isinstance(model, str):
        fields, model = {"model": model, **fields}, None
    if terrain is not None:
        fields = {"map": terrain.name, **fields}
    if not isinstance(request, PlanRequest):
        request = PlanRequest.from_json({**(request or {}), **fields})
    elif fields:
        request = PlanRequest.from_json({**request.model_dump(exclude_unset=True), **fields})
    say = progress or (lambda _what, _share: None)
    say("reading map and model", 0.0)
    model = load_model(request) if model is None else model
    terrain = open_map(request.map) if terrain is None else terrain
    ground = _ground(terrain, model.vehicle)
    around = circumstances(request, model, terrain)
    run = _Run(request, ground, around, say, cancelled or (lambda: False))
    return _plan(run)


def load_model(request: PlanRequest) -> PowerModel:
    """The power model that a request names: a vehicle, a saved model, or a kind of model."""
    if request.model is None:
        return PowerModel.from_vehicle(load_vehicle(request.vehicle or DEFAULT_VEHICLE))
    if request.model in KINDS:
        return PowerModel.from_vehicle(load_vehicle(DEFAULT_VEHICLE), kind=request.model)
    return PowerModel.load(Path(request.model))


_grounds: dict[tuple[str, str], DrivingGround] = {}


def _ground(terrain: Terrain, vehicle: Vehicle) -> DrivingGround:
    """The driving ground, kept for the last few maps and vehicles of this process."""
    shape = (vehicle.length, vehicle.width, vehicle.limits.clearance, vehicle.layout.radius)
    key = (terrain.fingerprint, repr((shape, vehicle.layout.table.tolist())))
    if key not in _grounds:
        if len(_grounds) >= 4:
            _grounds.pop(next(iter(_grounds)))
        _grounds[key] = driving_ground(terrain, vehicle)
    return _grounds[key]


def _plan(run: _Run) -> Answer:
    request = run.request
    run.step("costs of steady driving", 0.05)
    field = run.field(request.objective, MARGIN)
    names = ["start", *(f"via[{k}]" for k in range(len(request.via))), "goal"]
    for name, pose in zip(names, (request.start, *request.via, request.goal), strict=True):
        check_place(name, pose, run.ground, field, run.around)
    check_hold("start", request.start, field, run.around)
    blank = Answer(
        "no_route",
        run.ground.terrain,
        run.around.model.describe(),
        {"name": request.planner, "seed": request.seed},
        notes=_notes(run),
    )
    try:
        for name, pose in zip(names[1:], (*request.via, request.goal), strict=True):
            check_hold(name, pose, field, run.around)
    except RequestError as error:
        # Where it stands is for the user to say; where it can get to is for the answer.
        return replace(blank, reason=f"{error.field}: {error.problem}")
    best, planner, reason = _best_route(run, field)
    if best is None:
        return replace(blank, reason=reason, planner=planner)
    run.step("shortest and fastest route", 0.8)
    # Compiled code lets other threads run: both baselines at once on two cores.
    names = ["shortest", "fastest"]
    with ThreadPoolExecutor(max_workers=2) as pool:
        own = [route for route in pool.map(_baseline, [run, run], names) if route is not None]
    # Whatever was found may be the shortest or fastest, by whichever aim it was found.
    others = {
        name: min([best, *own], key=lambda route: _value(route, BASELINES[name])) for name in names
    }
    if request.objective == "energy":
        # A baseline that happens to cost less is itself the better answer.
        for other in others.values():
            if other.energy_j < best.energy_j:
                best = other
    routes: tuple[Route, ...] = (best,)
    notes = list(blank.notes)
    if request.alternatives > 1:
        run.step("alternatives", 0.9)
        routes, note = find_alternatives(
            best,
            request.alternatives,
            lambda factor: _grid_route(run, request.objective, factor),
            field,
            lambda route: _value(route, request.objective),
        )
        notes += [note] if note else []
    run.step("done", 1.0)
    return replace(
        blank,
        status="ok",
        routes=routes,
        baselines={
            name: Baseline(route, route.energy_j / best.energy_j - 1.0 if best.energy_j else 0.0)
            for name, route in others.items()
        },
        planner=planner,
        notes=tuple(notes),
    )


def _notes(run: _Run) -> tuple[str, ...]:
    notes = []
    defaults = run.around.model.vehicle.defaults_taken
    if defaults:
        notes.append(f"defaults taken for {', '.join(defaults)}")
    given = run.request.conditions.model_fields_set
    reads = {name for effect in run.around.model.effects for name in effect.reads}
    needed = {"wind": "wind_x", "motor_temp": "motor_temp", "ambient_temp": "ambient_temp"}
    needed |= {"sensor_rate": "sensor_rate", "battery_voltage": "battery_voltage"}
    for name, quantity in needed.items():
        if name in given and quantity not in reads:
            notes.append(f"conditions.{name} changes nothing: no active effect reads it")
    return tuple(notes)


@dataclass(frozen=True)
class _Attempt:
    """What the grid with refinement came to: a route, or paths that none drives, or neither."""

    field: CostField
    paths: list[Array] | None = None
    refined: list[tuple[Array, float]] | None = None
    route: Route | None = None
    reason: str = ""


def _on_grid(run: _Run, field: CostField, objective: str) -> _Attempt:
    """Search, refine and drive; where the motion does not come out, search more cautiously.

    A speed that breaks a limit on a bend asks for less steep ground, a body that cannot turn in
    time for ways with more room.
    """
    plain = field.factor
    tries, rooms = list(MARGINS), list(ROOMS) if run.ground.blocked.any() else [0.0]
    attempt = _Attempt(field)
    best: _Attempt | None = None
    while tries and rooms:
        factor = plain if rooms[0] == 0.0 else plain * run.ground.preferring_room(rooms[0])
        field = field._replace(margin=tries[0], factor=np.ascontiguousarray(factor))
        paths = _grid_paths(run, field)
        if paths is None:
            break
        refined = [refine(field, path, check=run.check) for path in paths]
        driven = _drive(run, field, [path for path, _ in refined], objective)
        if isinstance(driven, Route):
            if best is None or best.route is None or driven.energy_j < best.route.energy_j:
                best = _Attempt(field, paths, refined, driven)
            else:
                return best
            # Turning among obstacles may cost more than a way round with more room.
            if objective != "energy" or len(rooms) == 1 or not _much_turning(run, best, plain):
                return best
            rooms.pop(0)
            continue
        reason = f"a way was found, but at x {driven.x:.2f}, y {driven.y:.2f} {driven.what}"
        attempt = _Attempt(field, paths, refined, None, reason)
        if driven.for_want_of_room and len(rooms) > 1:
            rooms.pop(0)
        else:
            tries.pop(0)
    if best is not None:
        return best
    if paths is None:
        return replace(attempt, reason=attempt.reason or _why_not(run, field))
    return attempt


def _much_turning(run: _Run, attempt: _Attempt, factor: Array) -> bool:
    """Whether the motion dissipates much more than the search expected without turns and ramps."""
    route, field = attempt.route, attempt.field._replace(factor=factor)
    if route is None or attempt.refined is None:
        return False
    expected = sum(polyline_cost(field, path, field.step, True) for path, _ in attempt.refined)
    z = route.arrays["z"]
    climb = run.around.mass * STANDARD_GRAVITY * float(z[-1] - z[0])
    return route.energy_j - climb > MUCH * expected


def _best_route(run: _Run, field: CostField) -> tuple[Route | None, dict[str, Any], str]:
    """The main route, how it was found, and the reason if there is none."""
    objective = run.request.objective
    planner: dict[str, Any] = {"name": run.request.planner, "seed": run.request.seed}
    run.step("least-cost field", 0.1)
    attempt = _on_grid(run, field, objective)
    field = attempt.field
    if attempt.paths is None or attempt.refined is None:
        return None, planner, attempt.reason
    planner["slope_margin"] = field.margin
    planner["grid_cost"] = sum(cost for _, cost in attempt.refined)
    candidates = {} if attempt.route is None else {"grid": attempt.route}
    if run.request.planner != "grid":
        legs, said = _ompl_paths(run, field, attempt.paths, attempt.refined)
        planner |= said
        run.step("yaw, speed and energy", 0.7)
        driven = _drive(run, field, legs, objective)
        if isinstance(driven, Route):
            candidates["ompl"] = driven
    if not candidates:
        return None, planner, attempt.reason
    planner |= {f"{name}_energy_j": found.energy_j for name, found in candidates.items()}
    chosen = min(candidates, key=lambda name: _value(candidates[name], objective))
    planner["chosen"] = chosen
    return candidates[chosen], planner, ""


def _value(route: Route, objective: str) -> float:
    return {"energy": route.energy_j, "time": route.duration_s, "length": route.length_m}[objective]


def _why_not(run: _Run, field: CostField) -> str:
    for a, b in zip(run.places[:-1], run.places[1:], strict=True):
        if grid_path(field, cost_field_to(field, b, a), a, b) is None:
            return explain_no_route(run.ground, field, a, b)
    return "no way from start to goal"


def _grid_paths(run: _Run, field: CostField) -> list[Array] | None:
    """One polyline for each leg from the exhaustive grid, or None if a leg has no way."""
    run.check()
    legs = []
    for a, b in zip(run.places[:-1], run.places[1:], strict=True):
        path = grid_path(field, cost_field_to(field, b, a), a, b)
        if path is None:
            return None
        legs.append(path)
    return legs


def _ompl_paths(
    run: _Run, field: CostField, paths: list[Array], refined: list[tuple[Array, float]]
) -> tuple[list[Array], dict[str, Any]]:
    """OMPL's refined paths, one for each leg, and what there is to say about its search.

    Where OMPL finds nothing in its time, the grid's refined path stands in and is counted.
    """
    # OMPL is slow to import and leaves objects behind at exit: only where it is used.
    from planner.search.objective import Plane, Tube, WholeMap
    from planner.search.ompl_planner import solve

    request = run.request
    run.step("OMPL", 0.3)
    cheapest = cost_floor(field)
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


def _drive(run: _Run, field: CostField, legs: list[Array], objective: str) -> Route | Stuck:
    run.check()
    return drive(
        field,
        run.around,
        legs,
        run.yaws,
        objective=OBJECTIVES[objective],
        charge=run.request.conditions.battery_charge,
    )


def _grid_route(run: _Run, objective: str, factor: Array | None = None) -> Route | None:
    """The best route that the grid with refinement finds for an objective."""
    return _on_grid(run, run.field(objective, MARGIN, factor), objective).route


def _baseline(run: _Run, name: str) -> Route | None:
    """The shortest or fastest route, driven as well as it can be."""
    if BASELINES[name] == run.request.objective:
        return None
    return _grid_route(run, BASELINES[name])


@lru_cache(maxsize=1)
def warm_up() -> None:
    """Load everything a first request would load; for workers that wait for one."""
    import planner.search.ompl_planner  # noqa: F401

    PowerModel.from_vehicle(load_vehicle(DEFAULT_VEHICLE)).kernel  # noqa: B018
