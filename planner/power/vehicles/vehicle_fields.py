"""A vehicle's file written with the meanings of its keys as comments.

commented_toml("minibalance")    # what the file gives, and as comments what it leaves out
template()                       # the required keys, to be filled in
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from planner.power.catalogue import all_effects
from planner.power.vehicles.vehicle_file import VEHICLE_FOLDER, load_vehicle
from planner.power.vehicles.vehicle_keys import GEOMETRY, Key, vehicle_keys
from planner.reading import parse_toml


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
    known = vehicle.provenance
    for table, keys in vehicle_keys().items():
        given = document.get(table, {})
        lines += ["", f"[{table}]"]
        for name, key in keys.items():
            if name in given:
                lines.append(f"{name} = {_toml(given[name])}  # {key.meaning}")
            elif key.required != "by layout":
                formula, source = known.derived.get(key.place), known.sources.get(key.place)
                lines.append(_left_out(key, formula, source))
    effects = document.get("effects", {})
    if effects:
        lines += ["", "[effects]"]
        lines += [f"active = {_toml(effects['active'])}"] if "active" in effects else []
        for slug, values in effects.items():
            if slug != "active":
                lines += ["", f"[effects.{slug}]  # {all_effects()[slug].title}"]
                lines += [f"{name} = {_toml(value)}" for name, value in values.items()]
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
    for table, keys in vehicle_keys().items():
        lines += ["", f"[{table}]"]
        for name, key in keys.items():
            other_layout = "# " if name in GEOMETRY["omni"] else ""
            lines.append(
                f"{other_layout}{name} = {key.example}  #{_unit(key)} {key.meaning}"
                if key.example
                else _left_out(key)
            )
    return "\n".join(lines) + "\n"


def _unit(key: Key) -> str:
    return f" {key.unit}:" if key.unit not in ("", "1") else ""


def _left_out(key: Key, formula: str | None = None, source: str | None = None) -> str:
    """A comment in place of a key that a file does not give."""
    meaning = f"#{_unit(key)} {key.meaning}"
    if formula or source or key.derived:
        why = formula or (f"from {source}" if source else "derived")
        return f"# {key.name} =  {meaning}; {why}"
    if key.default is None or math.isnan(key.default):
        return f"# {key.name} =  {meaning}"
    if math.isinf(key.default):
        return f"# {key.name} =   {meaning}; no limit by default"
    return f"# {key.name} = {key.default:g}  {meaning}"


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_name(k)} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return repr(value)


def _name(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else json.dumps(name, ensure_ascii=False)
