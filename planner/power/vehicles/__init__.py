"""Vehicles: geometry, limits and known parameters of a robot.

Their TOML files stand in this folder, or anywhere else.

    vehicle = load_vehicle("minibalance")          # a name of list_vehicles(), or a path
"""

from planner.power.vehicles.defaults import defaults_in_words
from planner.power.vehicles.vehicle import Limits, Vehicle
from planner.power.vehicles.vehicle_fields import commented_toml, template
from planner.power.vehicles.vehicle_file import list_vehicles, load_vehicle, wheel_values

__all__ = [
    "Limits",
    "Vehicle",
    "commented_toml",
    "defaults_in_words",
    "list_vehicles",
    "load_vehicle",
    "template",
    "wheel_values",
]
