"""The model that a comparison or a diagnosis starts from.

start = starting_model("minibalance")

Rotors count n² times at the wheels, and few data sheets state their inertia. Where a vehicle's does
not, what is assumed for them stands with the wheels' own inertia, which a fit may make smaller.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle, load_vehicle

ROTOR = "drive.rotor_inertia"
"""Key of a vehicle's file."""


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
    return _with_free_rotors(PowerModel.from_vehicle(vehicle, effects=()))


def _with_free_rotors(model: PowerModel) -> PowerModel:
    """The model with rotors that nobody stated in its wheels, whose inertia is fitted."""
    known = model.vehicle.provenance
    if ROTOR not in known.derived and ROTOR not in known.defaults_taken:
        return model
    values, names = model.parameters.copy(), model.parameter_names
    rotor, wheel = (
        names.index(("inertia", name, 0)) for name in ("rotor_inertia", "wheel_inertia")
    )
    values[wheel] += model.vehicle.gear_ratio**2 * values[rotor]
    values[rotor] = 0.0
    return replace(model, parameters=values)
