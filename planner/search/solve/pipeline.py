"""From paths to the cheapest trajectory near them: smooth, drive, check, keep the cheapest.

    attempt = cheapest_near(run, field, paths, "energy")
    attempt.route                   # or None, with attempt.infeasible

Every route of every question comes out of this pipeline. An ``Effort`` says how much work goes
into it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
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
from planner.search.situation import remedy
from planner.search.trajectory import CLOSELY, ROUGHLY, Motion, move
from planner.search.waypoints import VARIANTS, optimise_waypoints, refine, worth_optimising

PLAIN = {8.0: (1.0,)}
"""Cells between waypoints, and shares of the corner penalty, of a path for time or length: these
have no bends that cost more than they save."""
WITH_YAW = {2.0: (1.0,), 4.0: (1.0,)}
"""The same for a path with yaw angles, which is left close to itself."""
NEARLY = 0.01
"""Share by which a rough motion may take more than the best closely driven one, and its path still
be driven closely: rough motions scatter by about that much. A route disappoints beyond it."""
DESCENDED, MOST_SAVED = 3, 0.025
"""Sketches whose waypoints are moved at most, and the share of what a trajectory dissipates that
this may save: a sketch that takes more than that in addition is left alone."""

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
        infeasible: where a limit is in the way; with a route, on a path that seemed cheaper.
        promised: J of the rough motion along that path; infinite without one.
    """

    field: CostField
    paths: list[Array] | None = None
    legs: Legs | None = None
    route: Route | None = None
    reason: str = ""
    infeasible: Infeasible | None = None
    promised: float = math.inf

    @property
    def disappoints(self) -> bool:
        """Whether another path seemed clearly cheaper than the route, and breaks a limit."""
        least = math.inf if self.route is None else self.route.energy_j
        return least > self.promised + NEARLY * abs(self.promised)

    def candidate(self, source: str) -> Candidate | None:
        """The route under the name of what found it."""
        if self.route is None or self.legs is None:
            return None
        return Candidate(self.route, source, self.legs)


class Driven(NamedTuple):
    """Legs, the motion along them, its energy and what it dissipates, J."""

    legs: Legs
    motion: Motion | Infeasible
    energy: float = math.inf
    dissipated: float = math.inf


@dataclass(frozen=True)
class Sketch:
    """Paths smoothed with several settings, each driven roughly.

    Attributes:
        field: map and costs to drive with.
        paths: one for each leg.
        driven: those that move, cheapest first, and then the others.
    """

    field: CostField
    paths: list[Array]
    driven: tuple[Driven, ...]

    @property
    def best(self) -> Driven | None:
        """The cheapest one that moves."""
        return self.driven[0] if isinstance(self.driven[0].motion, Motion) else None

    @property
    def energy(self) -> float:
        """J of the cheapest one; infinite where none moves."""
        return self.driven[0].energy

    @property
    def infeasible(self) -> Infeasible | None:
        """Why none of them moves."""
        first = self.driven[0].motion
        return first if isinstance(first, Infeasible) else None


def sketch(
    run: Run,
    field: CostField,
    paths: list[Array],
    objective: str,
    effort: Effort = ANSWER,
    *,
    plain: CostField | None = None,
    poses: Sequence[PosePath] = (),
) -> Sketch:
    """Smooth some paths and drive them roughly.

    Args:
        run: the request.
        field: map and costs to smooth with.
        paths: polylines (k, 2), one for each leg.
        objective: "energy", "time" or "length".
        effort: where nothing is driven closely later, limits are checked here.
        plain: map and costs to drive with, where those to smooth with have penalties.
        poses: the same paths with the yaw angles that they are to be driven with.
    """
    driven = _driven_roughly(run, field, paths, objective, effort, poses)
    return Sketch(plain or field, paths, tuple(sorted(driven, key=lambda one: one.energy)))


@dataclass
class Closely:
    """Legs driven with all care for an objective, each only once."""

    objective: str
    known: dict[tuple[bytes, ...], Motion | Infeasible] = field(default_factory=dict)

    def drive(self, run: Run, legs: Legs, of: Sketch) -> Motion | Infeasible:
        """The motion along legs of a sketch."""
        key = _content(legs)
        if key not in self.known:
            self.known[key] = trajectory(run, of.field, legs, self.objective)
        return self.known[key]

    @property
    def refused(self) -> bool:
        """Whether something driven before was infeasible."""
        return any(isinstance(one, Infeasible) for one in self.known.values())


def finished(
    run: Run,
    sketches: Sequence[Sketch],
    objective: str,
    effort: Effort = ANSWER,
    closely: Closely | None = None,
) -> Attempt:
    """The cheapest feasible trajectory among sketches: only the best of all are driven closely.

    Args:
        run: the request.
        sketches: at least one.
        objective: "energy", "time" or "length".
        effort: how much work goes into it.
        closely: knows what was driven before, for the same objective.
    """
    closely = closely or Closely(objective)
    order = sorted(
        ((one, whole) for whole in sketches for one in whole.driven),
        key=lambda pair: pair[0].energy,
    )
    moving = [pair for pair in order if isinstance(pair[0].motion, Motion)]
    failed, failed_of = (None, moving[0][1]) if moving else order[0]
    kept: list[tuple[Legs, Route, Sketch]] = []
    descends = effort.descent and objective == "energy"
    descended = _descended(run, moving, closely) if descends else []
    least = promised = math.inf
    with run.within_budget() as limited:
        for one, of in sorted([*descended, *moving], key=lambda pair: pair[0].energy):
            if kept and (objective != "energy" or one.energy >= least + NEARLY * abs(least)):
                break
            closer = one.motion
            if effort.closely:
                closer = closely.drive(limited if kept else run, one.legs, of)
            if isinstance(closer, Infeasible):
                if failed is None:
                    failed, failed_of, promised = Driven(one.legs, closer), of, one.energy
                continue
            route = priced(run, of.field, closer)
            kept.append((one.legs, route, of))
            least = min(least, route.energy_j)
    if kept:
        legs, route, of = min(kept, key=lambda one: one[1].energy_j)
        if failed is None:
            return Attempt(of.field, of.paths, legs, route)
        assert isinstance(failed.motion, Infeasible)
        return Attempt(of.field, of.paths, legs, route, "", failed.motion, promised)
    assert failed is not None  # whatever did not move is stuck
    where = failed.motion
    assert isinstance(where, Infeasible)
    legs = (moving[0][0] if moving else failed).legs
    reason = f"a way was found, but at x {where.x:.2f}, y {where.y:.2f} {where.what}"
    reason += remedy(run.conditions, where)
    return Attempt(failed_of.field, failed_of.paths, legs, None, reason, where)


def cheapest_near(
    run: Run, field: CostField, paths: list[Array], objective: str, effort: Effort = ANSWER
) -> Attempt:
    """The cheapest feasible trajectory near some paths; arguments as for ``sketch``."""
    return finished(run, [sketch(run, field, paths, objective, effort)], objective, effort)


def _driven_roughly(
    run: Run,
    field: CostField,
    paths: list[Array],
    objective: str,
    effort: Effort,
    poses: Sequence[PosePath],
) -> list[Driven]:
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

    def driven(legs: Legs) -> Driven:
        motion = trajectory(
            *(run, field, legs, objective), closely=False, checked=not effort.closely
        )
        if isinstance(motion, Infeasible):
            return Driven(legs, motion)
        energy = energy_of(field, run.conditions, motion)
        climb = (
            run.conditions.mass * STANDARD_GRAVITY * float(motion.heights[-1] - motion.heights[0])
        )
        return Driven(legs, motion, energy, energy - climb)

    several = run.other_core.all([partial(smoothed, *kind) for kind in smoothings.items()])
    # Several settings may smooth a path alike.
    chains = {_content(legs): legs for legs in itertools.chain.from_iterable(several)}
    return run.other_core.all([partial(driven, legs) for legs in chains.values()])


def _content(legs: Legs) -> tuple[bytes, ...]:
    """What identifies legs."""
    return tuple(path.tobytes() for path, _ in legs)


def _descended(
    run: Run, moving: Sequence[tuple[Driven, Sketch]], closely: Closely
) -> list[tuple[Driven, Sketch]]:
    """The best trajectories with their waypoints moved, where that is likely to help and does.

    Moved waypoints seldom pass a place where a limit is broken. So once a trajectory was refused,
    only such are taken that are feasible as they are.

    Args:
        run: the request.
        moving: trajectories by energy, each with its sketch; of a sketch, the best one is taken.
        closely: drives them.
    """
    found: list[tuple[Driven, Sketch]] = []
    wary = closely.refused
    with run.within_budget() as limited:
        for one, of in _worth_descent(moving, found):
            limited.check()
            if wary and isinstance(closely.drive(limited, one.legs, of), Infeasible):
                continue
            legs = [path for path, _ in one.legs]
            better = optimise_waypoints(
                *(of.field, run.conditions, legs, run.yaws),
                both=run.other_core.all,
                check=limited.check,
            )
            if better.motion is not None and better.energy < one.energy:
                moved = with_costs(of.field, better.legs)
                driven = Driven(moved, better.motion, better.energy, better.dissipated)
                found.append((driven, of))
    return sorted(found, key=lambda pair: pair[0].energy)


def _worth_descent(
    moving: Sequence[tuple[Driven, Sketch]], found: Sequence[tuple[Driven, Sketch]]
) -> Iterator[tuple[Driven, Sketch]]:
    """The best trajectory of each sketch that may come below those ``found`` so far."""
    tried: list[Sketch] = []
    for one, of in moving:
        least = min((better.energy for better, _ in found), default=moving[0][0].energy)
        if len(tried) == DESCENDED or one.energy - MOST_SAVED * one.dissipated >= least:
            return
        if any(of is other for other in tried):
            continue
        tried.append(of)
        # The legs' own costs may hold penalties for clearance.
        metres = sum(polyline_cost(of.field, path, of.field.step) for path, _ in one.legs)
        if worth_optimising(one.dissipated, metres):
            yield one, of


def with_costs(field: CostField, paths: Iterable[Array]) -> Legs:
    """Polylines (k, 2), one for each leg, with their costs."""
    return [(path, float(polyline_cost(field, path, field.step))) for path in paths]


def trajectory(
    run: Run,
    field: CostField,
    legs: Legs,
    objective: str,
    *,
    closely: bool = True,
    checked: bool = True,
) -> Motion | Infeasible:
    """The motion along legs, or where it is infeasible; ``checked`` as in ``move``."""
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
        care=CLOSELY if closely else ROUGHLY,
        checked=checked,
        check=run.check,
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
