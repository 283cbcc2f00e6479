"""A vehicle as numbers in a saved model, so that the model needs no file of its vehicle.

    document = vehicle_document(vehicle)          # strict JSON: null stands for "no limit"
    vehicle = vehicle_from_document(document)     # the same numbers to the last bit

Wheels are written as the table that the power kernel reads (planner.power.kinematics), one row a
wheel: whatever layout it was made from, it comes back as it was.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from planner.power.kinematics import COLUMNS, WheelLayout
from planner.power.vehicle import Battery, Limits, Vehicle
from planner.reading import finite_number

_NUMBERS = ("mass", "length", "width", "com_height", "gear_ratio", "traction")
_LIMITS = ("speed", "yaw_rate", "acceleration", "current", "voltage", "continuous_torque")


def vehicle_document(vehicle: Vehicle) -> dict[str, Any]:
    """Everything about a vehicle, ready for strict JSON."""
    return {
        "name": vehicle.name,
        "title": vehicle.title,
        **{key: getattr(vehicle, key) for key in _NUMBERS},
        "wheels": {"radius": vehicle.layout.radius, "table": vehicle.layout.table.tolist()},
        "limits": _finite_or_null(asdict(vehicle.limits)),
        "battery": _finite_or_null(asdict(vehicle.battery)),
        "parameters": {slug: dict(values) for slug, values in vehicle.parameters.items()},
        "active": list(vehicle.active),
        "sources": dict(vehicle.sources),
        "defaults_taken": list(vehicle.defaults_taken),
    }


def vehicle_from_document(document: Mapping[str, Any]) -> Vehicle:
    """The vehicle that ``vehicle_document`` wrote.

    Raises:
        KeyError, TypeError, ValueError: something is missing or is no such number.
    """
    table = np.array(document["wheels"]["table"], float)
    if table.ndim != 2 or len(table) < 3 or table.shape[1] != COLUMNS:
        raise ValueError(f"wheels: three or more rows of {COLUMNS} numbers")
    if not np.isfinite(table).all():
        raise ValueError("wheels: not finite")
    limits, battery = document["limits"], document["battery"]
    return Vehicle(
        name=_text(document["name"]),
        title=_text(document["title"]),
        **{key: _size(document[key], key) for key in _NUMBERS if key != "com_height"},
        com_height=_not_negative(document["com_height"], "com_height"),
        layout=WheelLayout(table, _size(document["wheels"]["radius"], "radius")),
        limits=Limits(
            **{key: _positive(_number_or_inf(limits[key]), key) for key in _LIMITS},
            clearance=_not_negative(limits["clearance"], "clearance"),
        ),
        battery=Battery(
            voltage=_size(battery["voltage"], "voltage"),
            resistance=_not_negative(battery["resistance"], "resistance"),
            capacity=_positive(_number_or_inf(battery["capacity"]), "capacity"),
        ),
        parameters={
            slug: {name: _parameter(value) for name, value in values.items()}
            for slug, values in document["parameters"].items()
        },
        active=tuple(map(_text, document["active"])),
        sources={_text(k): _text(v) for k, v in document["sources"].items()},
        defaults_taken=tuple(map(_text, document["defaults_taken"])),
    )


def _finite_or_null(values: Mapping[str, float]) -> dict[str, float | None]:
    return {key: value if math.isfinite(value) else None for key, value in values.items()}


def _parameter(value: Any) -> Any:
    """A number, or one for every wheel (a list) or every surface label (a mapping)."""
    if isinstance(value, list):
        return [_parameter(element) for element in value]
    if isinstance(value, Mapping):
        return {_text(label): _parameter(element) for label, element in value.items()}
    number = finite_number(value)
    if number is None:
        raise ValueError("a parameter that is not a finite number")
    return number


def _number_or_inf(value: Any) -> float:
    return math.inf if value is None else float(value)


def _positive(value: Any, key: str) -> float:
    number = float(value)
    if not number > 0.0:
        raise ValueError(f"{key}: {value!r} is not above 0")
    return number


def _size(value: Any, key: str) -> float:
    number = _positive(value, key)
    if math.isinf(number):
        raise ValueError(f"{key}: not finite")
    return number


def _not_negative(value: Any, key: str) -> float:
    number = float(value)
    if not 0.0 <= number < math.inf:
        raise ValueError(f"{key}: {value!r} is not a number of 0 or more")
    return number


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is not text")
    return value
