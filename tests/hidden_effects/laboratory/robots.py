"""Robots that nobody here has seen, and the data sheets that go with them.

    robot = drawn_robot(rng)                # {"body": {"mass": ...}, "wheels": {...}, ...}, SI
    sheet = data_sheet(rng, robot)          # the same with the errors that data sheets have
    write_vehicle(path, sheet)

Masses span a factor of 20. Every other number follows from the mass by usual proportions: a motor
that reaches the top speed at nine tenths of its voltage, copper losses and friction that are some
share of the power on a gentle slope. The layouts are Mecanum, and omni with three and four wheels.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from planner.quantities import STANDARD_GRAVITY

Table = dict[str, dict[str, Any]]

LIGHTEST, HEAVIEST = 2.5, 50.0  # kg
LAYOUTS = ("mecanum", "omni3", "omni4")
GEOMETRY_ERROR = 0.08
"""Largest relative error of mass and lengths in a data sheet."""
OTHER_ERROR = 0.05, 0.20
"""Least and largest relative error of its other numbers."""
VISCOUS_ROLLERS = 1.0 / 3.0
"""Share of robots whose rollers have drag that grows with speed; no data sheet states it."""
_MEASURED_SIGMA, _UNSURE_SIGMA = 0.05, 0.13
"""Standard deviations of such errors."""
_MEASURED = {
    "body": ("mass", "length", "width", "com_height"),
    "wheels": ("half_wheelbase", "half_track", "base_radius", "radius"),
}
_UNSURE = {
    "body": ("yaw_inertia",),
    "wheels": ("inertia",),
    "drive": (
        *("gear_efficiency", "torque_constant"),
        *("resistance", "rotor_inertia", "coulomb_torque"),
    ),
    "contact": ("rolling", "roller_drag"),
    "electronics": ("power",),
    "battery": ("resistance",),
}


def drawn_robot(rng: np.random.Generator) -> Table:
    """Numbers of a random robot, by the tables of a vehicle's file, SI."""
    mass = math.exp(rng.uniform(math.log(LIGHTEST), math.log(HEAVIEST)))
    size = (mass / 12.0) ** (1.0 / 3.0)
    layout = LAYOUTS[int(rng.integers(len(LAYOUTS)))]
    length, width = 0.6 * size * rng.uniform(0.8, 1.3), 0.45 * size * rng.uniform(0.8, 1.2)
    radius = 0.06 * size * rng.uniform(0.75, 1.25)
    if layout == "mecanum":
        wheels: dict[str, Any] = {
            "layout": "mecanum",
            "half_wheelbase": 0.36 * length,
            "half_track": 0.42 * width,
        }
        count = 4
    else:
        width = length
        count = int(layout[-1])
        first = math.pi / count
        angles = [first + 2.0 * math.pi * k / count for k in range(count)]
        wheels = {"layout": "omni", "base_radius": 0.36 * length, "angles": angles}
    top = rng.uniform(0.5, 1.6) * math.sqrt(size)
    voltage = float(rng.choice([12.0, 24.0, 24.0, 36.0])) if mass < 25.0 else 48.0
    gear = float(rng.choice([10.0, 16.0, 19.2, 27.0, 35.0]))
    # A wheel of either kind turns up to 1.45 times as fast as the robot moves.
    fastest = 1.45 * top / radius * gear
    constant = 0.9 * voltage / (1.5 * fastest)
    # Torque and current of one motor on a gentle slope.
    efficiency = rng.uniform(0.70, 0.92)
    torque = mass * STANDARD_GRAVITY * 0.12 * radius / (0.7 * count * gear * efficiency)
    current = torque / constant
    rotating = rng.uniform(0.05, 0.3) * mass * radius**2 / count
    # A stream of its own: what is drawn after it does not depend on it.
    (rollers,) = rng.spawn(1)
    viscous = {}
    if rollers.uniform() < VISCOUS_ROLLERS:
        steady = 0.04 * mass * STANDARD_GRAVITY / count
        viscous["roller_viscous"] = steady * rollers.uniform(0.3, 1.5) / (math.sqrt(2.0) * top)
    return {
        "body": {
            "mass": mass,
            "length": length,
            "width": width,
            "com_height": 0.15 * size * rng.uniform(0.5, 1.3),
            "yaw_inertia": mass / 12.0 * (length**2 + width**2) * rng.uniform(0.8, 1.2),
        },
        "wheels": {**wheels, "radius": radius, "inertia": 0.3 * rotating},
        "drive": {
            "gear_ratio": gear,
            "gear_efficiency": efficiency,
            "torque_constant": constant,
            "resistance": rng.uniform(0.04, 0.15) * voltage / current,
            "rotor_inertia": 0.7 * rotating / gear**2,
            "coulomb_torque": rng.uniform(0.05, 0.2) * torque,
        },
        "contact": {
            "rolling": rng.uniform(0.012, 0.04),
            "roller_drag": rng.uniform(0.015, 0.06),
            "traction": 0.6,
            **viscous,
        },
        "electronics": {"power": rng.uniform(2.0, 9.0) * size**1.5},
        "limits": {
            "speed": top,
            "yaw_rate": rng.uniform(0.8, 2.0) / size,
            "acceleration": rng.uniform(0.5, 1.2),
            "current": 12.0 * current,
            "voltage": voltage,
            "continuous_torque": 3.0 * torque,
        },
        "battery": {
            "voltage": voltage,
            "resistance": 0.02 * voltage / (count * current),
            "capacity": 36000.0 * mass,
        },
    }


def data_sheet(rng: np.random.Generator, robot: Table) -> Table:
    """The robot as its data sheet describes it."""
    sheet = {table: dict(values) for table, values in robot.items()}
    sheet["contact"].pop("roller_viscous", None)
    for table, keys in _MEASURED.items():
        for key in keys:
            if key in sheet[table]:
                sheet[table][key] *= 1.0 + rng.uniform(-GEOMETRY_ERROR, GEOMETRY_ERROR)
    for table, keys in _UNSURE.items():
        for key in keys:
            off = rng.choice([-1.0, 1.0]) * rng.uniform(*OTHER_ERROR)
            sheet[table][key] *= 1.0 + off
    loss = (1.0 - robot["drive"]["gear_efficiency"]) * (1.0 + rng.uniform(-0.3, 0.3))
    sheet["drive"]["gear_efficiency"] = 1.0 - loss
    return sheet


def write_vehicle(path: Path, robot: Table, *, uncertain: bool = False) -> None:
    """Writes a vehicle's file; ``uncertain`` states the standard deviations of its errors."""
    lines = [f'name = "{path.stem}"']
    for table, values in robot.items():
        lines.append(f"[{table}]")
        for key, value in values.items():
            shown = f'"{value}"' if isinstance(value, str) else repr(_plain(value))
            sigma = _MEASURED_SIGMA if key in _MEASURED.get(table, ()) else None
            sigma = _UNSURE_SIGMA if key in _UNSURE.get(table, ()) else sigma
            if uncertain and sigma is not None:
                shown = f"{{ value = {shown}, uncertainty = {sigma} }}"
            lines.append(f"{key} = {shown}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    return [float(v) for v in value] if isinstance(value, list) else float(value)
