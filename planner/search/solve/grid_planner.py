"""A route by the grid alone: least-cost field, refinement, and the motion along it.

attempt = on_grid(run, run.field("energy"), "energy")
attempt.route            # or None, with attempt.reason
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Array
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, polyline_cost, segment_cost
from planner.search.resolution import MARGIN
from planner.search.results import Route
from planner.search.se2 import PosePath, pose_path
from planner.search.situation import explain_no_route
from planner.search.solve.alternatives import nearness
from planner.search.solve.drive_candidates import (
    Refined,
    driven_closely,
    driven_roughly,
    move_along,
    priced,
    with_knots_moved,
)
from planner.search.solve.run import Run
from planner.search.trajectory import CLOSELY, ROUGHLY, Stuck
from planner.search.wanted_yaw import arriving, leaving
from planner.search.waypoints import hindered

MARGINS = (MARGIN, 0.95, 0.9, 0.8)
"""Shares of the slope limit to search with, until the finished motion keeps to all limits."""
COMPARED = (MARGIN, 0.9)
"""The same for a route to compare with: few answers wait for one."""
ROOMS = (0.0, 0.4, 1.0, 2.0, 5.0, 16.0)
"""How much dearer ground gets where the body fits with hardly a yaw, until it can turn in time."""
SHUNNED = 4
"""Places where a limit was broken that are made dearer before all steep ground is."""
STRAIGHT = 0.005
"""Share by which a baseline may cost more than the floor of its length and still be straight."""
DETOURS, AWAY = 2, 0.1
"""Ways beside one whose bends cost much, and by how much ground near the best gets dearer."""
MOST_SAVED = 0.015
"""Share of what a motion dissipates that moving its knots may save, where it is one of many."""
MUCH = 1.1
"""Energy over that of even driving from which a way with more room is tried as well."""


@dataclass(frozen=True)
class Attempt:
    """What the grid with refinement came to: a route, or paths that none drives, or neither.

    Attributes:
        stuck: where there is no route, and why.
        nearly: whether a motion breaks limits between the stations only.
        kept: whether the route is none of these.
    """

    field: CostField
    paths: list[Array] | None = None
    refined: Refined | None = None
    route: Route | None = None
    reason: str = ""
    stuck: Stuck | None = None
    nearly: bool = False
    kept: bool = True


def on_grid(
    run: Run,
    field: CostField,
    objective: str,
    *,
    compared: bool = False,
    patient: bool = True,
) -> Attempt:
    """Search, refine and drive; where the motion does not come out, search more cautiously.

    A speed that breaks a limit on a bend asks for less steep ground. A body that cannot turn in
    time, or only at much cost, asks for a search with the yaw in it, and for ways with more room.

    Args:
        run, field: the request, and map and costs.
        objective: "energy", "time" or "length".
        compared: whether the route is to compare with only. It keeps to the same limits, but its
            yaw and speed may be a few parts in ten thousand off the best.
        patient: whether ways past a place that cannot be driven are looked for as long as for an
            answer.
    """
    if compared and (straight := _straight(run, field, objective)) is not None:
        return straight
    plain, posed = field.factor, False
    tries, rooms = list(MARGINS), list(ROOMS) if run.ground.blocked.any() else [0.0]
    shunned = 0
    if not patient:
        tries, shunned, posed = list(COMPARED), SHUNNED, len(rooms) == 1
    attempt = Attempt(field)
    best: Attempt | None = None
    nearly: Attempt | None = None
    while tries and rooms:
        factor = plain if rooms[0] == 0.0 else plain * run.ground.preferring_room(rooms[0])
        field = run.field(objective, tries[0], np.ascontiguousarray(factor))
        paths = _paths(run, field, objective)
        if paths is None:
            break
        attempt = latest = attempted(run, field, paths, objective, compared=compared)
        nearly = attempt if nearly is None and attempt.nearly else nearly
        if objective == "energy":
            latest = _elsewhere(run, latest)
        stuck = latest.stuck
        turned = objective == "energy" and len(rooms) > 1 and _much_turning(run, latest, plain)
        if not posed and (turned or (stuck is not None and stuck.for_want_of_room)):
            posed = True
            unshunned = run.field(objective, tries[0], plain)
            latest = _cheaper(latest, _by_poses(run, unshunned, objective, compared))
        if best is not None and _cheaper(best, latest) is best:
            return best
        if latest.route is not None:
            best = latest
            # Turning among obstacles may cost more than a way round with more room.
            if objective != "energy" or len(rooms) == 1 or not _much_turning(run, best, plain):
                return best
        if stuck is None or (stuck.for_want_of_room and len(rooms) > 1):
            rooms.pop(0)
        elif not stuck.for_want_of_room and shunned < SHUNNED:
            # Another way past this place may do; less steep ground everywhere costs more.
            plain, shunned = plain * _dearer_near(field, stuck), shunned + 1
        else:
            tries.pop(0)
    if best is not None:
        return best
    if nearly is not None and not compared:
        return _as_it_is(run, nearly, objective)
    if paths is None:
        return replace(attempt, reason=attempt.reason or _why_not(run, field, objective))
    return attempt


def _as_it_is(run: Run, attempt: Attempt, objective: str) -> Attempt:
    """A way that nearly keeps to the limits, driven as it is."""
    assert attempt.refined is not None  # something moved along it
    motion = move_along(run, attempt.field, attempt.refined, objective, CLOSELY, False)
    if isinstance(motion, Stuck):
        return attempt
    return replace(attempt, route=priced(run, attempt.field, motion), kept=False)


def near_path_of(run: Run, field: CostField, factor: Array, objective: str) -> Attempt:
    """What the path of other costs comes to, refined and driven with the field's own.

    ``factor`` is (ny, nx), on the costs of a metre for the search alone. Knots are left where
    refinement put them: this is one of many ways.
    """
    paths = _paths(run, run.field(objective, field.margin, factor), objective)
    if paths is None:
        return Attempt(field)
    return attempted(run, field, paths, objective, polished=False)


def _elsewhere(run: Run, attempt: Attempt) -> Attempt:
    """The cheapest of an attempt and of ways beside it, while its bends cost much.

    Not on large maps, where a search with costs of its own for every node takes long.
    """
    field = attempt.field
    factor = field.factor
    for _ in range(0 if run.situation.large else DETOURS):
        if attempt.route is None or not _hindered(run, attempt):
            break
        factor = factor * (1.0 + AWAY * nearness(attempt.route, field))
        paths = _paths(run, run.field("energy", field.margin, factor), "energy")
        if paths is not None:
            below = attempt.route.energy_j
            attempt = _cheaper(attempt, attempted(run, field, paths, "energy", below=below))
    return attempt


def _hindered(run: Run, attempt: Attempt) -> bool:
    """Whether bends cost much, and not for want of room: for that there are other searches."""
    if attempt.route is None or attempt.refined is None or run.ground.blocked.any():
        return False
    climb = run.around.mass * STANDARD_GRAVITY * attempt.route.rise_m
    metres = sum(cost for _, cost in attempt.refined)
    return hindered(run.around, attempt.route.energy_j - climb, metres)


def _straight(run: Run, field: CostField, objective: str) -> Attempt | None:
    """The straight line, where no way undercuts it by more than a few parts in 1000."""
    if field.factor.size > 1:
        return None
    cheapest = run.situation.lattice(objective, field).cheapest
    refined = []
    for a, b in itertools.pairwise(run.places):
        cost = float(segment_cost(field, *a, *b, field.step))
        if not cost <= (1.0 + STRAIGHT) * cheapest * math.dist(a, b):
            return None
        refined.append((np.array([a, b]), cost))
    # Another yaw is tried sooner than another way: a search takes longer.
    care = ROUGHLY._replace(turned=CLOSELY.turned)
    motion = move_along(run, field, refined, objective, care, True)
    if isinstance(motion, Stuck):
        return None
    paths = [path for path, _ in refined]
    return Attempt(field, paths, refined, priced(run, field, motion))


def attempted(
    run: Run,
    field: CostField,
    paths: list[Array],
    objective: str,
    ways: Sequence[PosePath] = (),
    *,
    polished: bool = True,
    compared: bool = False,
    below: float = math.inf,
) -> Attempt:
    """Refine and drive these paths; with ``ways`` near them, and with the yaw angles they have.

    With ``polished`` knots are moved for the least energy, where that is likely to help. There is
    no route where even roughly it takes no less than ``below``, J.
    """
    moved, stuck = driven_roughly(run, field, paths, objective, ways, compared)
    best = moved[0] if moved else None
    if best is not None and best.energy - MOST_SAVED * best.dissipated >= below:
        return Attempt(field, paths)
    better = None
    if best is not None and polished and objective == "energy" and not ways:
        better = with_knots_moved(run, field, best)
        best = better or best
    if best is not None and best.energy >= below:
        return Attempt(field, paths)
    refined, driven = driven_closely(run, field, better, moved, stuck, objective, compared)
    if isinstance(driven, Route):
        return Attempt(field, paths, refined, driven)
    reason = f"a way was found, but at x {driven.x:.2f}, y {driven.y:.2f} {driven.what}"
    return Attempt(field, paths, refined, None, reason, driven, nearly=bool(moved))


def _by_poses(run: Run, field: CostField, objective: str, compared: bool) -> Attempt:
    """What a search with the yaw in it comes to."""
    ways: list[PosePath] = []
    yaws = list(run.yaws)
    for k, (a, b) in enumerate(itertools.pairwise(run.places)):
        ends = (a, leaving(yaws[k])), (b, arriving(yaws[k + 1]))
        way = pose_path(run.situation, field, objective, *ends, token=run.token)
        if way is None:
            return Attempt(field)
        ways.append(way)
        yaws[k + 1] = float(way.yaws[-1]) if yaws[k + 1] is None else yaws[k + 1]
    polylines = [way.polyline for way in ways]
    return attempted(run, field, polylines, objective, ways, compared=compared)


def _cheaper(one: Attempt, other: Attempt) -> Attempt:
    """That with the route that needs less energy; the first one if they are alike."""
    if other.route is None or (one.route and one.route.energy_j <= other.route.energy_j):
        return one
    return other


def _dearer_near(field: CostField, place: Stuck) -> Array:
    """Factor (ny, nx) that makes a few cells round a place dearer."""
    ny, nx = field.heights.shape
    x, y = field.x0 + field.dx * np.arange(nx), field.y0 + field.dy * np.arange(ny)
    near = np.hypot((x - place.x)[None, :] / field.dx, (y - place.y)[:, None] / field.dy) < 3.0
    return np.where(near, 2.0, 1.0)


def _much_turning(run: Run, attempt: Attempt, factor: Array) -> bool:
    """Whether the motion dissipates much more than the search expected without turns and ramps."""
    route, field = attempt.route, attempt.field._replace(factor=factor)
    if route is None or attempt.refined is None:
        return False
    expected = sum(polyline_cost(field, path, field.step) for path, _ in attempt.refined)
    climb = run.around.mass * STANDARD_GRAVITY * route.rise_m
    return route.energy_j - climb > MUCH * expected


def _why_not(run: Run, field: CostField, objective: str) -> str:
    for a, b in zip(run.places[:-1], run.places[1:], strict=True):
        if run.situation.path(objective, field, a, b, run.token) is None:
            return explain_no_route(run.ground, field, a, b)
    return "no way from start to goal"


def _paths(run: Run, field: CostField, objective: str) -> list[Array] | None:
    """One polyline for each leg from the exhaustive grid, or None if a leg has no way."""
    run.check()
    legs = []
    for a, b in zip(run.places[:-1], run.places[1:], strict=True):
        path = run.situation.path(objective, field, a, b, run.token)
        if path is None:
            return None
        legs.append(path)
    return legs


def grid_route(run: Run, objective: str, factor: Array | None = None) -> Route | None:
    """The best route that the grid with refinement finds for an objective."""
    return on_grid(run, run.field(objective, MARGIN, factor), objective).route
