"""Routes by a search of poses, where ground near the slope limit refuses the path of least cost.

    attempt = straight_up(run, field, "energy", ANSWER, closely, FIRST)     # or None

Near that limit only some yaw angles hold. Driven straight on the body climbs what it cannot climb
while it turns, and a bend takes the torque that is left. The search of paths knows neither, that of
poses knows both. Smoothing does not: stretches round places where a smoothed path breaks a limit
are left as they were found. Where no smoothing helps, moves that hold all along are searched. The
poses at which one still breaks a limit are shut, and others are searched.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.resolution import MARGIN, YAW_BINS
from planner.search.run import Run
from planner.search.se2 import ANGLE, PoseLimits, PosePath, pose_path
from planner.search.solve.pipeline import Attempt, finished
from planner.search.solve.recovery.caution import penalty_near
from planner.search.solve.sketch import (
    WITH_YAW,
    Closely,
    Driven,
    Effort,
    Sketch,
    driven_roughly,
    with_costs,
)
from planner.search.trajectory import Motion
from planner.search.wanted_yaw import arriving, leaving
from planner.search.waypoints import refine


class PoseSearch(NamedTuple):
    """How poses are searched near the slope limit.

    Attributes:
        margin: share of the slope limit.
        limits: how far the search goes.
        smoothed: whether a path is smoothed that cannot be driven as it was found.
    """

    margin: float
    limits: PoseLimits
    smoothed: bool = True

    def goes_no_further(self, than: PoseSearch) -> bool:
        """Whether it finds no path where another one found none; poses may be shut since."""
        own, other = self.limits, than.limits
        alike = self.margin == than.margin and own.eager == other.eager
        return (
            alike
            and own.most_expanded <= other.most_expanded
            and own.beyond <= other.beyond
            and own.too_steep >= other.too_steep
        )


_SOON = PoseLimits(most_expanded=80_000, beyond=1.5, too_steep=1.0)
"""Where it finds a path, it seldom needs more. So many states hardly ever find one that costs more
than half as much again as without yaw. Smoothing may lead past what is too steep between nodes."""
_HOLDS = _SOON._replace(most_expanded=40_000, too_steep=math.inf)
"""Where it does not: moves that hold all along. What finds a path takes fewer states."""
_EAGER = _HOLDS._replace(eager=1.5, beyond=2.0)
"""Where that finds none: a path that need not be among the cheapest takes few states."""
_EAGER_LAST = _EAGER._replace(most_expanded=300_000, beyond=4.0)
"""Somewhat more, while a time budget lasts."""
SEARCHED_AGAIN = 12
"""Times at most that a path is searched past all poses at which those before break a limit. The
seventh still finds one for a weak robot (tests/search/solve/recovery/test_steep_ground.py)."""
FIRST = (
    PoseSearch(MARGIN, _SOON),
    PoseSearch(MARGIN, _HOLDS),
    *(SEARCHED_AGAIN * (PoseSearch(MARGIN, _EAGER, smoothed=False),)),
)
"""Searches one after the other, until one of their paths can be driven."""
FOR_A_BUDGET = 8 * tuple(
    PoseSearch(margin, _EAGER_LAST._replace(eager=eager))
    for margin in (MARGIN, 1.02)
    for eager in (1.05, 1.5)
)
"""After these, while a time budget lasts. The slope at a node may be a little above
what a path beside it climbs."""
SHUT_CELLS = 1.5
"""Cells round a place where a limit is broken within which a path's poses are shut."""
HELD_CELLS, WIDER_HELD = 4.0, 2.0
"""Cells round a place where a limit is broken within which the path is left as it is, and times as
many where that is not enough. Beyond that, the path of poses itself cannot be driven there."""
MOST_HELD = 6
"""Times that stretches are added at most, before other poses are searched."""


def straight_up(
    run: Run,
    field: CostField,
    objective: str,
    effort: Effort,
    closely: Closely,
    searches: Iterable[PoseSearch],
) -> Attempt | None:
    """The best route that paths of poses lead to; None without any.

    Args:
        run: the request.
        field: map and costs.
        objective: "energy", "time" or "length".
        effort: how much work goes into it.
        closely: drives legs, and knows those that come up again.
        searches: tried one after the other. Places that motors get too warm at cost more in the
            next one; poses near other places where a limit is broken are shut, unless moves need
            not hold all along: the next search knows better.
    """
    factor, mask = field.factor, field.mask
    in_vain: list[PoseSearch] = []
    for search in searches:
        if any(search.goes_no_further(than) for than in in_vain):
            continue
        costs = run.field(objective, search.margin, factor)
        poses = leg_poses(run, costs, objective, search.limits, mask)
        if poses is None:
            in_vain.append(search)
            continue
        paths = [one.polyline for one in poses]
        drive = partial(smoothed_where_it_moves, run, field, poses, objective, closely)
        driven = [_as_it_is(run, field, paths, objective, closely)]
        if search.smoothed or isinstance(driven[0].motion, Motion):
            driven += run.other_core.all([partial(drive, cells) for cells in WITH_YAW])
        driven.sort(key=lambda one: one.energy)
        found = Sketch(field, paths, tuple(driven))
        if found.best is not None:
            attempt = finished(run, [found], objective, effort, closely)
            if attempt.route is not None:
                return attempt
            assert attempt.infeasible is not None  # it has no route
            driven.append(Driven([], attempt.infeasible))
        for one in driven:
            if not isinstance(one.motion, Infeasible):
                continue
            if one.motion.too_warm:
                factor = factor * penalty_near(field, one.motion)
            elif search.limits.too_steep == math.inf:
                mask = without(mask, field, poses, one.motion)
    return None


def without(
    mask: NDArray[np.uint32], field: CostField, poses: Sequence[PosePath], refused: Infeasible
) -> NDArray[np.uint32]:
    """The free yaw angles (ny, nx) less those of paths near places where these break a limit."""
    mask = mask.copy()
    for place, path in itertools.product(refused.places, poses):
        cells = np.hypot(*((path.points - place) / (field.dx, field.dy)).T)
        near = np.flatnonzero(cells <= max(SHUT_CELLS, float(cells.min())))
        rows, columns = field.nodes_at(path.points[near])
        for j, i, yaw in zip(rows, columns, path.yaws[near], strict=True):
            for angle in range(-1, 2):
                mask[j, i] &= ~np.uint32(1 << (round(yaw / ANGLE) + angle) % YAW_BINS)
    return mask


def _as_it_is(
    run: Run, field: CostField, paths: Sequence[Array], objective: str, closely: Closely
) -> Driven:
    """The legs along paths that are not smoothed."""
    driven = driven_roughly(run, field, with_costs(field, paths), objective)
    if isinstance(driven.motion, Infeasible):
        return driven
    stopped = closely.stopped(run, driven.legs, Sketch(field, list(paths), (driven,)))
    return driven if stopped is None else Driven(driven.legs, stopped)


def leg_poses(
    run: Run,
    field: CostField,
    objective: str,
    limits: PoseLimits | None = None,
    free: NDArray[np.uint32] | None = None,
) -> list[PosePath] | None:
    """The path of poses for every leg, or None if a leg has none; ``free`` as for ``pose_path``."""
    poses: list[PosePath] = []
    yaws = list(run.yaws)
    for k, (a, b) in enumerate(itertools.pairwise(run.places)):
        ends = (a, leaving(yaws[k])), (b, arriving(yaws[k + 1]))
        path = pose_path(
            *(run.situation, field, objective, *ends), free=free, limits=limits, token=run.token
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
            stopped = closely.stopped(run, driven.legs, Sketch(field, paths, (driven,)))
            if stopped is None:
                return driven
            refused = stopped
            if refused.too_warm:
                break  # no smoothing cools them
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
