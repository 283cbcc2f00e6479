"""The keys of a vehicle's TOML file: unit, range, default, and which of them are required."""

from __future__ import annotations

import math

from planner.power.catalogue import all_effects

# Keys that are parameters of an effect of the base model.
EFFECT_KEYS: dict[tuple[str, str], tuple[str, str]] = {
    ("body", "yaw_inertia"): ("inertia", "yaw_inertia"),
    ("wheels", "inertia"): ("inertia", "wheel_inertia"),
    ("drive", "rotor_inertia"): ("inertia", "rotor_inertia"),
    ("drive", "gear_efficiency"): ("gear_loss", "efficiency"),
    ("drive", "torque_constant"): ("copper_loss", "torque_constant"),
    ("drive", "resistance"): ("copper_loss", "resistance"),
    ("drive", "coulomb_torque"): ("coulomb_drag", "coulomb_torque"),
    ("contact", "rolling"): ("wheel_rolling", "rolling"),
    ("contact", "roller_drag"): ("roller_drag", "roller"),
    ("contact", "roller_viscous"): ("roller_drag", "roller_viscous"),
    ("electronics", "power"): ("electronics", "power"),
}

# Other numbers: key, unit, default (None = required), smallest, largest.
NUMBERS: dict[str, tuple[tuple[str, str, float | None, float, float], ...]] = {
    "body": (
        ("mass", "kg", None, 1e-3, 1e5),
        ("length", "m", None, 1e-2, 50.0),
        ("width", "m", None, 1e-2, 50.0),
        ("com_height", "m", 0.1, 0.0, 10.0),
    ),
    "wheels": (
        ("half_wheelbase", "m", None, 1e-3, 20.0),
        ("half_track", "m", None, 1e-3, 20.0),
        ("base_radius", "m", None, 1e-3, 20.0),
        ("radius", "m", None, 1e-3, 5.0),
        ("roller_angle", "rad", math.nan, 0.1, math.pi / 2),
    ),
    "drive": (("gear_ratio", "1", None, 1e-2, 1e5),),
    "contact": (("traction", "1", 0.6, 1e-2, 5.0),),
    "limits": (
        ("speed", "m/s", 1.0, 1e-2, 100.0),
        ("yaw_rate", "rad/s", 1.0, 1e-2, 100.0),
        ("acceleration", "m/s²", 1.0, 1e-2, 100.0),
        ("current", "A", math.inf, 1e-3, 1e6),
        ("voltage", "V", math.inf, 1e-1, 1e5),
        ("continuous_torque", "N·m", math.inf, 1e-6, 1e6),
        # Not a number: twice the continuous torque.
        ("peak_torque", "N·m", math.nan, 1e-6, 1e6),
        ("thermal_time", "s", 60.0, 1e-2, 1e5),
        ("clearance", "m", 0.05, 0.0, 10.0),
    ),
    "battery": (
        ("voltage", "V", 24.0, 1.0, 1e5),
        ("resistance", "Ω", 0.0, 0.0, 100.0),
        ("capacity", "J", math.inf, 1.0, 1e12),
    ),
    "electronics": (),
}

# Keys that only serve to derive others: key → unit, smallest, largest.
HELPING: dict[tuple[str, str], tuple[str, float, float]] = {
    ("wheels", "mass"): ("kg", 1e-4, 1e3),
    ("drive", "no_load_current"): ("A", 0.0, 1e3),
}
# Keys that hold no number.
WORDS = {"wheels": ("layout", "angles"), "drive": ("motor",)}

# Without these a file would describe another robot: a default motor is another robot's motor.
REQUIRED = (
    *(("body", "mass"), ("body", "length"), ("body", "width")),
    *(("wheels", "layout"), ("wheels", "radius")),
    *(("drive", "gear_ratio"), ("drive", "torque_constant"), ("drive", "resistance")),
)
# Required too, by the layout.
GEOMETRY = {"mecanum": ("half_wheelbase", "half_track"), "omni": ("base_radius", "angles")}


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
    """A unit, and others that convert to it, in words."""
    name = "no unit" if unit == "1" else unit
    others = _USUAL_UNITS.get(unit)
    return f"{name}, or a unit that converts to it" + (f" such as {others}" if others else "")


def known_keys(table: str) -> set[str]:
    """Keys that a table of a vehicle's file may hold."""
    owned = {key for owner, key in (*EFFECT_KEYS, *HELPING) if owner == table}
    return owned | {key for key, *_ in NUMBERS[table]} | set(WORDS.get(table, ()))


def unit_and_range(table: str, key: str) -> tuple[str, float, float]:
    """SI unit, smallest and largest value of a key that holds a number."""
    if (table, key) in HELPING:
        return HELPING[table, key]
    if (table, key) in EFFECT_KEYS:
        slug, name = EFFECT_KEYS[table, key]
        parameter = all_effects()[slug].parameters[name]
        return (parameter.unit, *parameter.bounds)
    unit, _, low, high = next(row[1:5] for row in NUMBERS[table] if row[0] == key)
    return unit, low, high


def what_fits(table: str, key: str) -> str:
    """What a required key may hold, in words."""
    if key == "layout":
        return ", or ".join(f'"{kind}" with {a} and {b}' for kind, (a, b) in GEOMETRY.items())
    if key == "angles":
        return "three or more angles in rad"
    unit, low, high = unit_and_range(table, key)
    return between(low, high, unit)


def between(low: float, high: float, unit: str) -> str:
    """A range in words; the unit "1" is that of a pure number."""
    return f"{low:g} to {high:g}" + (f" {unit}" if unit != "1" else "")
