"""What a model takes from defaults, or derives, because its vehicle's file does not give it.

defaults_in_words(vehicle, values)    # ["limits.speed = 1 m/s", "battery.capacity = no limit",
                                      #  "body.yaw_inertia = 1 kg·m² (mass/12·(length² + width²))"]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Set

from planner.power.catalogue import all_effects
from planner.power.vehicles.vehicle import Vehicle
from planner.power.vehicles.vehicle_keys import vehicle_keys

Values = Mapping[tuple[str, str], Set[float]]
"""Effect's slug and name of a parameter → its values in a model."""


def defaults_in_words(vehicle: Vehicle, values: Values) -> list[str]:
    """Key, value and unit of every default that a model uses; of a derived one also the formula.

    Left out is what is not a default any more: a parameter that was fitted since, an effect that
    the model does not have.

    Args:
        vehicle: of the model.
        values: by slug of an effect of the model and name, the values of its parameter.
    """
    formulas = {key: f" ({formula})" for key, formula in vehicle.provenance.derived.items()}
    taken = (*vehicle.provenance.defaults_taken, *formulas)
    found = {key: _value(vehicle, values, key) for key in taken}
    return [
        f"{key} = {_words(*value)}{formulas.get(key, '')}"
        for key, value in found.items()
        if value is not None
    ]


def _value(vehicle: Vehicle, values: Values, key: str) -> tuple[float, str] | None:
    """Value and unit; None for a given value, or a key of another version's model file."""
    table, _, name = key.partition(".")
    if table == "effects":
        return _parameter(vehicle, values, *name.partition(".")[::2])
    known = vehicle_keys().get(table, {}).get(name)
    if known is None:
        return None
    if known.effect is not None:
        return _parameter(vehicle, values, *known.effect)
    owners = {"wheels": vehicle.layout, "limits": vehicle.limits, "battery": vehicle.battery}
    value = getattr(owners.get(table, vehicle), name, None)
    return None if value is None else (value, known.unit)


def _parameter(vehicle: Vehicle, values: Values, slug: str, name: str) -> tuple[float, str] | None:
    if (slug, name) not in values:
        return None
    declared = all_effects()[slug].parameters[name]
    default = vehicle.parameters.get(slug, {}).get(name, declared.default)
    return (default, declared.unit) if values[slug, name] == {default} else None


def _words(value: float, unit: str) -> str:
    if math.isinf(value):
        return "no limit"
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"
