"""Routes by a search of poses, where ground near the slope limit refuses the path of least cost.

    attempt = straight_up(run, field, "energy", ANSWER, closely)     # or None

Near that limit only some yaw angles hold. Driven straight on the body climbs what it cannot climb
while it turns, and a bend takes the torque that is left. The search of paths knows neither, that of
poses knows both. Smoothing does not: stretches round places where a smoothed path breaks a limit
are left as they were found.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.resolution import MARGIN
from planner.search.run import Run
from planner.search.se2 import MOST_EXPANDED, PosePath, pose_path
from planner.search.solve.pipeline import Attempt, finished
from planner.search.solve.recovery import penalty_near
from planner.search.solve.sketch import (
    WITH_YAW,
    Closely,
    Driven,
    Effort,
    Sketch,
    driven_roughly,
    with_costs,
)
from planner.search.wanted_yaw import arriving, leaving
from planner.search.waypoints import refine

POSE_MARGINS = (MARGIN, MARGIN, 0.95, 0.95)
"""Shares of the slope limit to search poses with, until one of their paths can be driven. Places
where it cannot get a penalty from one search to the next."""
MOST_EXPANDED_STEEP = 120_000
"""States of a search on steep ground, a second: where it finds a path, it seldom needs more."""
MOST_DETOUR = 1.5
"""Times the least cost without yaw, as which a path of poses may cost: so much more is not found in
that many states."""
HELD_CELLS, WIDER_HELD = 4.0, 2.0
"""Cells round a place where a limit is broken within which the path is left as it is, and times as
many where that is not enough. Beyond that, the path of poses itself cannot be driven there."""
MOST_HELD = 12
"""Times that stretches are added at most, before other poses are searched."""


def straight_up(
    run: Run, field: CostField, objective: str, effort: Effort, closely: Closely
) -> Attempt | None:
    """The best route that paths of poses lead to; None without any.

    Args:
        run: the request.
        field: map and costs.
        objective: "energy", "time" or "length".
        effort: how much work goes into it.
        closely: drives legs, and knows those that come up again.
    """
    factor = field.factor
    for margin in POSE_MARGINS:
        field_of_poses = run.field(objective, margin, factor)
        poses = leg_poses(run, field_of_poses, objective, MOST_EXPANDED_STEEP, MOST_DETOUR)
        if poses is None:
            return None
        drive = partial(smoothed_where_it_moves, run, field, poses, objective, closely)
        driven = run.other_core.all([partial(drive, cells) for cells in WITH_YAW])
        driven.sort(key=lambda one: one.energy)
        found = Sketch(field, [one.polyline for one in poses], tuple(driven))
        if found.best is not None:
            attempt = finished(run, [found], objective, effort, closely)
            return None if attempt.route is None else attempt
        for one in driven:
            assert isinstance(one.motion, Infeasible)  # none of them moves
            factor = factor * penalty_near(field, one.motion)
    return None


def leg_poses(
    run: Run,
    field: CostField,
    objective: str,
    most_expanded: int = MOST_EXPANDED,
    beyond: float = math.inf,
) -> list[PosePath] | None:
    """The path of poses for every leg, or None if a leg has none; limits as for ``pose_path``."""
    poses: list[PosePath] = []
    yaws = list(run.yaws)
    for k, (a, b) in enumerate(itertools.pairwise(run.places)):
        ends = (a, leaving(yaws[k])), (b, arriving(yaws[k + 1]))
        path = pose_path(
            *(run.situation, field, objective, *ends),
            most_expanded=most_expanded,
            beyond=beyond,
            token=run.token,
        )
        if path is None:
            return None
        poses.append(path)
        yaws[k + 1] = float(path.yaws[-1]) if yaws[k + 1] is None else yaws[k + 1]
    return poses


def smoothed_where_it_moves(
    run: Run,
    field: CostField,
    poses: Sequence[PosePath],
    objective: str,
    closely: Closely,
    cells: float,
) -> Driven:
    """The legs along poses, smoothed as far as the robot keeps to its limits there.

    ``cells`` lie between the waypoints of what is smoothed.
    """
    paths = [one.polyline for one in poses]
    held = [np.zeros(len(path), np.bool_) for path in paths]
    penalty = run.situation.corner_penalty(objective)
    narrow = reach = HELD_CELLS * min(field.dx, field.dy)
    for _ in range(MOST_HELD):
        run.check()
        smoothed = [
            smoothed_but_for(run, field, path, kept, penalty, cells)
            for path, kept in zip(paths, held, strict=True)
        ]
        driven = driven_roughly(run, field, with_costs(field, smoothed), objective)
        refused = driven.motion
        if not isinstance(refused, Infeasible):
            close = closely.drive(run, driven.legs, Sketch(field, paths, (driven,)))
            if not isinstance(close, Infeasible):
                return driven
            refused = close
        before = sum(int(kept.sum()) for kept in held)
        for path, kept in zip(paths, held, strict=True):
            for place in refused.places:
                kept |= np.hypot(*(path - place).T) < reach
        if sum(int(kept.sum()) for kept in held) == before:
            if reach > narrow:
                break
            reach *= WIDER_HELD
    return Driven(driven.legs, refused)


def smoothed_but_for(
    run: Run, field: CostField, path: Array, held: NDArray[np.bool_], penalty: float, cells: float
) -> Array:
    """A polyline (k, 2): pieces between two ``held`` (k,) points as they are, the rest smoothed."""
    kept = held[1:] & held[:-1]
    cuts = [0, *(np.flatnonzero(kept[1:] != kept[:-1]) + 1), len(kept)]
    pieces = [path[:1]]
    for a, b in itertools.pairwise(cuts):
        piece = np.ascontiguousarray(path[a : b + 1])
        if not kept[a] and b - a > 1:
            [(piece, _)] = refine(
                field, piece, penalties=[penalty], waypoint_cells=cells, check=run.check
            )
        pieces.append(piece[1:])
    return np.ascontiguousarray(np.vstack(pieces))
