"""The energy of every edge of a graph of places, for Nav2's route server.

    graph = energy_graph(map="warehouse", graph="nodes.geojson", corridor_m=1.0)
    graph.to_json()                    # the same GeoJSON, with a cost for every edge

The route server runs Dijkstra's algorithm, which needs costs above zero, but a descent may return
energy. So an edge costs what it dissipates, D = E − M·g·Δz > 0 by the second law. Along any
route between two places the heights add up to the same difference: the route of least D is that of
least E. The energy itself stands in the edge's ``metadata``.

Each edge is planned from rest to rest with the yaw left open, as a request of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.errors import RequestError
from planner.power.model import PowerModel
from planner.progress import Progress, silent
from planner.quantities import STANDARD_GRAVITY
from planner.search.conditions import assumptions
from planner.search.field import CostField
from planner.search.requests import PlanRequest, PoseRequest, RequestLike
from planner.search.resolution import MARGIN
from planner.search.results import Route
from planner.search.route_graph import Edge, GraphRequest, RouteGraph, read_graph
from planner.search.run import COINCIDENT, Run
from planner.search.situation import Situation, check_hold, check_place
from planner.search.solve import on_grid
from planner.shown import frame
from planner.terrain.heightmap import Terrain

if TYPE_CHECKING:
    import pandas

LEAST_COST = 1e-3
"""J, s or m that an edge costs at least: the route server refuses a graph with a cost of 0."""
Ends = tuple[int, int]
"""Ids of the places at both ends."""


@dataclass(frozen=True)
class Drive:
    """What an edge takes in one direction.

    Attributes:
        cost: in the route server's sense, above 0: J dissipated, s or m, by the objective.
        energy_j: J drawn; negative where a descent returns energy.
        duration_s, length_m: of the route.
    """

    cost: float
    energy_j: float
    duration_s: float
    length_m: float


@dataclass(frozen=True)
class EnergyGraph:
    """A graph with the energy of its edges.

    Attributes:
        graph: as it was given.
        drives: by the ids of both ends; for every edge both directions that can be driven.
        closed: why a direction cannot be driven, by the same ids.
        asked: the request.
        notes: what was assumed, in sentences.
    """

    graph: RouteGraph
    drives: Mapping[Ends, Drive]
    closed: Mapping[Ends, str]
    asked: GraphRequest
    notes: tuple[str, ...] = ()

    @cached_property
    def _there(self) -> dict[Ends, int]:
        """Ids of the edges in the file."""
        return {edge.ends: edge.id for edge in self.graph.edges}

    def to_json(self) -> dict[str, Any]:
        """The GeoJSON to write back.

        Everything else in it stays. Edges that cannot be driven are left out, for the route server
        knows no mark for them; they stand in ``joulepath`` with the reason.
        """
        document, edges = self.graph.document, {edge.feature: edge for edge in self.graph.edges}
        features = []
        for number, feature in enumerate(document["features"]):
            edge = edges.get(number)
            if edge is None:
                features.append(feature)
            elif edge.ends in self.drives:
                features.append(self._written(feature, edge))
        added = self._opposites()
        for opposite in added:
            feature = _turned(document["features"][opposite.feature], opposite)
            features.append(self._written(feature, opposite))
        return {
            "type": "FeatureCollection",
            **document,
            "features": features,
            "joulepath": self._summary(len(added)),
        }

    def to_frame(self) -> pandas.DataFrame:
        """All directions as a DataFrame, one row each.

        Columns are ``start`` and ``end`` (ids of places), ``cost``, ``energy_j``, ``duration_s``,
        ``length_m``; and ``closed``, why a direction cannot be driven.
        """
        rows = [
            {"start": ends[0], "end": ends[1], **asdict(drive), "closed": None}
            for ends, drive in self.drives.items()
        ]
        rows += [{"start": a, "end": b, "closed": why} for (a, b), why in self.closed.items()]
        return frame(rows)

    def _opposites(self) -> list[Edge]:
        """Edges to add: the opposite of those that have none and can be driven back."""
        if not self.asked.add_opposite:
            return []
        missing = {
            edge.ends[::-1]: edge.feature
            for edge in self.graph.edges
            if edge.ends[::-1] not in self._there and edge.ends[::-1] in self.drives
        }
        # Ids are unique among places and edges together.
        first = 1 + max(*self.graph.places, *(edge.id for edge in self.graph.edges))
        return [
            Edge(feature, first + number, *ends)
            for number, (ends, feature) in enumerate(missing.items())
        ]

    def _written(self, feature: Mapping[str, Any], edge: Edge) -> dict[str, Any]:
        drive = self.drives[edge.ends]
        properties = feature["properties"]
        metadata = {
            **properties.get("metadata", {}),
            "energy_j": drive.energy_j,
            "duration_s": drive.duration_s,
            "length_m": drive.length_m,
            "energy_cost": drive.cost,
        }
        back = self.drives.get(edge.ends[::-1])
        if back is not None and edge.ends[::-1] not in self._there and not self.asked.add_opposite:
            metadata["energy_back_j"] = back.energy_j
        kept = {**properties, "cost": drive.cost, "overridable": False, "metadata": metadata}
        return {**feature, "properties": kept}

    def _summary(self, added: int) -> dict[str, Any]:
        asked = self.asked
        closed = [
            {"id": self._there.get(ends), "startid": ends[0], "endid": ends[1], "reason": reason}
            for ends, reason in self.closed.items()
        ]
        return {
            "map": asked.map,
            "robot": asked.model or asked.vehicle,
            "objective": asked.objective,
            "corridor_m": asked.corridor_m,
            "places": len(self.graph.places),
            "edges": len(self.graph.edges),
            "added": added,
            "closed": closed,
            "notes": list(self.notes),
        }


def energy_graph(
    request: GraphRequest | RequestLike = None,
    *,
    terrain: Terrain | None = None,
    model: PowerModel | str | PathLike[str] | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    **fields: Any,
) -> EnergyGraph:
    """The energy of every edge of a graph, in both directions.

    Args:
        request: a GraphRequest, a mapping with its fields or the path of a JSON file; or give
            the fields as keywords. ``graph`` may be the path of a GeoJSON file.
        terrain, model: already there, instead of those that the request names; a text or a path
            as model is the request's field ``model``.
        progress: called with the share done, 0 to 1, and what is being done.
        cancelled: asked often; True raises Cancelled.
        fields: fields of the request, over those of ``request``; ``map`` may be a Terrain,
            ``vehicle`` a Vehicle and ``model`` a PowerModel.

    Raises:
        RequestError, MapError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` returned True.
    """
    given = fields.get("graph") or (request.get("graph") if isinstance(request, Mapping) else None)
    if isinstance(given, str | PathLike):
        fields["graph"] = read_graph(given)
    asked, situation = Situation.asked(GraphRequest, request, fields, terrain, model)
    graph = RouteGraph.parse(asked.graph)
    drives: dict[Ends, Drive] = {}
    closed: dict[Ends, str] = {}
    with CancellationToken(cancelled) as token:
        driver = _Driver(situation, asked, graph, token)
        directions = dict.fromkeys(
            ends for edge in graph.edges for ends in (edge.ends, edge.ends[::-1])
        )
        # By where they lead: all directions to one place share its field.
        for number, ends in enumerate(sorted(directions, key=lambda ends: ends[::-1]), start=1):
            token.check()
            found = driver.drive(ends)
            if isinstance(found, str):
                closed[ends] = found
            else:
                drives[ends] = found
            (progress or silent)(
                number / len(directions), f"{number} of {len(directions)} directions"
            )
    notes = assumptions(asked, situation.conditions, situation.ground.terrain)
    drives, closed = _in_order(drives, directions), _in_order(closed, directions)
    return EnergyGraph(graph, drives, closed, asked, notes)


def _in_order(found: Mapping[Ends, Any], directions: Iterable[Ends]) -> dict[Ends, Any]:
    """What was found, in the order of the file."""
    return {ends: found[ends] for ends in directions if ends in found}


class _Driver:
    """Plans one direction of an edge after the other, on one map with one robot."""

    def __init__(
        self,
        situation: Situation,
        asked: GraphRequest,
        graph: RouteGraph,
        token: CancellationToken,
    ) -> None:
        self.graph, self.situation, self.asked = graph, situation, asked
        self.field = situation.field(asked.objective, MARGIN)
        self.refused = {id_: self._why_not(id_) for id_ in graph.places}
        here = PoseRequest(x=0.0, y=0.0)
        request = PlanRequest(map=asked.map, start=here, goal=here, objective=asked.objective)
        self.run = Run(request, situation, silent, token)

    def drive(self, ends: Ends) -> Drive | str:
        """What a direction takes, or why it cannot be driven."""
        for id_ in ends:
            if reason := self.refused[id_]:
                return reason
        a, b = (self.graph.places[id_] for id_ in ends)
        if math.dist(a, b) <= COINCIDENT:
            return Drive(LEAST_COST, 0.0, 0.0, 0.0)
        start, goal = (PoseRequest(x=x, y=y) for x, y in (a, b))
        run = replace(
            self.run, request=self.run.request.model_copy(update={"start": start, "goal": goal})
        )
        objective, field = self.asked.objective, self.field
        if self.asked.corridor_m is not None:
            field = run.field(objective, MARGIN, corridor(field, a, b, self.asked.corridor_m))
            if self.situation.path(objective, field, a, b, run.token) is None:
                return f"no path within {self.asked.corridor_m:g} m of the edge"
        attempt = on_grid(run, field, objective)
        return attempt.reason if attempt.route is None else self._priced(attempt.route)

    def _priced(self, route: Route) -> Drive:
        weight = self.situation.conditions.mass * STANDARD_GRAVITY
        dissipated = route.energy_j - weight * route.rise_m
        cost = {"energy": dissipated, "time": route.duration_s, "length": route.length_m}
        return Drive(
            max(cost[self.asked.objective], LEAST_COST),
            route.energy_j,
            route.duration_s,
            route.length_m,
        )

    def _why_not(self, id_: int) -> str:
        """Why the robot cannot stand at a place; empty where it can.

        Raises:
            RequestError: the place is not on the map.
        """
        (x, y), name = self.graph.places[id_], f"place {id_}"
        ground, conditions = self.situation.ground, self.situation.conditions
        pose = PoseRequest(x=x, y=y)
        if not ground.terrain.contains(x, y):
            check_place(name, pose, ground, self.field, conditions, self.asked)
        try:
            check_place(name, pose, ground, self.field, conditions, self.asked)
            check_hold(name, pose, self.field, conditions)
        except RequestError as error:
            return f"{name}: {error.problem}"
        return ""


def corridor(
    field: CostField, a: tuple[float, float], b: tuple[float, float], width: float
) -> Array:
    """Factor (ny, nx) on the cost: 1 within ``width`` m of the straight line, infinite elsewhere.

    Not less than a cell's diagonal: the nodes round both ends have to be in it.
    """
    ny, nx = field.heights.shape
    x = (field.x0 + field.dx * np.arange(nx))[None, :]
    y = (field.y0 + field.dy * np.arange(ny))[:, None]
    ex, ey = b[0] - a[0], b[1] - a[1]
    share = np.clip(((x - a[0]) * ex + (y - a[1]) * ey) / (ex * ex + ey * ey), 0.0, 1.0)
    away = np.hypot(x - a[0] - share * ex, y - a[1] - share * ey)
    return np.where(away <= max(width, math.hypot(field.dx, field.dy)), 1.0, np.inf)


def _turned(feature: Mapping[str, Any], edge: Edge) -> dict[str, Any]:
    """The feature of an edge turned round, under an id of its own.

    Its operations are not taken over: what a robot does when it enters holds for one direction.
    """
    properties = {key: value for key, value in feature["properties"].items() if key != "operations"}
    geometry = dict(feature["geometry"])
    line = geometry.get("coordinates")
    if isinstance(line, list | tuple):
        turned = line[::-1]
        if geometry["type"] == "MultiLineString":
            turned = [part[::-1] if isinstance(part, list | tuple) else part for part in turned]
        geometry["coordinates"] = turned
    ends = {"id": edge.id, "startid": edge.start, "endid": edge.end}
    return {**feature, "geometry": geometry, "properties": {**properties, **ends}}
