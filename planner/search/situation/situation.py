"""One map, one robot, one model under given conditions: the costs and fields that follow.

    situation = Situation(ground, conditions)
    to_go = situation.least_cost_to("energy", goal)          # least cost from everywhere, kept

Everything here is cached for further requests (planner.cache): tables of steady costs by model
and conditions, the lattice by map and table, fields by goal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.cache import CACHE
from planner.cancellation import CancellationToken
from planner.errors import RequestError
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle, load_vehicle
from planner.search.conditions import OperatingConditions, operating_conditions
from planner.search.field import CostField
from planner.search.grid import (
    CostToGo,
    Lattice,
    build_lattice,
    cost_to_go,
    grid_path,
    number_nodes,
)
from planner.search.requests import RequestLike, SituationRequest
from planner.search.resolution import MARGIN, OBJECTIVES
from planner.search.situation.narrow_passage import NarrowPassage, narrow_passage
from planner.search.situation.objects import by_name
from planner.search.situation.traversability import DrivingGround, driving_ground
from planner.search.steady import SteadyCosts, kept_table, steady_costs
from planner.search.turns import turning
from planner.terrain.catalogue import open_map
from planner.terrain.heightmap import Terrain

Point = tuple[float, float]
KINDS = ("sound", "printed/A", "printed/B")
LARGE_MAP_NODES = 2_000_000
"""Nodes above which a field for one start is not cached: it takes 10 MB and seldom serves again."""
Asked = TypeVar("Asked", bound=SituationRequest)
CORNER_PENALTY = {"energy": 0.13, "time": 0.02}
"""Corner penalty as a share of what a stop costs: of 0.03 to 0.4 the best on fractal relief."""


def load_model(request: SituationRequest) -> PowerModel:
    """The power model that a request names: a vehicle, a saved model, or a kind of model."""
    if request.model is None or request.model in KINDS:
        vehicle = load_vehicle(request.vehicle or SituationRequest.default_vehicle)
        return PowerModel.from_vehicle(vehicle, kind=request.model or "sound")
    return PowerModel.load(Path(request.model))


def situation_of(
    request: SituationRequest, *, terrain: Terrain | None = None, model: PowerModel | None = None
) -> Situation:
    """The situation that a request names.

    Args:
        request: ground, robot and circumstances.
        terrain, model: already there, instead of those that the request names.

    Raises:
        MapError, VehicleError, ModelError: something that it names cannot be used.
    """
    model = load_model(request) if model is None else model
    terrain = open_map(request.map) if terrain is None else terrain
    if request.avoid:
        terrain = _without_areas(terrain, request)
    key = "ground", ground_key(terrain, model.vehicle)
    ground = CACHE.get(key, lambda: driving_ground(terrain, model.vehicle))
    conditions = operating_conditions(request, model, terrain)
    limits = model.vehicle.limits
    share = limits.continuous_torque / limits.peak_torque
    # A slope as long as a cell lasts longer than motors may give their peak torque.
    lasting = min(terrain.cell) >= limits.speed * limits.thermal_time * share**2
    return Situation(ground, replace(conditions, lasting=lasting))


def _without_areas(terrain: Terrain, request: SituationRequest) -> Terrain:
    """The terrain with the cells that areas touch as obstacles.

    No part of the body enters such an area, nor of its clearance.

    Args:
        terrain: a map.
        request: with circles and polygons to avoid, in the map's frame, m.

    Raises:
        RequestError: an area has no extent, or lies beside the map altogether.
    """
    obstacles = terrain.obstacles
    for number, area in enumerate(request.avoid):
        covered = terrain.cells_in([area.ring()], touched=True)
        if not covered.any():
            raise RequestError(
                f"avoid[{number}]",
                "covers nothing of the map",
                accepted="a circle or a polygon on the map, in metres",
            )
        obstacles = obstacles | covered
    return replace(terrain, obstacles=np.ascontiguousarray(obstacles))


def ground_key(terrain: Terrain, vehicle: Vehicle) -> tuple[str, str]:
    """Cache key of a driving ground."""
    shape = (vehicle.length, vehicle.width, vehicle.limits.clearance, vehicle.layout.radius)
    return terrain.fingerprint, repr((shape, vehicle.layout.table.tolist()))


@dataclass(frozen=True)
class Situation:
    """A map and a model under the conditions of a request.

    Attributes:
        ground: the map as the robot feels it.
        conditions: model, conditions and limits.
    """

    ground: DrivingGround
    conditions: OperatingConditions
    asked_together: ClassVar[tuple[str, ...]] = tuple(OBJECTIVES)
    """Objectives that one question searches the map for, its baselines included."""

    @classmethod
    def asked(
        cls,
        kind: type[Asked],
        request: SituationRequest | RequestLike,
        fields: Mapping[str, Any],
        terrain: Terrain | None = None,
        model: PowerModel | str | PathLike[str] | None = None,
    ) -> tuple[Asked, Situation]:
        """A request as a function takes it, checked, and its situation.

        Args:
            kind: of the request.
            request: ready, a mapping of its fields, the path of a REQUEST.json, or None.
            fields: over those of the request. ``map`` may be a Terrain, ``vehicle`` a Vehicle and
                ``model`` a PowerModel.
            terrain, model: instead of those that the request names.

        Raises:
            RequestError, MapError, VehicleError, ModelError: something given cannot be used.
        """
        request, fields, terrain, model = by_name(request, fields, terrain, model)
        asked = kind.from_call(request, fields)
        return asked, situation_of(asked, terrain=terrain, model=model)

    @property
    def large(self) -> bool:
        """Whether a search for one start fills nothing for others, and is not kept."""
        return self.ground.heights.size > LARGE_MAP_NODES

    def with_peak_torque(self) -> Situation:
        """The same with up to the peak torque while driving steadily, too."""
        return replace(self, conditions=replace(self.conditions, lasting=False))

    def with_continuous_torque(self) -> Situation:
        """The same with no more torque at any moment than motors give for good."""
        return replace(self, conditions=replace(self.conditions, lasting=True).steady)

    @property
    def slopes_outlast_heat(self) -> bool:
        """Whether a slope as long as a cell lasts longer than the time that torque counts over."""
        limits = self.conditions.model.vehicle.limits
        return min(self.ground.terrain.cell) >= limits.speed * limits.thermal_time

    @cached_property
    def key(self) -> tuple[object, ...]:
        """Cache key of a situation."""
        ground = ground_key(self.ground.terrain, self.conditions.model.vehicle)
        return (ground, *self.conditions.key)

    def costs(self, objective: str) -> SteadyCosts:
        """Costs of steady driving for "energy", "time" or "length"."""
        conditions = self.conditions.steady
        key = steady_costs.__module__, *conditions.content, objective

        def build() -> SteadyCosts:
            return steady_costs(conditions.model, conditions.class_rows, objective)

        return CACHE.get(
            ("steady", conditions.key, objective), lambda: kept_table(key, SteadyCosts, build)
        )

    def field(
        self, objective: str, margin: float = MARGIN, factor: Array | None = None
    ) -> CostField:
        """Map and costs for an objective.

        Args:
            objective: "energy", "time" or "length".
            margin: share of the slope limit that may be used.
            factor: (ny, nx) on the cost: ground to be avoided.
        """
        extra = self.conditions.wind_by_direction() if objective == "energy" else None
        return self.ground.field(self.costs(objective), extra=extra, factor=factor, margin=margin)

    def to_drive(self, field: CostField, objective: str) -> tuple[CostField, OperatingConditions]:
        """Map and conditions for motions along a path that was found for an objective.

        However a path was found, the robot turns as costs it least along it. For the fastest
        motion seconds count most by far, so that of all that are as quick it takes the one of
        least energy.
        """
        if objective == "energy":
            return field, self.conditions
        costs = self.costs("energy")
        conditions = self.conditions.hurried if objective == "time" else self.conditions
        by_yaw = self._hurried_by_yaw if objective == "time" else costs.by_yaw
        field = field._replace(
            by_yaw=by_yaw, yaw_limit=costs.yaw_limit, crab_angle=costs.crab_angle
        )
        return field, conditions

    @cached_property
    def _hurried_by_yaw(self) -> Array:
        """The table of costs by yaw where seconds count most."""
        seconds = self.costs("time").by_yaw
        return self.costs("energy").by_yaw + self.conditions.hurried.model.time_weight * seconds

    def corner_penalty(self, objective: str) -> float:
        """What refinement counts for a corner, beside the costs of the metres."""
        if objective == "length":
            return 0.0
        return CORNER_PENALTY[objective] * turning(self.conditions, OBJECTIVES[objective]).stop

    def lattice(self, objective: str, field: CostField) -> Lattice:
        """The moves on the grid for a field of ``field``."""
        plain = field._replace(factor=np.ones((1, 1)))
        numbering = CACHE.get(("numbering", self.key[0], field.safe), lambda: number_nodes(plain))
        content = (*self.conditions.steady.content, objective, field.margin)

        def build() -> Lattice:
            # Wind counts for energy alone.
            windy = self.conditions.wind_by_direction().any()
            aims = self.asked_together
            if windy or objective not in aims:
                aims = (objective,)
            fields = [self.field(aim, field.margin) for aim in aims]
            together = CACHE.get(
                ("together", self.key, aims, field.margin), lambda: numbering.together(fields)
            )
            return build_lattice(plain, numbering, content, (together, aims.index(objective)))

        return CACHE.get(("lattice", self.key, objective, field.margin), build)

    def least_cost_to(
        self,
        objective: str,
        field: CostField,
        goal: Point,
        start: Point | None = None,
        token: CancellationToken | None = None,
    ) -> CostToGo:
        """Least cost from everywhere to the goal; no more than ``start`` needs if that will do.

        The whole map is worth its time when a second start asks for the path to the same goal,
        where the map is not too large.
        """
        lattice = self.lattice(objective, field)
        key = ("least_cost_to", self.key, objective, field.margin, goal)
        found: CostToGo | None = CACHE.find(key) if field.factor.size == 1 else None
        if found is not None and found.start in (None, start):
            return found
        again = found is not None and not self.large
        found = cost_to_go(field, lattice, goal, start=None if again else start, token=token)
        if field.factor.size == 1 and not (self.large and found.start):
            CACHE.put(key, found)
        return found

    def least_cost_from(
        self,
        field: CostField,
        start: Point,
        token: CancellationToken | None = None,
        objective: str = "energy",
    ) -> CostToGo:
        """Least cost from a start to everywhere."""
        lattice = self.lattice(objective, field)
        key = ("least_cost_from", self.key, objective, field.margin, start)

        def search() -> CostToGo:
            return cost_to_go(field, lattice, start, from_start=True, token=token)

        return CACHE.get(key, search) if field.factor.size == 1 else search()

    def narrow_passage(self, start: Point, goal: Point) -> NarrowPassage | None:
        """The straight path through the narrowest place of the widest one between two places, m."""
        return narrow_passage(self.ground, start, goal)

    def path(
        self,
        objective: str,
        field: CostField,
        start: Point,
        goal: Point,
        token: CancellationToken | None = None,
    ) -> NDArray[np.float64] | None:
        """Polyline (k, 2) of the least-cost moves, or None if there is no path."""
        least_cost_to = self.least_cost_to(objective, field, goal, start, token)
        return grid_path(field, self.lattice(objective, field), least_cost_to, start)
