"""Robots and their circumstances for the tests of the bounds."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from planner.power.kinematics import mecanum, omni
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.conditions import OperatingConditions, operating_conditions
from planner.search.field import CostField
from planner.search.requests import PlanRequest
from planner.search.situation.traversability import driving_ground
from planner.search.steady import steady_costs
from planner.terrain.heightmap import Terrain
from tests.power.states import changed
from tests.search.maps import terrain

QUARTER = math.pi / 4


@lru_cache
def model_of(name: str) -> PowerModel:
    """An installed vehicle's model, or minibalance on other wheels or without limits."""
    if name == "robotino":
        return PowerModel.from_vehicle(load_vehicle(name))
    vehicle = load_vehicle("minibalance")
    radius = vehicle.layout.radius
    if name == "giving rollers":
        model = PowerModel.from_vehicle(vehicle, effects=[*vehicle.active, "roller_presliding"])
        return changed(model, roller_presliding__presliding=0.3)
    if name == "four omni wheels":
        corners = tuple(QUARTER + k * math.pi / 2 for k in range(4))
        vehicle = replace(vehicle, layout=omni(base_radius=0.33, angles=corners, radius=radius))
    if name == "steep rollers":
        layout = mecanum(half_wheelbase=0.214, half_track=0.247, radius=radius, roller_angle=1.2)
        vehicle = replace(vehicle, layout=layout)
    if name == "no limits":
        limits = replace(vehicle.limits, continuous_torque=math.inf, current=math.inf)
        vehicle = replace(vehicle, limits=limits)
        return changed(PowerModel.from_vehicle(vehicle), electronics__power=0.0)
    return PowerModel.from_vehicle(vehicle)


@lru_cache
def windy() -> PowerModel:
    """Minibalance with a large sail."""
    vehicle = load_vehicle("minibalance")
    model = PowerModel.from_vehicle(vehicle, effects=[*vehicle.active, "air_drag"])
    return changed(model, air_drag__drag_area=0.6)


def around_of(model: PowerModel, payload: float = 0.0, **more: object) -> OperatingConditions:
    request = PlanRequest.from_json(
        {
            "map": "test",
            "start": {"x": 1, "y": 1},
            "goal": {"x": 2, "y": 2},
            "payload": {"mass": payload, "x": 0.02, "y": -0.01},
            **more,
        }
    )
    return operating_conditions(request, model, terrain(np.zeros((8, 8))))


def field_of(ground: Terrain, model: PowerModel) -> tuple[CostField, OperatingConditions]:
    conditions = around_of(model)
    costs = steady_costs(conditions.model, conditions.class_rows)
    return driving_ground(ground, model.vehicle).field(costs), conditions
