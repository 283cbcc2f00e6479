"""Every field of a vehicle's file, its meaning, and the file written with them as comments.

vehicle_fields()                 # in the order of a file; docs/vehicle-file.md is made of them
commented_toml("minibalance")    # what the file gives, and as comments what it leaves out
template()                       # the required keys, to be filled in
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from planner.power.catalogue import all_effects
from planner.power.vehicles.vehicle_file import VEHICLE_FOLDER, load_vehicle
from planner.power.vehicles.vehicle_keys import (
    EFFECT_KEYS,
    GEOMETRY,
    HELPING,
    NUMBERS,
    REQUIRED,
    unit_and_range,
)
from planner.reading import parse_toml

MEANINGS = {
    "body.mass": "without payload",
    "body.length": "along x, over everything that could touch an obstacle",
    "body.width": "along y, over everything that could touch an obstacle",
    "body.com_height": "of the centre of mass above the ground",
    "body.yaw_inertia": "of the whole robot about the vertical",
    "wheels.layout": '"mecanum" or "omni"',
    "wheels.half_wheelbase": "mecanum: centre to axle",
    "wheels.half_track": "mecanum: centre to the middle of a wheel",
    "wheels.base_radius": "omni: centre to the middle of a wheel",
    "wheels.angles": "omni: direction from the centre to each wheel, x is 0, counter-clockwise",
    "wheels.radius": "of a wheel",
    "wheels.roller_angle": "between the axles of roller and wheel: 45° mecanum, 90° omni",
    "wheels.inertia": "of one wheel with its share of the gear",
    "wheels.mass": "of one wheel; gives wheels.inertia",
    "drive.motor": "name of a data sheet, for torque_constant, resistance and what else it has",
    "drive.gear_ratio": "revolutions of the motor for one of the wheel",
    "drive.torque_constant": "of the motor: torque over current, in SI also the back-EMF constant",
    "drive.resistance": "of the motor's winding at 25 °C, terminal to terminal",
    "drive.gear_efficiency": "at rated load",
    "drive.rotor_inertia": "of the motor alone",
    "drive.coulomb_torque": "constant friction of motor and gear, at the motor's shaft",
    "drive.no_load_current": "of the motor; gives drive.coulomb_torque",
    "contact.rolling": "drag of a wheel over its load, 0.01 to 0.04 on hard floor",
    "contact.roller_drag": "drag of a turning roller over its load",
    "contact.roller_viscous": "the same per speed of the roller",
    "contact.traction": "largest force over load before a wheel slips",
    "electronics.power": "computer, sensors and drivers at rest",
    "limits.speed": "largest that the robot may drive",
    "limits.yaw_rate": "largest that the robot may turn with",
    "limits.acceleration": "largest that the robot may accelerate and brake with",
    "limits.current": "of one motor or its driver",
    "limits.voltage": "at one motor, duty cycle included",
    "limits.continuous_torque": "of one motor at its own shaft, for hours",
    "limits.peak_torque": "that the gear takes, at the motor's shaft; default 2·continuous_torque",
    "limits.thermal_time": "over which the torque is averaged",
    "limits.clearance": "between body and obstacles",
    "battery.voltage": "nominal, as the capacity is stated at",
    "battery.resistance": "of cells and wiring",
    "battery.capacity": "energy of a full battery",
}


@dataclass(frozen=True)
class Field:
    """One key of a vehicle's file.

    Attributes:
        table, key: where it stands.
        unit: in SI, "" for text, "1" for a pure number.
        bounds: smallest and largest value; None for text and lists.
        default: value without the key; None where it is required, derived or text.
        required: "yes", "by layout" or "".
        meaning: one phrase.
    """

    table: str
    key: str
    unit: str
    bounds: tuple[float, float] | None
    default: float | None
    required: str
    meaning: str

    @property
    def place(self) -> str:
        """As ``table.key``."""
        return f"{self.table}.{self.key}"


DERIVED_KEYS = (
    *("body.yaw_inertia", "wheels.inertia"),
    *("drive.rotor_inertia", "drive.coulomb_torque"),
)
"""Keys that always follow from required ones."""


@lru_cache(maxsize=1)  # a constant
def vehicle_fields() -> tuple[Field, ...]:
    """All fields but those of [effects], in the order of a file."""
    found = []
    for place, meaning in MEANINGS.items():
        table, key = place.split(".")
        if not _exists(table, key):
            continue
        required = "yes" if (table, key) in REQUIRED else ""
        if any(key in keys for keys in GEOMETRY.values()) and table == "wheels":
            required = "by layout"
        if key in ("layout", "motor"):
            found.append(Field(table, key, "", None, None, required, meaning))
        elif key == "angles":
            found.append(Field(table, key, "rad", None, None, required, meaning))
        else:
            unit, low, high = unit_and_range(table, key)
            default = None if required or place in DERIVED_KEYS else _default(table, key)
            found.append(Field(table, key, unit, (low, high), default, required, meaning))
    return tuple(found)


def _exists(table: str, key: str) -> bool:
    numbers = any(row[0] == key for row in NUMBERS[table])
    words = key in ("layout", "angles", "motor")
    return numbers or words or (table, key) in EFFECT_KEYS or (table, key) in HELPING


def _default(table: str, key: str) -> float | None:
    if (table, key) in EFFECT_KEYS:
        slug, name = EFFECT_KEYS[table, key]
        return all_effects()[slug].parameters[name].default
    given = next((row[2] for row in NUMBERS[table] if row[0] == key), None)
    return None if given is None or math.isnan(given) else given


def commented_toml(name: str) -> str:
    """A vehicle's file with the meaning of every key, and as comments what it does not give.

    Args:
        name: of an installed vehicle, or the path of a file.

    Raises:
        VehicleError: as ``load_vehicle``.
    """
    vehicle = load_vehicle(name)
    installed = VEHICLE_FOLDER / f"{name}.toml"
    document = parse_toml((installed if installed.is_file() else Path(name)).read_bytes())
    lines = [f"name = {_toml(vehicle.name)}", f"title = {_toml(vehicle.title)}"]
    for table, fields in _tables().items():
        given = document.get(table, {})
        lines += ["", f"[{table}]"]
        for field in fields:
            if field.key in given:
                lines.append(f"{field.key} = {_toml(given[field.key])}  # {field.meaning}")
            elif field.required != "by layout":
                formula = vehicle.provenance.derived.get(field.place)
                lines.append(_left_out(field, formula, vehicle.provenance.sources.get(field.place)))
    effects = document.get("effects", {})
    if effects:
        lines += ["", "[effects]"]
        lines += [f"active = {_toml(effects['active'])}"] if "active" in effects else []
        for slug, values in effects.items():
            if slug != "active":
                lines += ["", f"[effects.{slug}]  # {all_effects()[slug].title}"]
                lines += [f"{key} = {_toml(value)}" for key, value in values.items()]
    return "\n".join(lines) + "\n"


def template() -> str:
    """A file to fill in: required keys with values of no robot, all others as comments."""
    lines = [
        "# Each value is a number in SI, or a table that states more of it:",
        '#   mass = { value = 12500, unit = "g", source = "data sheet", uncertainty = 0.02 }',
        "# Fill in what stands without a #. `joulepath vehicles check FILE` says what is odd.",
        'name = "my-robot"',
        'title = "My robot"',
    ]
    examples = {
        "body.mass": "12.0",
        "body.length": "0.6",
        "body.width": "0.5",
        "wheels.layout": '"mecanum"',
        "wheels.half_wheelbase": "0.2",
        "wheels.half_track": "0.2",
        "wheels.radius": "0.05",
        "drive.gear_ratio": "20.0",
        "drive.torque_constant": '{ value = 30.0, unit = "mN·m/A" }',
        "drive.resistance": "1.5",
    }
    omni = {
        "wheels.base_radius": "0.2",
        "wheels.angles": '{ value = [60, 180, 300], unit = "deg" }',
    }
    for table, fields in _tables().items():
        lines += ["", f"[{table}]"]
        for field in fields:
            unit = f" {field.unit}:" if field.unit not in ("", "1") else ""
            if field.place in examples:
                lines.append(f"{field.key} = {examples[field.place]}  #{unit} {field.meaning}")
            elif field.place in omni:
                lines.append(f"# {field.key} = {omni[field.place]}  #{unit} {field.meaning}")
            else:
                lines.append(_left_out(field, None, None))
    return "\n".join(lines) + "\n"


def _tables() -> dict[str, list[Field]]:
    tables: dict[str, list[Field]] = {}
    for field in vehicle_fields():
        tables.setdefault(field.table, []).append(field)
    return tables


def _left_out(field: Field, formula: str | None, source: str | None) -> str:
    """A comment in place of a key that a file does not give."""
    unit = f" {field.unit}:" if field.unit not in ("", "1") else ""
    if formula or source or field.place in DERIVED_KEYS:
        why = formula or (f"from {source}" if source else "derived")
        return f"# {field.key} =  #{unit} {field.meaning}; {why}"
    if field.default is None:
        return f"# {field.key} =  #{unit} {field.meaning}"
    value = "inf" if math.isinf(field.default) else f"{field.default:g}"
    default = "; no limit by default" if value == "inf" else ""
    return f"# {field.key} = {'' if default else value}  #{unit} {field.meaning}{default}"


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(k)} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return repr(value)


def _key(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else json.dumps(name, ensure_ascii=False)
