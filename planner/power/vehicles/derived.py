"""What a vehicle's file does not give, but other keys of it do, each with its formula.

    derive(tables, derived)       # fills "yaw_inertia" in tables["body"], names it in ``derived``

All values are in SI. A key that the file gives is left alone.
"""

from __future__ import annotations

import math
from typing import Any

DUTY = 0.95
"""Largest duty cycle of a bridge; its upper switches need a pause to recharge."""
WHEEL_WIDTH = 0.6
"""Width over radius of a Mecanum or omni wheel: 152 mm wheels are 45 to 50 mm wide."""
WHEEL_DENSITY = 1000.0
"""kg/m³, mean of rollers, plates and gaps: it gives 0.8 kg for a wheel of 152 mm."""
ROTOR_TIME = 0.009
"""s, mechanical time constant of a motor: its rotor's inertia times resistance over the square of
the torque constant. Motors of 10 to 100 W have 5 to 20 ms whatever their size (Pittman 9233S013
9.1 ms, Faulhaber 3564K024B 10 ms, maxon EC 45 flat 6 to 10 ms)."""
NO_LOAD_HEAT = 0.05
"""W in the windings of a motor that turns without load: its no-load current squared times the
resistance. Motors of 1 to 100 W have 0.04 to 0.09 W whatever their size (Pittman 9233S013 0.050 W,
Faulhaber 3564K024B 0.043 W, maxon EC 45 flat 0.042 and 0.053 W, Pololu 37D with gear 0.087 W)."""
MECANUM_WHEELS = 4
"""Wheels of a robot whose file states no angles."""

Tables = dict[str, dict[str, Any]]


def derive(tables: Tables, derived: dict[str, str]) -> None:
    """Add what follows from other keys.

    Args:
        tables: by name of table, its values in SI; changed.
        derived: by "table.key", the formula; changed.
    """

    def put(table: str, key: str, value: float, formula: str) -> None:
        if tables[table].get(key) is None and math.isfinite(value):
            tables[table][key] = value
            derived[f"{table}.{key}"] = formula

    body, wheels, drive = tables["body"], tables["wheels"], tables["drive"]
    square = body["length"] ** 2 + body["width"] ** 2
    put("body", "yaw_inertia", body["mass"] * square / 12.0, "mass/12·(length² + width²)")
    radius = wheels["radius"]
    if "mass" in wheels:
        put("wheels", "inertia", 0.5 * wheels["mass"] * radius**2, "wheels.mass/2·radius²")
    disc = 0.5 * math.pi * WHEEL_DENSITY * WHEEL_WIDTH * radius**5
    formula = f"disc of {WHEEL_DENSITY:g} kg/m³, {WHEEL_WIDTH:g}·radius wide: π/2·ρ·width·radius⁴"
    put("wheels", "inertia", disc, formula)
    rotor = ROTOR_TIME * drive["torque_constant"] ** 2 / drive["resistance"]
    # A gear beyond the matched one would make the robot accelerate more slowly.
    wheel_count = len(wheels.get("angles", ())) or MECANUM_WHEELS
    matched = body["mass"] * (radius / drive["gear_ratio"]) ** 2 / wheel_count
    formula = f"{ROTOR_TIME:g} s·torque_constant²/resistance, or what acts like mass"
    put("drive", "rotor_inertia", min(rotor, matched), formula)
    if "no_load_current" in drive:
        torque = drive["torque_constant"] * drive["no_load_current"]
        put("drive", "coulomb_torque", torque, "torque_constant·no_load_current")
    torque = drive["torque_constant"] * math.sqrt(NO_LOAD_HEAT / drive["resistance"])
    formula = f"torque_constant·√({NO_LOAD_HEAT:g} W/resistance), a usual no-load current"
    put("drive", "coulomb_torque", torque, formula)
    if "voltage" in tables["battery"]:
        put("limits", "voltage", DUTY * tables["battery"]["voltage"], f"{DUTY:g}·battery.voltage")
