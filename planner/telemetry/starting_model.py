"""The model that a comparison or a diagnosis starts from.

start = starting_model("minibalance")
"""

from __future__ import annotations

from pathlib import Path

from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle, load_vehicle


def is_model(given: PowerModel | Vehicle | str | Path) -> bool:
    """Whether it is a model, ready or saved, and not a vehicle."""
    saved = isinstance(given, str | Path) and Path(given).suffix == ".json"
    return saved or isinstance(given, PowerModel)


def starting_model(given: PowerModel | Vehicle | str | Path) -> PowerModel:
    """The model that a comparison starts from: a vehicle's base model, or a model as it is.

    Args:
        given: a model, or the .json file of one; a vehicle, its name or its TOML file.

    Raises:
        VehicleError: no such vehicle, or its file cannot be used.
        ModelError: the saved model cannot be used.
    """
    if isinstance(given, PowerModel):
        return given
    if isinstance(given, str | Path) and is_model(given):
        return PowerModel.load(given)
    vehicle = given if isinstance(given, Vehicle) else load_vehicle(str(given))
    return PowerModel.from_vehicle(vehicle, effects=())
