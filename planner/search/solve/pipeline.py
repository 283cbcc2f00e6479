"""From paths to the cheapest trajectory near them: smooth, drive, check, keep the cheapest.

    attempt = cheapest_near(run, field, paths, "energy")
    attempt.route                   # or None, with attempt.infeasible

Every route of every question comes out of this pipeline. An ``Effort`` says how much work goes
into it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.arrays import Array
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, polyline_cost
from planner.search.limit_places import Infeasible
from planner.search.resolution import OBJECTIVES
from planner.search.results import Route, energy_of, price
from planner.search.run import Run
from planner.search.se2 import PosePath, keeping_yaw
from planner.search.trajectory import CLOSELY, ROUGHLY, Care, Motion, move
from planner.search.waypoints import VARIANTS, optimise_waypoints, refine, worth_optimising

PLAIN = {8.0: (1.0,)}
"""Cells between waypoints, and shares of the corner penalty, of a path for time or length: these
have no bends that cost more than they save."""
WITH_YAW = {2.0: (1.0,), 4.0: (1.0,)}
"""The same for a path with yaw angles, which is left close to itself."""
DESCENT_EXCESS = 0.01
"""Share of the energy that keeping to limits may cost before other candidates are tried."""
MOST_SAVED = 0.015
"""Share of what a trajectory dissipates that waypoint descent may save, where it is one of many."""

Legs = list[tuple[Array, float]]
"""A polyline (k, 2) from one fixed place to the next, and its cost, for each leg."""


class Effort(NamedTuple):
    """How much work goes into the trajectories near a path.

    Attributes:
        descent: whether waypoints are optimised, where that is likely to help.
        closely: whether the cheapest is driven again with more yaw angles and speeds. Without it,
            limits are checked on the rough trajectories, and the cheapest of these is answered.
    """

    descent: bool
    closely: bool


ANSWER = Effort(descent=True, closely=True)
ONE_OF_MANY = Effort(descent=False, closely=True)
BASELINE = Effort(descent=True, closely=False)


@dataclass(frozen=True)
class Candidate:
    """A route that may become the answer.

    Attributes:
        route: with its energy.
        source: what found it.
        legs: that it was driven along.
    """

    route: Route
    source: str
    legs: Legs


@dataclass(frozen=True)
class Attempt:
    """What a search came to: a route, or paths that cannot be driven, or neither.

    Attributes:
        field: map and costs that it was searched with.
        paths: one for each leg; None where a leg has none.
        legs: the paths smoothed; the cheapest of them.
        route: along the legs.
        reason: why there is no route.
        infeasible: where a limit is in the way.
    """

    field: CostField
    paths: list[Array] | None = None
    legs: Legs | None = None
    route: Route | None = None
    reason: str = ""
    infeasible: Infeasible | None = None

    def candidate(self, source: str) -> Candidate | None:
        """The route under the name of what found it."""
        if self.route is None or self.legs is None:
            return None
        return Candidate(self.route, source, self.legs)


class _Driven(NamedTuple):
    """Legs, the motion along them, its energy and what it dissipates, J."""

    legs: Legs
    motion: Motion | Infeasible
    energy: float = math.inf
    dissipated: float = math.inf


def cheapest_near(
    run: Run,
    field: CostField,
    paths: list[Array],
    objective: str,
    effort: Effort = ANSWER,
    *,
    poses: Sequence[PosePath] = (),
    below: float = math.inf,
) -> Attempt:
    """The cheapest feasible trajectory near some paths.

    Args:
        run: the request.
        field: map and costs.
        paths: polylines (k, 2), one for each leg.
        objective: "energy", "time" or "length".
        effort: how much work goes into it.
        poses: the same paths with the yaw angles that they are to be driven with.
        below: J; there is no route where even roughly it takes no less.
    """
    driven = _driven_roughly(run, field, paths, objective, effort, poses)
    moving = sorted(
        (one for one in driven if isinstance(one.motion, Motion)), key=lambda one: one.energy
    )
    failed = [one for one in driven if isinstance(one.motion, Infeasible)]
    best = moving[0] if moving else None
    if best is not None and best.energy - MOST_SAVED * best.dissipated >= below:
        return Attempt(field, paths)
    descended = None
    if best is not None and effort.descent and objective == "energy" and not poses:
        descended = _with_waypoints_optimised(run, field, best)
        best = descended or best
    if best is not None and best.energy >= below:
        return Attempt(field, paths)
    kept: list[tuple[Legs, Route]] = []
    for one in moving if descended is None else [descended, *moving]:
        closer = one.motion
        if effort.closely:
            closer = trajectory(run, field, one.legs, objective, CLOSELY)
        if isinstance(closer, Infeasible):
            failed = [_Driven(one.legs, closer)]
            continue
        route = priced(run, field, closer)
        kept.append((one.legs, route))
        # Where keeping to the limits costs little, the other candidates are not tried.
        most = moving[0].energy + (
            0.0 if one is descended else DESCENT_EXCESS * abs(moving[0].energy)
        )
        if objective != "energy" or route.energy_j <= most:
            break
    if kept:
        return Attempt(field, paths, *min(kept, key=lambda one: one[1].energy_j))
    where = failed[0].motion
    assert isinstance(where, Infeasible)  # whatever did not move is stuck
    legs = (moving or failed)[0].legs
    reason = f"a way was found, but at x {where.x:.2f}, y {where.y:.2f} {where.what}"
    return Attempt(field, paths, legs, None, reason, where)


def _driven_roughly(
    run: Run,
    field: CostField,
    paths: list[Array],
    objective: str,
    effort: Effort,
    poses: Sequence[PosePath],
) -> list[_Driven]:
    """The paths, each smoothed with several settings, with its trajectory."""
    penalty = run.situation.corner_penalty(objective)
    smoothings = VARIANTS if objective == "energy" else PLAIN
    near = field
    if poses:
        smoothings, near = WITH_YAW, keeping_yaw(field, poses)

    def smoothed(cells: float, shares: Iterable[float]) -> list[Legs]:
        penalties = [share * penalty for share in shares]
        legs = [
            refine(near, path, penalties=penalties, waypoint_cells=cells, check=run.check)
            for path in paths
        ]
        return [list(one) for one in zip(*legs, strict=True)]

    def driven(legs: Legs) -> _Driven:
        motion = trajectory(run, field, legs, objective, ROUGHLY, checked=not effort.closely)
        if isinstance(motion, Infeasible):
            return _Driven(legs, motion)
        energy = energy_of(field, run.conditions, motion)
        climb = (
            run.conditions.mass * STANDARD_GRAVITY * float(motion.heights[-1] - motion.heights[0])
        )
        return _Driven(legs, motion, energy, energy - climb)

    several = run.other_core.all([partial(smoothed, *kind) for kind in smoothings.items()])
    chains = itertools.chain.from_iterable(several)
    return run.other_core.all([partial(driven, legs) for legs in chains])


def _with_waypoints_optimised(run: Run, field: CostField, best: _Driven) -> _Driven | None:
    """The best trajectory with its waypoints moved, where that is likely to help and does."""
    if not worth_optimising(best.dissipated, sum(cost for _, cost in best.legs)):
        return None
    legs = [path for path, _ in best.legs]
    better = optimise_waypoints(
        field, run.conditions, legs, run.yaws, both=run.other_core.all, check=run.check
    )
    if better.motion is None or better.energy >= best.energy:
        return None
    return _Driven(with_costs(field, better.legs), better.motion, better.energy, better.dissipated)


def with_costs(field: CostField, paths: Iterable[Array]) -> Legs:
    """Polylines (k, 2), one for each leg, with their costs."""
    return [(path, float(polyline_cost(field, path, field.step))) for path in paths]


def trajectory(
    run: Run,
    field: CostField,
    legs: Legs,
    objective: str,
    care: Care = CLOSELY,
    checked: bool = True,
) -> Motion | Infeasible:
    """The motion along legs, or where it is infeasible; ``care`` and ``checked`` as in ``move``."""
    run.check()
    if objective == "length":
        # Whichever way it goes, a robot turns as costs it least.
        costs = run.situation.costs("energy")
        field = field._replace(
            by_yaw=costs.by_yaw, yaw_limit=costs.yaw_limit, crab_angle=costs.crab_angle
        )
    return move(
        field,
        run.conditions,
        [path for path, _ in legs],
        run.yaws,
        objective=OBJECTIVES[objective],
        care=care,
        checked=checked,
    )


def drive_legs(run: Run, field: CostField, legs: Legs, objective: str) -> Route | Infeasible:
    """The best trajectory along legs, and its energy."""
    motion = trajectory(run, field, legs, objective)
    return motion if isinstance(motion, Infeasible) else priced(run, field, motion)


def priced(run: Run, field: CostField, motion: Motion) -> Route:
    """The route of a motion, with its energy and account."""
    return price(field, run.conditions, motion, charge=run.request.conditions.battery_charge)


def waypoints_of(legs: Legs) -> Array:
    """(k, 2) m of all legs; a place where two of them meet stands once."""
    return np.vstack([legs[0][0][:1], *(path[1:] for path, _ in legs)])
