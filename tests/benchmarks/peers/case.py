"""A question as every method gets it: map, robot, start and goal, and what a metre costs there.

    case = case_of("cone", {"start": {"x": 6, "y": 20}, "goal": {"x": 34, "y": 20}})
    case.score(path)          # J of the best motion along a polyline (k, 2)

All methods read the same cost (planner.search.field.cost_field), and all paths are priced by the
same power model along a motion worked out in the same way: corners rounded, best yaw, best speed,
integrated at least every half cell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, segment_cost
from planner.search.requests import PlanRequest
from planner.search.results import Route, drive
from planner.search.situation import Situation, situation_of
from planner.search.waypoints import VARIANTS, refine
from planner.terrain.catalogue import open_map
from planner.terrain.heightmap import Terrain

Array = NDArray[np.float64]
HEADINGS = 16
"""Directions of travel in which a node's cost is worked out for methods that want it by node."""


@dataclass(frozen=True)
class Case:
    """One question.

    Attributes:
        map: name in the catalogue.
        asked: start and goal, as in a request.
        situation: map and model.
        field: costs for energy.
        start, goal: x, y, m.
    """

    map: str
    asked: Mapping[str, Any]
    situation: Situation
    field: CostField
    start: tuple[float, float]
    goal: tuple[float, float]

    def drive(self, path: Array) -> Route | None:
        """The best motion along a polyline (k, 2); None where a limit is broken."""
        ended = np.array(path[:, :2], float)
        ended[0], ended[-1] = self.start, self.goal
        apart = np.hypot(*np.diff(ended, axis=0).T) > 1e-9
        kept = ended[np.concatenate([[True], apart])]
        route = drive(self.field, self.situation.conditions, [kept], (None, None))
        return route if isinstance(route, Route) else None

    def score(self, path: Array) -> float | None:
        """J of the best motion along a polyline; None where a limit is broken."""
        route = self.drive(path)
        return None if route is None else route.energy_j

    def refined(
        self, path: Array, variants: Mapping[float, Sequence[float]] = VARIANTS
    ) -> Route | None:
        """The best motion near a polyline: refined as our own paths are, then driven.

        Args:
            path: (k, 2).
            variants: shares of the toll by the distance of knots in cells.
        """
        routes = [self.drive(polyline) for polyline in self.smoothed(path, variants)]
        driven = [route for route in routes if route is not None]
        return min(driven, key=lambda route: route.energy_j, default=None)

    def smoothed(
        self, path: Array, variants: Mapping[float, Sequence[float]] = VARIANTS
    ) -> list[Array]:
        """Polylines near a path, refined as our own paths are; arguments as for ``refined``."""
        found: list[Array] = []
        for waypoint_cells, shares in variants.items():
            penalties = [share * self.situation.corner_penalty("energy") for share in shares]
            near = refine(
                self.field, path[:, :2].copy(), penalties=penalties, waypoint_cells=waypoint_cells
            )
            found += [polyline for polyline, _ in near]
        return found

    def dissipated(self, route: Route) -> float:
        """J of a route without what climbing stores."""
        weight = self.situation.conditions.mass * STANDARD_GRAVITY
        return route.energy_j - weight * route.rise_m

    def node(self, point: tuple[float, float]) -> tuple[int, int]:
        """Row and column of the node nearest to a point."""
        field = self.field
        ny, nx = field.heights.shape
        j, i = round((point[1] - field.y0) / field.dy), round((point[0] - field.x0) / field.dx)
        return min(max(j, 0), ny - 1), min(max(i, 0), nx - 1)

    def points(self, nodes: NDArray[np.int64]) -> Array:
        """Polyline (k, 2) through nodes given by row and column, between the question's ends."""
        field = self.field
        path = np.column_stack(
            [field.x0 + field.dx * nodes[:, 1], field.y0 + field.dy * nodes[:, 0]]
        )
        path[0], path[-1] = self.start, self.goal
        return path


def case_of(name: str, asked: Mapping[str, Any], terrain: Terrain | None = None) -> Case:
    """The question with what it costs to drive there.

    Args:
        name: of a map in the catalogue.
        asked: start and goal, as in a request.
        terrain: already there, instead of the catalogue's.
    """
    request = PlanRequest.from_json({"map": name, **asked})
    situation = situation_of(request, terrain=open_map(name) if terrain is None else terrain)
    return Case(
        name,
        asked,
        situation,
        situation.field("energy"),
        (request.start.x, request.start.y),
        (request.goal.x, request.goal.y),
    )


def node_costs(field: CostField) -> Array:
    """J/m (ny, nx, HEADINGS) of passing every node in evenly spread directions; inf: impossible."""
    return np.asarray(_node_costs(field, HEADINGS))


@njit(cache=True, error_model="numpy")
def _node_costs(field: Any, headings: int) -> Any:
    ny, nx = field.heights.shape
    half = 0.25 * min(field.dx, field.dy)
    costs = np.empty((ny, nx, headings))
    for j in range(ny):
        for i in range(nx):
            x, y = field.x0 + i * field.dx, field.y0 + j * field.dy
            for k in range(headings):
                angle = 2.0 * np.pi * k / headings
                a, b = half * np.cos(angle), half * np.sin(angle)
                cost = segment_cost(field, x - a, y - b, x + a, y + b, field.step)
                costs[j, i, k] = cost / (2.0 * half)
    return costs
