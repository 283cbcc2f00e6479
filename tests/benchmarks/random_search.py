"""A search by chance, to judge the planner's answers by: it shares little with how they are found.

    search = RandomSearch(case_of("cone", asked), seed=1)
    search.begin(route, path, "at once")
    search.run(seconds=60.0)
    search.best.route, search.best.source

Three methods share the time. "places": paths through random places, start to place to goal, driven
as one motion that does not stop there. "moves": waypoints of the best routes moved, inserted and
left out at random. "bit*" and other planners of OMPL's: their paths. Whatever they come to is
driven, and only a route that holds all limits counts.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.field import polyline_cost
from planner.search.ompl import answer
from planner.search.requests import PlanRequest
from planner.search.resolution import MARGIN
from planner.search.results import Route, energy_of
from planner.search.run import Run
from planner.search.solve.pipeline import cheapest_near
from planner.search.trajectory import moved_alike
from tests.benchmarks.peers.best_known import KNOTS, TOLLS, distinct
from tests.benchmarks.peers.case import Array, Case

SHARES = {"places": 0.3, "moves": 0.55, "others": 0.15}
"""Of the time, by method."""
OTHERS = ("bit*", "rrt*", "informed-rrt*")
POOL = 5
"""Routes at most whose waypoints are moved."""
PROMISING = 0.03
"""Share over the best route by which a route may take more and still be kept: moves may save it."""
TOO_LONG = 1.12
"""J of a path's metres over what the best route dissipates, from which it is not driven at all."""
SMALLEST, LARGEST = 0.02, 4.0
"""Cells, standard deviation of a waypoint's move: any size between is as likely."""
SEEN_FIRST = 0.3
"""Share of moves that are driven only where they save energy with yaw and speeds as they were. The
others are driven whatever they seem to do: where a limit holds the speed down, most savings come
from moves that seem to cost more, as another speed and yaw are possible after them."""
MOST_SEEN = 60
"""Moves looked at until one of them is driven."""
ROUNDING = 1e-6


@dataclass(frozen=True)
class Known:
    """A feasible route, the path it was driven along, and what found it."""

    route: Route
    path: Array
    source: str


@dataclass(frozen=True)
class Move:
    """Waypoints before and after a move, point by point; ``left_out`` is none of the path then."""

    before: Array
    after: Array
    left_out: int | None = None

    @property
    def path(self) -> Array:
        """The path afterwards."""
        return self.after if self.left_out is None else np.delete(self.after, self.left_out, 0)


def cpu_seconds() -> float:
    """s of this process, all its threads, and the processes that it waited for."""
    return sum(os.times()[:4])


def run_of(case: Case, **further: object) -> Run:
    """The question as a request of the planner's; its time budget begins now."""
    asked = {"map": case.map, **case.asked, **further}
    return Run(PlanRequest.from_json(asked), case.situation, silent, CancellationToken())


def holds_limits(route: Route) -> bool:
    """Whether no limit is used by more than the whole of it."""
    return all(use.share <= 1.0 + ROUNDING for use in route.limits)


class RandomSearch:
    """A search by chance for one question.

    Attributes:
        pool: the best routes that differ, cheapest first.
        driven: how often each method drove a path.
    """

    def __init__(self, case: Case, seed: int) -> None:
        self.case = case
        self.random = np.random.default_rng(seed)
        self.pool: list[Known] = []
        self.driven = dict.fromkeys(SHARES, 0)
        self._seeds = itertools.count(seed)
        self._next_other = itertools.cycle(OTHERS)

    @property
    def best(self) -> Known:
        """The cheapest route so far."""
        return self.pool[0]

    def run(self, seconds: float) -> None:
        """Search for so many CPU s; the method that is furthest behind its share comes next."""
        spent = dict.fromkeys(SHARES, 0.0)
        for_others = min(10.0, 0.05 * seconds)
        steps: dict[str, Callable[[], None]] = {
            "places": self.through_places,
            "moves": self.move,
            "others": lambda: self.other_planner(for_others),
        }
        while sum(spent.values()) < seconds:
            name = min(spent, key=lambda one: spent[one] / SHARES[one])
            begun = cpu_seconds()
            steps[name]()
            spent[name] += max(cpu_seconds() - begun, 1e-3)

    def begin(self, route: Route, path: Array, source: str) -> Known:
        """Begin with a feasible route as well."""
        known = Known(route, path, source)
        self._keep(known, self.pool)
        return known

    def offer(self, path: Array, source: str, instead: Known | None = None) -> bool:
        """Drive a path, and keep its route where it is feasible and promises something.

        Args:
            path: polyline (k, 2).
            source: what found it.
            instead: route that it has to be cheaper than, and replaces.
        """
        route = self.case.drive(path)
        if route is None:
            return False
        most = math.inf
        if instead is not None:
            most = instead.route.energy_j
        elif self.pool:
            most = self.best.route.energy_j + PROMISING * abs(self.best.route.energy_j)
        if route.energy_j >= most or not holds_limits(route):
            return False
        others = [one for one in self.pool if one is not instead]
        self._keep(Known(route, path, source), others)
        return True

    def _keep(self, known: Known, others: Sequence[Known]) -> None:
        """The pool is what differs of others and one more, the cheapest ones of it."""
        pool = sorted([*others, known], key=lambda one: one.route.energy_j)
        kept = distinct(self.case, [one.path for one in pool], POOL)
        self.pool = [one for one in pool if any(one.path is path for path in kept)]

    def move(self) -> None:
        """Move waypoints of one of the routes at random, and keep them there if it is cheaper."""
        rank = min(int(self.random.geometric(0.6)), len(self.pool)) - 1
        known = self.pool[rank]
        move = self._drawn(known)
        if self.random.random() < SEEN_FIRST:
            for _ in range(MOST_SEEN):
                if self._seems_to_save(known, move):
                    break
                move = self._drawn(known)
        self.driven["moves"] += 1
        source = known.source.removesuffix(" + moves")
        self.offer(move.path, f"{source} + moves", instead=known)

    def _drawn(self, known: Known) -> Move:
        """A move of one waypoint, of neighbours, of a new one, or one that leaves one out."""
        random, path = self.random, known.path
        cell = min(self.case.field.dx, self.case.field.dy)
        size = cell * math.exp(random.uniform(math.log(SMALLEST), math.log(LARGEST)))
        kind = random.random()
        if len(path) < 3 or kind < 0.2:
            lengths = np.hypot(*np.diff(path, axis=0).T)
            k = int(random.choice(len(lengths), p=lengths / lengths.sum()))
            new = path[k] + random.uniform(0.1, 0.9) * (path[k + 1] - path[k])
            before = np.insert(path, k + 1, new, axis=0)
            after = before.copy()
            after[k + 1] += size * random.standard_normal(2)
            return Move(before, after)
        k = int(random.integers(1, len(path) - 1))
        after = path.copy()
        if kind < 0.3:
            along = path[k + 1] - path[k - 1]
            share = (path[k] - path[k - 1]) @ along / max(along @ along, 1e-12)
            after[k] = path[k - 1] + min(max(share, 0.05), 0.95) * along
            return Move(path, after, k)
        if kind < 0.65:
            after[k] += size * random.standard_normal(2)
            return Move(path, after)
        reach = random.uniform(0.5, 4.0)
        weights = np.exp(-(((np.arange(len(path)) - k) / reach) ** 2))
        weights[[0, -1]] = 0.0
        after += size * weights[:, None] * random.standard_normal(2)
        return Move(path, after)

    def _seems_to_save(self, known: Known, move: Move) -> bool:
        """Whether a motion takes less along moved waypoints with yaw and speeds as they were."""
        # The field may call a path closed, by node and bins of yaw, that the body just passes.
        field, conditions = self.case.field, self.case.situation.conditions
        motion = known.route.motion
        assert motion is not None
        here, there = (
            energy_of(
                field,
                conditions,
                moved_alike(field, conditions, motion, [move.before], [path]),
            )
            for path in (move.before, move.after)
        )
        return there < here

    def through_places(self) -> None:
        """Drive a path that leads through one or two random places."""
        count = 1 if self.random.random() < 0.7 else 2
        stops = [self.case.start, *(self._place() for _ in range(count)), self.case.goal]
        field = self.case.situation.field("energy", MARGIN)
        path = np.array([self.case.start])
        for a, b in itertools.pairwise(stops):
            piece = self.case.situation.path("energy", field, a, b)
            if piece is None:
                return
            path = without_spur(path, piece, min(field.dx, field.dy))
        metres = polyline_cost(field, path, field.step)
        if len(path) < 2 or not metres < TOO_LONG * self.case.dissipated(self.best.route):
            return
        self.driven["places"] += 1
        if self.random.random() < 0.5:
            knots = float(self.random.choice(KNOTS))
            toll = float(self.random.choice(TOLLS))
            for polyline in self.case.smoothed(path, {knots: (toll,)}):
                self.offer(polyline, "places")
            return
        legs = cheapest_near(run_of(self.case), field, [path], "energy").legs
        if legs is not None:
            self.offer(legs[0][0], "places")

    def _place(self) -> tuple[float, float]:
        """A place on the map, or in an ellipse round start and goal."""
        field, random = self.case.field, self.random
        ny, nx = field.heights.shape
        low = np.array([field.x0, field.y0])
        high = low + np.array([field.dx * (nx - 1), field.dy * (ny - 1)])
        a, b = np.array(self.case.start), np.array(self.case.goal)
        longer = random.choice([1.1, 1.3, 1.7, 10.0]) * np.hypot(*(b - a))
        while True:
            place = random.uniform(low, high)
            if np.hypot(*(place - a)) + np.hypot(*(place - b)) <= longer:
                return float(place[0]), float(place[1])

    def other_planner(self, seconds: float) -> None:
        """Drive what a sampling planner of OMPL's comes to."""
        name = next(self._next_other)
        run = run_of(self.case, planner=name, time_budget_s=seconds, seed=next(self._seeds))
        legs = answer(run).legs
        self.driven["others"] += 1
        if legs is not None:
            self.offer(legs[0][0], name)


def without_spur(path: Array, piece: Array, cell: float) -> Array:
    """A path and the one that goes on from its end, without what leads there and back again."""

    def node(point: Array) -> tuple[int, ...]:
        # Nodes may lie at half cells.
        return tuple(np.rint(2.0 * point / cell).astype(int))

    last = {node(point): k for k, point in enumerate(piece)}
    for n, point in enumerate(path):
        k = last.get(node(point))
        if k is not None:
            return np.vstack([path[: n + 1], piece[k + 1 :]])
    return np.vstack([path, piece[1:]])
