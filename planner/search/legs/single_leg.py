"""The energy of one leg, quickly: a smoothed grid path and its motion, without alternatives.

    leg = LegPlanner(situation, field, token).near(path, yaws)
    leg.route.energy_j

For questions that need the energy of many routes: planner.search.matrix and planner.search.reach.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.field import CostField, polyline_cost
from planner.search.requests import PlanRequest, PoseRequest
from planner.search.resolution import MARGIN
from planner.search.results import Route, drive
from planner.search.run import Run
from planner.search.situation import Situation
from planner.search.solve import ONE_OF_MANY, on_grid
from planner.search.waypoints import (
    VARIANTS,
    Driven,
    drive_roughly,
    optimise_waypoints,
    refine,
    worth_optimising,
)

Yaws = tuple[float | None, float | None]
MOST_DESCENT_SAVING = 0.004
"""Share of a rough motion's dissipated energy that waypoint descent saves at most, by experience.
"""


@dataclass(frozen=True)
class Leg:
    """A route from one place to another, and the polyline (k, 2) that it follows, if there is one.

    Attributes:
        route: with its energy.
        path: None where it came from a search with more care.
        rough_j: J of the rough motion along the path; comparable with other rough motions only.
    """

    route: Route
    path: Array | None = None
    rough_j: float = math.inf

    def dissipated(self, weight: float) -> float:
        """J, without what climbing stores; ``weight`` in N."""
        heights = self.route.arrays["z"]
        return self.route.energy_j - weight * float(heights[-1] - heights[0])


@dataclass(frozen=True)
class LegPlanner:
    """Finds legs on one map.

    Attributes:
        situation: map and model.
        field: of the situation, for energy.
        token: the caller's wish to stop, which raises Cancelled.
        many: whether a leg is one of so many that waypoint descent is not worth its time among
            obstacles: it saves little there, and takes nearly half of the time.
    """

    situation: Situation
    field: CostField
    token: CancellationToken
    many: bool = False

    def near(self, path: Array, yaws: Yaws = (None, None)) -> Leg | None:
        """The best motion near a path; None where there is none even with more caution.

        Args:
            path: (k, 2) from the grid.
            yaws: at both ends, None where it is free.
        """
        corner_penalty = self.situation.corner_penalty("energy")
        variants = {} if self.situation.ground.blocked.any() else VARIANTS
        paths = (
            refined
            for cells, shares in variants.items()
            for refined, _ in refine(
                self.field,
                path,
                penalties=[share * corner_penalty for share in shares],
                waypoint_cells=cells,
            )
        )
        leg = self._best_of(paths, yaws)
        if leg is not None:
            return leg
        # Among obstacles, or where a limit was broken: with more care.
        start, goal = (
            PoseRequest(x=float(x), y=float(y), yaw=yaw)
            for (x, y), yaw in zip((path[0], path[-1]), yaws, strict=True)
        )
        request = PlanRequest(map=self.situation.ground.terrain.name, start=start, goal=goal)
        run = Run(request, self.situation, silent, self.token)
        field, route = run.field("energy", MARGIN), None
        if self.many:
            route = on_grid(run, field, "energy", ONE_OF_MANY).route
        if route is None:
            route = on_grid(run, field, "energy").route
        return None if route is None else Leg(route)

    def like_neighbour(self, leg: Leg, path: Array, yaws: Yaws = (None, None)) -> Leg:
        """A leg, or one along the path of a neighbouring place, whichever takes less.

        Args:
            leg: as it is.
            path: (k, 2), with its first or its last point elsewhere.
            yaws: as for ``near``.
        """
        places = leg.route.arrays["x"][[0, -1]], leg.route.arrays["y"][[0, -1]]
        bent = path.copy()
        bent[[0, -1]] = np.column_stack(places)
        paths = [bent]
        if len(path) > 2:
            # The last bend may have been for the neighbour alone.
            at_start = math.dist(bent[0], path[0]) > math.dist(bent[-1], path[-1])
            paths.append(np.delete(bent, 1 if at_start else len(path) - 2, axis=0))
        return self._best_of(paths, yaws, leg) or leg

    def _best_of(self, paths: Iterable[Array], yaws: Yaws, other: Leg | None = None) -> Leg | None:
        """The cheapest of these paths, optimised if worth it; None if another leg takes less.

        Rough motions are compared with rough ones: the finished ones take about 1 % less.
        """
        field, conditions = self.field, self.situation.conditions
        best = Driven(())
        for path in paths:
            self.token.check()
            if math.isfinite(polyline_cost(field, path, field.step)):
                found = drive_roughly(field, conditions, (path,), yaws)
                best = min(best, found, key=lambda one: one.energy)
        rough = math.inf if other is None else other.rough_j
        if best.motion is None or best.energy - MOST_DESCENT_SAVING * best.dissipated >= rough:
            return None
        if worth_optimising(best.dissipated, polyline_cost(field, best.legs[0], field.step)):
            better = optimise_waypoints(field, conditions, best.legs, yaws, check=self.token.check)
            best = min(best, better, key=lambda one: one.energy)
        if best.energy >= rough:
            return None
        route = drive(field, conditions, best.legs, yaws)
        if not isinstance(route, Route) or (other and route.energy_j >= other.route.energy_j):
            return None
        return Leg(route, best.legs[0], best.energy)
