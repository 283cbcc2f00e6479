"""The cheapest place to arrive at, where the goal is a region or one of several places.

    for run in settled(run, "energy"):     # its goal is now one place

Situation.least_cost_from gives the least cost from the last fixed place to everywhere. For energy
the climb is added: E = D + M·g·z. Candidates are the cheapest places that lie apart. The path to
each is smoothed, and its end slides to where it costs least. The place whose motion costs least
becomes the goal, and the search goes there as to any other place. Where it finds no route, others
follow to which a motion is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner.amounts import span
from planner.arrays import Array
from planner.errors import RequestError
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, sample_surface, segment_cost
from planner.search.goals.goal_region import Region
from planner.search.grid import cost_from, grid_path
from planner.search.limit_places import Infeasible
from planner.search.requests import PoseRequest, RegionRequest
from planner.search.resolution import MARGIN, OBJECTIVES
from planner.search.results import Route, drive
from planner.search.run import Run
from planner.search.situation import check_hold, check_place
from planner.search.waypoints import refine

CANDIDATES, CANDIDATES_LOOKED_AT = 6, 12
"""Places whose motion is worked out; each costs a few tens of milliseconds. The second where the
cheapest ones cannot be driven to."""
CANDIDATE_EXCESS = 0.05
"""Share of the least grid cost by which a candidate may cost more.

The grid's cost leaves out turning and speeding up, which seldom differ by more between places."""
CANDIDATE_SPACING = 4.0
"""Cells between two candidates at least: closer ones have nearly the same path."""
SLIDE_STEPS = (2.0, 1.0, 0.5, 0.25, 0.1)
"""Cells by which the end of a path slides, coarse to fine."""
MOST_SLIDES = 40
"""Slides of each of these sizes at most; bounds the time on long even edges."""
LEAST_SLIDE_SAVING = 0.02
"""Share of the least cost of its length that a slide must save; less is rounding."""
REFINE_ROUNDS = 3
"""How often a path is smoothed and its end slides; it usually stays after two."""
_COMPASS = np.array([[math.cos(a), math.sin(a)] for a in 2.0 * math.pi * np.arange(8) / 8])


def settled(run: Run, objective: str) -> Iterator[Run]:
    """The same run with one place for a goal; the best one first, others for want of a route.

    Args:
        run: whose goal may be a region.
        objective: "energy", "time" or "length".

    Raises:
        RequestError: the region lies off the map, holds no place for the robot, or is none.
    """
    goal = run.request.goal
    if isinstance(goal, PoseRequest):
        yield run
        return
    arrival = _Arrival(run, objective)
    places = arrival.among(goal.any) if goal.any is not None else arrival.anywhere(goal)
    for place in places:
        yield replace(run, request=run.request.model_copy(update={"goal": place}))


def check_places(run: Run, field: CostField) -> Infeasible | None:
    """Refuse places without room, and a start that cannot be held; say which other cannot.

    A goal that is a region is left to ``settled``.

    Args:
        run: the question.
        field: map and costs.

    Returns:
        why there is no route, or None.

    Raises:
        RequestError: naming the place and what would be accepted.
    """
    request = run.request
    named = [("start", request.start)]
    named += [(f"via[{k}]", place) for k, place in enumerate(request.via)]
    if isinstance(request.goal, PoseRequest):
        named.append(("goal", request.goal))
    for name, place in named:
        check_place(name, place, run.ground, field, run.conditions, request)
    check_hold("start", request.start, field, run.conditions)
    try:
        for name, place in named[1:]:
            check_hold(name, place, field, run.conditions)
    except RequestError as error:
        # Where it stands is for the user to say; where it can get to is for the answer.
        return Infeasible(place.x, place.y, f"{error.field}: {error.problem}")
    return None


class _Arrival:
    """What every place costs from the last fixed one before the goal."""

    def __init__(self, run: Run, objective: str) -> None:
        self.run, self.objective = run, objective
        self.before = (run.request.start, *run.request.via)[-1]
        self.begin = (self.before.x, self.before.y)
        self.field = run.field(objective, MARGIN)
        situation = run.situation
        self.lattice = situation.lattice(objective, self.field)
        self.cost_to_come = situation.least_cost_from(self.field, self.begin, objective=objective)
        # J for each metre of height; neither time nor length know it.
        self.weight = run.conditions.mass * STANDARD_GRAVITY if objective == "energy" else 0.0

    def among(self, places: tuple[PoseRequest, ...]) -> Iterator[PoseRequest]:
        """The cheapest of several places, and others."""
        good = self._possible(
            list(places), lambda k: f"goal.any[{k}]", "none of these places has room for the robot"
        )
        values = [self._at((place.x, place.y)) for place in good]
        order = [int(k) for k in np.argsort(values, kind="stable")]
        chosen = [good[k] for k in order[:CANDIDATES_LOOKED_AT]]
        return self._cheapest(chosen, lambda leg: leg, good[order[0]])

    def anywhere(self, goal: RegionRequest) -> Iterator[PoseRequest]:
        """The cheapest place inside a circle or a polygon, and others."""
        region = Region.of(goal)
        places, values = self._inside(region)
        order = np.argsort(values, kind="stable")
        apart = CANDIDATE_SPACING * max(self.field.dx, self.field.dy)
        picked: list[Array] = []
        for k in order[np.isfinite(values[order])]:
            if all(math.hypot(*(places[k] - other)) >= apart for other in picked):
                picked.append(places[k])
            if len(picked) == CANDIDATES_LOOKED_AT:
                break
        # Without a path to any of them, the search for the nearest one says what blocks.
        nearest = np.argmin(np.hypot(*(places - np.array(self.begin)).T))
        wanted = [
            PoseRequest(x=float(x), y=float(y), yaw=goal.yaw)
            for x, y in picked or [places[nearest]]
        ]
        good = self._possible(wanted, lambda _: "goal", "nowhere inside can the robot stand")
        return self._cheapest(good, lambda leg: self._slid(leg, region), good[0])

    def _inside(self, region: Region) -> tuple[Array, Array]:
        """Places (n, 2) with room inside a region, nodes and its edge, and what they cost."""
        field, terrain = self.field, self.run.ground.terrain
        west, south, east, north = terrain.extent
        x0, y0, x1, y1 = region.extent
        if x0 > east or x1 < west or y0 > north or y1 < south:
            raise RequestError(
                "goal",
                "lies off the map",
                accepted=f"an area within x {span(west, east)}, y {span(south, north)} m",
            )
        ny, nx = field.heights.shape
        grid = np.meshgrid(field.x0 + field.dx * np.arange(nx), field.y0 + field.dy * np.arange(ny))
        nodes = np.column_stack([axis.ravel() for axis in grid])
        box = (nodes >= (x0, y0)).all(axis=1) & (nodes <= (x1, y1)).all(axis=1)
        numbers = np.flatnonzero(box & (field.mask != 0).ravel())
        within = numbers[region.inside(nodes[numbers])]
        values = (
            self.cost_to_come.values.ravel()[within] + self.weight * field.heights.ravel()[within]
        )
        edge = region.outline(0.5 * min(field.dx, field.dy), terrain.extent)
        edge = edge[np.array([terrain.contains(x, y) for x, y in edge], bool)]
        edge = edge[field.mask[field.nodes_at(edge)] != 0]
        places = np.vstack([nodes[within], edge])
        if not len(places):
            raise RequestError(
                "goal",
                "nowhere inside is there room for the robot",
                accepted="an area that is not all obstacles",
            )
        return places, np.concatenate([values, [self._at((x, y)) for x, y in edge]])

    def _height(self, place: Sequence[float] | Array) -> float:
        """Height at a place, m."""
        return float(sample_surface(self.field, np.array([place]))[0][0])

    def _at(self, place: tuple[float, float]) -> float:
        """Cost of a place by the grid, height included."""
        return cost_from(self.field, self.cost_to_come, place) + self.weight * self._height(place)

    def _most(self, least: float) -> float:
        """Cost up to which places are compared, where the cheapest one costs ``least``."""
        return least + CANDIDATE_EXCESS * max(least - self.weight * self._height(self.begin), 0.0)

    def _cheapest(
        self, places: list[PoseRequest], slide: Callable[[Array], Array], otherwise: PoseRequest
    ) -> Iterator[PoseRequest]:
        """Ends of paths; ``otherwise`` where there is none.

        The path that costs least comes first, then those along which a motion is known. Places
        beyond the cheapest ones are looked at for want of such a motion, or of a route.
        """
        most = self._most(self._at((places[0].x, places[0].y)))
        paths: list[tuple[float, PoseRequest, bool]] = []
        for place in places:
            enough = len(paths) >= CANDIDATES or self._at((place.x, place.y)) > most
            if enough and any(moves for *_, moves in paths):
                break
            paths.append(self._driven(place, slide))
        order = sorted((path for path in paths if math.isfinite(path[0])), key=lambda path: path[0])
        yield order[0][1] if order else otherwise
        yield from (place for _, place, moves in order[1:] if moves)
        for place in places[len(paths) :]:
            _, end, moves = self._driven(place, slide)
            if moves:
                yield end

    def _possible(
        self, places: list[PoseRequest], name: Callable[[int], str], problem: str
    ) -> list[PoseRequest]:
        """Those places at which the robot can stand.

        Raises:
            RequestError: there are none; with what is wrong at a single one.
        """
        good, wrong = [], []
        for k, place in enumerate(places):
            try:
                check_place(
                    *(name(k), place, self.run.ground, self.field),
                    *(self.run.conditions, self.run.request),
                )
                check_hold(name(k), place, self.field, self.run.conditions)
            except RequestError as error:
                wrong.append(error)
            else:
                good.append(place)
        if good:
            return good
        if len(wrong) == 1:
            raise wrong[0]
        raise RequestError(
            "goal", f"{problem}: {wrong[0].field} {wrong[0].problem}", accepted=wrong[0].accepted
        )

    def _driven(
        self, place: PoseRequest, slide: Callable[[Array], Array]
    ) -> tuple[float, PoseRequest, bool]:
        """What the motion to a place costs, its end after ``slide``, and whether it is known."""
        self.run.check()
        leg = grid_path(self.field, self.lattice, self.cost_to_come, (place.x, place.y))
        if leg is None:
            return math.inf, place, False
        corner_penalty = self.run.situation.corner_penalty(self.objective)
        cost = 0.0
        for _ in range(REFINE_ROUNDS):
            [(leg, cost)] = refine(
                self.field, leg, penalties=[corner_penalty], check=self.run.check
            )
            moved = slide(leg)
            if moved is leg:
                break
            leg = moved
        x, y = (float(value) for value in leg[-1])
        end = place.model_copy(update={"x": x, "y": y})
        yaws = (self.before.yaw, place.yaw)
        aim = OBJECTIVES[self.objective]
        field, conditions = self.run.situation.to_drive(self.field, self.objective)
        route = drive(field, conditions, [leg], yaws)
        if isinstance(route, Route):
            values = (route.energy_j, route.duration_s, route.length_m)
            return values[aim], end, True
        # Not by this path: the grid's cost stands in, above that of any path that can be driven.
        rise = self._height(leg[-1]) - self._height(self.begin)
        return cost * (1.0 + CANDIDATE_EXCESS) + self.weight * rise, end, False

    def _slid(self, leg: Array, region: Region) -> Array:
        """The leg with its end where its last piece costs least; the same one if it is there."""
        field = self.field
        if len(leg) < 2:
            return leg
        anchor, end = leg[-2], leg[-1]

        def value(point: Array) -> float:
            if not self.run.ground.terrain.contains(float(point[0]), float(point[1])):
                return math.inf
            line = segment_cost(field, anchor[0], anchor[1], point[0], point[1], field.step)
            return float(line) + self.weight * self._height(point)

        best, moved = value(end), False
        for step in SLIDE_STEPS:
            reach = step * min(field.dx, field.dy)
            # Where every place costs nearly the same, there is nothing to slide for.
            least = LEAST_SLIDE_SAVING * self.lattice.cheapest * reach
            for _ in range(MOST_SLIDES):
                places = region.nearest(end + reach * _COMPASS)
                values = [value(place) for place in places]
                k = int(np.argmin(values))
                if not values[k] < best - least:
                    break
                best, end, moved = values[k], places[k], True
        return np.vstack([leg[:-1], end]) if moved else leg
