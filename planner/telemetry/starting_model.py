"""The model that a comparison or a diagnosis starts from.

model = starting_model("minibalance")
"""

from __future__ import annotations

from pathlib import Path

from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle, load_vehicle


def starting_model(given: PowerModel | Vehicle | str | Path) -> PowerModel:
    """The model that a comparison starts from: a vehicle's base model, or a model as it is.

    Raises:
        VehicleError: no such vehicle, or its file cannot be used.
    """
    if isinstance(given, PowerModel):
        return given
    vehicle = given if isinstance(given, Vehicle) else load_vehicle(str(given))
    return PowerModel.from_vehicle(vehicle, effects=())
