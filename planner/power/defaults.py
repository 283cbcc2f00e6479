"""What a model takes from defaults, because its vehicle's file does not give it.

defaults_in_words(model)      # ["limits.speed = 1 m/s", "battery.capacity = no limit"]
"""

from __future__ import annotations

import math

from planner.power.catalogue import all_effects
from planner.power.model import PowerModel
from planner.power.vehicle_keys import EFFECT_KEYS, NUMBERS


def defaults_in_words(model: PowerModel) -> list[str]:
    """Key, value and unit of every default that the model uses.

    Left out is what is no default any more: a parameter that was fitted since, an effect that the
    model does not have.
    """
    found = {key: _value(model, key) for key in model.vehicle.defaults_taken}
    return [f"{key} = {_words(*value)}" for key, value in found.items() if value is not None]


def _value(model: PowerModel, key: str) -> tuple[float, str] | None:
    """Value and unit; None for what is no default, or a key of another version's model file."""
    table, _, name = key.partition(".")
    if (table, name) in EFFECT_KEYS:
        return _parameter(model, *EFFECT_KEYS[table, name])
    if table == "effects":
        return _parameter(model, *name.partition(".")[::2])
    units = {row[0]: row[1] for row in NUMBERS.get(table, ())}
    vehicle = model.vehicle
    owners = {"wheels": vehicle.layout, "limits": vehicle.limits, "battery": vehicle.battery}
    value = getattr(owners.get(table, vehicle), name, None)
    return None if value is None or name not in units else (value, units[name])


def _parameter(model: PowerModel, slug: str, name: str) -> tuple[float, str] | None:
    values = {
        float(value)
        for (effect, own, _, _), value in zip(model.slots, model.parameters, strict=True)
        if (effect.slug, own) == (slug, name)
    }
    if not values:
        return None
    declared = all_effects()[slug].parameters[name]
    default = model.vehicle.parameters.get(slug, {}).get(name, declared.default)
    return (default, declared.unit) if values == {default} else None


def _words(value: float, unit: str) -> str:
    if math.isinf(value):
        return "no limit"
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"
