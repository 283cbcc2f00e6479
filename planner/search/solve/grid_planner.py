"""A route by the grid alone: least-cost paths, and the trajectory near them.

attempt = on_grid(run, run.field("energy"), "energy")
attempt.route            # or None, with attempt.reason
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from planner.arrays import Array
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, polyline_cost, segment_cost
from planner.search.limit_places import Infeasible
from planner.search.results import Route
from planner.search.run import Run
from planner.search.se2 import PosePath, pose_path
from planner.search.situation import explain_no_route
from planner.search.solve.alternatives import nearness
from planner.search.solve.pipeline import (
    ANSWER,
    BASELINE,
    ONE_OF_MANY,
    Attempt,
    Effort,
    cheapest_near,
    priced,
    trajectory,
)
from planner.search.solve.recovery import Caution, first_caution, next_caution
from planner.search.trajectory import CLOSELY, ROUGHLY
from planner.search.wanted_yaw import arriving, leaving
from planner.search.waypoints import suggests_detour

STRAIGHT = 0.005
"""Share by which a baseline may cost more than the bound of its length and still be straight."""
DETOURS, DETOUR_PENALTY = 2, 0.1
"""Searches for another homotopy class where bends cost much, and the share by which ground near
the best route costs more in each."""
MUCH_TURNING = 1.1
"""Energy over that of even driving from which paths with more room are tried as well."""


def on_grid(
    run: Run, field: CostField, objective: str, effort: Effort = ANSWER, *, patient: bool = True
) -> Attempt:
    """Search the grid; where no trajectory comes of it, search more cautiously.

    Args:
        run, field: the request, and map and costs.
        objective: "energy", "time" or "length".
        effort: BASELINE keeps to the same limits, but yaw and speed may be a few parts in ten
            thousand off the best.
        patient: whether recovery goes on for as long as for an answer.
    """
    attempt = _on_grid(run, field, objective, effort, patient)
    if attempt.route is not None or attempt.infeasible is None or not attempt.infeasible.too_warm:
        return attempt
    # What never exceeds the continuous torque keeps the limit of its mean.
    cooler = replace(run, situation=run.situation.with_continuous_torque())
    lasting = cooler.field(objective, field.margin, field.factor)
    found = _on_grid(cooler, lasting, objective, effort, patient)
    return attempt if found.route is None else found


def _on_grid(run: Run, field: CostField, objective: str, effort: Effort, patient: bool) -> Attempt:
    """The best of all attempts within the limits that hold at every moment, and the mean torque."""
    if effort is BASELINE and (straight := _straight(run, field, objective)) is not None:
        return straight
    caution: Caution | None = first_caution(run, field, patient)
    with_yaw = not patient and not run.ground.blocked.any()
    attempt = Attempt(field)
    best: Attempt | None = None
    while caution is not None:
        field = caution.field(run, objective)
        paths = _paths(run, field, objective)
        if paths is None:
            break
        attempt = latest = cheapest_near(run, field, paths, objective, effort)
        if objective == "energy":
            latest = _other_homotopy_classes(run, latest)
        among_obstacles = objective == "energy" and caution.obstructed
        turns_much = among_obstacles and _turns_much(run, latest, caution.factor)
        no_room = latest.infeasible is not None and latest.infeasible.for_want_of_room
        without_yaw = latest
        if not with_yaw and (turns_much or no_room):
            with_yaw = True
            posed = _by_poses(run, caution.unobstructed_field(run, objective), objective, effort)
            latest = _cheaper(latest, posed)
        if best is not None and _cheaper(best, latest) is best:
            return best
        if latest.route is not None:
            best = latest
            # Turning among obstacles may cost more than a way round with more room.
            if not among_obstacles or not _turns_much(run, best, caution.factor):
                return best
        caution = next_caution(caution, without_yaw)
    if best is not None:
        return best
    if paths is None:
        return replace(attempt, reason=attempt.reason or _why_not(run, field, objective))
    return attempt


def near_path_of(run: Run, field: CostField, factor: Array, objective: str) -> Attempt:
    """What the path of other costs comes to with the field's own.

    ``factor`` is (ny, nx), on the costs of a metre for the search alone.
    """
    paths = _paths(run, run.field(objective, field.margin, factor), objective)
    if paths is None:
        return Attempt(field)
    return cheapest_near(run, field, paths, objective, ONE_OF_MANY)


def _other_homotopy_classes(run: Run, attempt: Attempt) -> Attempt:
    """The cheapest of an attempt and of paths beside it, while its bends cost much.

    Not on large maps, where a search with costs of its own for every node takes long.
    """
    field = attempt.field
    factor = field.factor
    for _ in range(0 if run.situation.large else DETOURS):
        if attempt.route is None or not _bends_cost_much(run, attempt):
            break
        factor = factor * (1.0 + DETOUR_PENALTY * nearness(attempt.route, field))
        paths = _paths(run, run.field("energy", field.margin, factor), "energy")
        if paths is not None:
            below = attempt.route.energy_j
            attempt = _cheaper(attempt, cheapest_near(run, field, paths, "energy", below=below))
    return attempt


def _bends_cost_much(run: Run, attempt: Attempt) -> bool:
    """Whether bends cost much, and not for want of room: for that there are other searches."""
    if attempt.route is None or attempt.legs is None or run.ground.blocked.any():
        return False
    metres = sum(cost for _, cost in attempt.legs)
    return suggests_detour(run.conditions, dissipated(run, attempt.route), metres)


def dissipated(run: Run, route: Route) -> float:
    """J that a route takes without what climbing stores."""
    return route.energy_j - run.conditions.mass * STANDARD_GRAVITY * route.rise_m


def _straight(run: Run, field: CostField, objective: str) -> Attempt | None:
    """The straight line, where no path undercuts it by more than a few parts in 1000."""
    if field.factor.size > 1:
        return None
    cheapest = run.situation.lattice(objective, field).cheapest
    legs = []
    for a, b in itertools.pairwise(run.places):
        cost = float(segment_cost(field, *a, *b, field.step))
        if not cost <= (1.0 + STRAIGHT) * cheapest * math.dist(a, b):
            return None
        legs.append((np.array([a, b]), cost))
    # Another yaw is tried sooner than another path: a search takes longer.
    motion = trajectory(run, field, legs, objective, ROUGHLY._replace(turned=CLOSELY.turned))
    if isinstance(motion, Infeasible):
        return None
    return Attempt(field, [path for path, _ in legs], legs, priced(run, field, motion))


def _by_poses(run: Run, field: CostField, objective: str, effort: Effort) -> Attempt:
    """What a search with the yaw in it comes to."""
    poses: list[PosePath] = []
    yaws = list(run.yaws)
    for k, (a, b) in enumerate(itertools.pairwise(run.places)):
        ends = (a, leaving(yaws[k])), (b, arriving(yaws[k + 1]))
        path = pose_path(run.situation, field, objective, *ends, token=run.token)
        if path is None:
            return Attempt(field)
        poses.append(path)
        yaws[k + 1] = float(path.yaws[-1]) if yaws[k + 1] is None else yaws[k + 1]
    polylines = [path.polyline for path in poses]
    return cheapest_near(run, field, polylines, objective, effort, poses=poses)


def _cheaper(one: Attempt, other: Attempt) -> Attempt:
    """That with the route that needs less energy; the first one if they are alike."""
    if other.route is None or (one.route and one.route.energy_j <= other.route.energy_j):
        return one
    return other


def _turns_much(run: Run, attempt: Attempt, factor: Array) -> bool:
    """Whether the motion dissipates much more than the search expected without turns and ramps."""
    if attempt.route is None or attempt.legs is None:
        return False
    field = attempt.field._replace(factor=factor)
    expected = sum(polyline_cost(field, path, field.step) for path, _ in attempt.legs)
    return dissipated(run, attempt.route) > MUCH_TURNING * expected


def _why_not(run: Run, field: CostField, objective: str) -> str:
    for a, b in itertools.pairwise(run.places):
        if run.situation.path(objective, field, a, b, run.token) is None:
            return explain_no_route(run.ground, field, a, b)
    return "no way from start to goal"


def _paths(run: Run, field: CostField, objective: str) -> list[Array] | None:
    """One polyline for each leg from the exhaustive grid, or None if a leg has no path."""
    run.check()
    legs = []
    for a, b in itertools.pairwise(run.places):
        path = run.situation.path(objective, field, a, b, run.token)
        if path is None:
            return None
        legs.append(path)
    return legs
