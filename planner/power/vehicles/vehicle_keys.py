"""The keys of a vehicle's file: units, ranges, defaults, meanings, and which effect has them.

    key = vehicle_keys()["body"]["mass"]
    key.unit, key.bounds                # "kg", (0.001, 100000.0)

They are declared in format/keys.toml.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from planner.power.catalogue import all_effects
from planner.reading import parse_toml

_DECLARED = Path(__file__).parent / "format" / "keys.toml"

GEOMETRY = {"mecanum": ("half_wheelbase", "half_track"), "omni": ("base_radius", "angles")}
"""Required by the layout."""


@dataclass(frozen=True)
class Key:
    """One key of the file.

    Attributes:
        table, name: its place.
        meaning: in words.
        unit: SI; "" for text.
        bounds: smallest and largest; None for what is not a number.
        default: None where there is none, NaN where it follows from other values.
        required: "yes", "by layout", or "". Without these a file would describe another robot: a
            default motor is another robot's motor.
        derived: whether other keys give it where the file does not.
        effect: slug of the effect of the base model and name of its parameter that the key is.
        example: as the file to fill in has it.
    """

    table: str
    name: str
    meaning: str
    unit: str = ""
    bounds: tuple[float, float] | None = None
    default: float | None = None
    required: str = ""
    derived: bool = False
    effect: tuple[str, str] | None = None
    example: str = ""

    @property
    def place(self) -> str:
        """As the reader names the key: "body.mass"."""
        return f"{self.table}.{self.name}"

    @property
    def range(self) -> tuple[float, float]:
        """The bounds of a number."""
        assert self.bounds is not None
        return self.bounds

    @property
    def accepted(self) -> str:
        """What it takes, in words."""
        if self.bounds is not None:
            return between(*self.bounds, self.unit)
        if self.unit:
            return f"three or more angles in {self.unit}"
        return ", or ".join(f'"{kind}" with {a} and {b}' for kind, (a, b) in GEOMETRY.items())


@lru_cache(maxsize=1)  # a constant
def vehicle_keys() -> dict[str, dict[str, Key]]:
    """Every key by table and name, in the order of a file."""
    document = parse_toml(_DECLARED.read_bytes())
    return {
        table: {name: _key(table, name, entry) for name, entry in entries.items()}
        for table, entries in document.items()
    }


def every_key() -> Iterator[Key]:
    """The keys of all tables, in the order of a file."""
    return (key for keys in vehicle_keys().values() for key in keys.values())


def _key(table: str, name: str, entry: dict[str, Any]) -> Key:
    if "bounds" in entry:
        entry["bounds"] = tuple(entry["bounds"])
    if "effect" in entry:
        slug, parameter = entry["effect"].split(".")
        own = all_effects()[slug].parameters[parameter]
        entry |= {"unit": own.unit, "bounds": own.bounds, "default": own.default}
        entry["effect"] = slug, parameter
    return Key(table, name, **entry)


# Other units that data sheets use, for messages and documents.
_USUAL_UNITS = {
    "kg": "g or lb",
    "m": "mm, cm or inch",
    "rad": "deg",
    "kg·m²": "g·cm²",
    "N·m/A": "mN·m/A, V·s/rad, mV/rpm, or rpm/V of a speed constant",
    "Ω": "mΩ",
    "N·m": "mN·m, N·cm or kgf·cm",
    "N·m·s": "mN·m·s",
    "A": "mA",
    "V": "mV",
    "W": "mW or kW",
    "J": "Wh, or Ah beside battery.voltage",
    "m/s": "km/h or mm/s",
    "rad/s": "deg/s or rpm",
    "m/s²": "cm/s²",
    "1": "%",
}


def accepted_units(unit: str) -> str:
    """What may be given where this SI unit is expected, in words."""
    name = "no unit" if unit == "1" else unit
    others = _USUAL_UNITS.get(unit)
    return f"{name}, or a unit that converts to it" + (f" such as {others}" if others else "")


def between(low: float, high: float, unit: str) -> str:
    """A range in words."""
    return f"{low:g} to {high:g}" + (f" {unit}" if unit != "1" else "")
