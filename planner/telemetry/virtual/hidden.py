"""Effects that a virtual robot can hide: names, strengths, and how a strength is scaled.

An effect is named by its slug in the catalogue and its strength by the catalogue's parameter
names, in SI, so that what a diagnosis finds can be compared with the truth. ``OUTSIDE`` are effects
that the catalogue does not have; they load the bus:

    resonance        power · exp(-½·((v - speed)/width)²)         a bump around one speed
    heading_ripple   power · cos(harmonic · heading), in motion    heading: travel in the body frame
    start_decay      power · exp(-t/time_constant)                 t since the run began
    slope_threshold  power_per_rad · (climb - threshold), above it climb: slope along the travel
    yaw_speed        coefficient · |yaw rate| · speed

A strength of zero (``NULL``) leaves the robot exactly as it is without the effect.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError


class Hidden(NamedTuple):
    """Strength of every effect as the equations of motion read it; the defaults are null."""

    wheel_excess: NDArray[np.float64]
    """(n,) relative drag of each wheel, mean taken off."""
    surface_excess: NDArray[np.float64]
    """(labels,) relative drag of each ground."""
    copper_coefficient: float = 0.0
    magnet_coefficient: float = 0.0
    magnet_share: float = 1.0
    exponent: float = 0.0
    gain: float = 0.0
    offset_x: float = 0.0
    offset_y: float = 0.0
    return_change: float = 0.0
    motor_share: float = 1.0
    source_share: float = 1.0
    viscous_torque: float = 0.0
    strength: float = 0.0
    stiction_speed: float = 0.03
    presliding: float = 0.0
    bridge_resistance: float = 0.0
    diode_voltage: float = 0.0
    switching_power: float = 0.0
    energy_per_sample: float = 0.0
    base_rate: float = 10.0
    rate_per_speed: float = 40.0
    top_rate: float = 50.0
    transition_drag: float = 0.0
    ripple_squared: float = 0.0
    preload_squared: float = 0.0
    creep: float = 0.0
    scrub_moment: float = 0.0
    compaction: float = 0.0
    internal_resistance: float = 0.0
    efficiency: float = 1.0
    drag_area: float = 0.0
    air_density: float = 1.2
    shaking_force: float = 0.0
    viscosity: float = 0.0
    temperature_rate: float = 0.03
    drag_torque: float = 0.0
    fading_torque: float = 0.2
    wear_rate: float = 0.0
    resonance_power: float = 0.0
    resonance_speed: float = 0.5
    resonance_width: float = 0.06
    ripple_power: float = 0.0
    ripple_harmonic: float = 3.0
    decay_power: float = 0.0
    decay_time: float = 25.0
    threshold_power: float = 0.0
    threshold_slope: float = 0.05
    yaw_speed_power: float = 0.0


class Strength(NamedTuple):
    """One number of an effect: where it goes, its usual and its null value, does size scale it."""

    field: str
    usual: float
    null: float = 0.0
    scaled: bool = True


def _shape(field: str, usual: float) -> Strength:
    return Strength(field, usual, usual, scaled=False)


CATALOGUE: dict[str, dict[str, Strength]] = {
    "motor_heating": {
        "copper_coefficient": Strength("copper_coefficient", 0.00393),
        "magnet_coefficient": Strength("magnet_coefficient", -0.0020),
        "magnet_share": _shape("magnet_share", 1.0),
    },
    "load_dependent_rolling": {"exponent": Strength("exponent", 0.3)},
    "com_offset": {
        "gain": Strength("gain", 1.0),
        "offset_x": Strength("offset_x", 0.0),
        "offset_y": Strength("offset_y", 0.0),
    },
    "gear_asymmetry": {"return_change": Strength("return_change", -0.1)},
    "regeneration_limit": {
        "motor_share": Strength("motor_share", 0.0, 1.0),
        "source_share": Strength("source_share", 0.0, 1.0),
    },
    "viscous_drag": {"viscous_torque": Strength("viscous_torque", 2.3e-6)},
    "stiction": {
        "strength": Strength("strength", 0.5),
        "stiction_speed": _shape("stiction_speed", 0.03),
    },
    "roller_presliding": {"presliding": Strength("presliding", 0.1)},
    "driver_loss": {
        "bridge_resistance": Strength("bridge_resistance", 0.03),
        "diode_voltage": Strength("diode_voltage", 0.5),
        "switching_power": Strength("switching_power", 0.15),
    },
    "sensor_rate": {
        "energy_per_sample": Strength("energy_per_sample", 0.02),
        "base_rate": _shape("base_rate", 10.0),
        "rate_per_speed": _shape("rate_per_speed", 40.0),
        "top_rate": _shape("top_rate", 50.0),
    },
    "slope_transition": {"transition_drag": Strength("transition_drag", 5.0)},
    "current_ripple": {"ripple_squared": Strength("ripple_squared", 0.25)},
    "wheel_preload": {"preload_squared": Strength("preload_squared", 4.0)},
    "wheel_slip": {"creep": Strength("creep", 0.05)},
    "yaw_scrub": {"scrub_moment": Strength("scrub_moment", 1.0)},
    "surface_rolling": {"excess": Strength("surface_excess", 0.4)},
    "sinkage": {"compaction": Strength("compaction", 0.01)},
    "battery_sag": {"internal_resistance": Strength("internal_resistance", 0.08)},
    "converter_efficiency": {"efficiency": Strength("efficiency", 0.88, 1.0)},
    "air_drag": {
        "drag_area": Strength("drag_area", 0.18),
        "air_density": _shape("air_density", 1.2),
    },
    "vibration": {"shaking_force": Strength("shaking_force", 0.5)},
    "cold_grease": {
        "viscosity": Strength("viscosity", 2e-6),
        "temperature_rate": _shape("temperature_rate", 0.03),
    },
    "light_load_gear_drag": {
        "drag_torque": Strength("drag_torque", 0.02),
        "fading_torque": _shape("fading_torque", 0.2),
    },
    "wear": {"wear_rate": Strength("wear_rate", 1e-4)},
    "wheel_imbalance": {"excess": Strength("wheel_excess", 0.4)},
}

OUTSIDE: dict[str, dict[str, Strength]] = {
    "resonance": {
        "power": Strength("resonance_power", 1.0),
        "speed": _shape("resonance_speed", 0.5),
        "width": _shape("resonance_width", 0.06),
    },
    "heading_ripple": {
        "power": Strength("ripple_power", 1.0),
        "harmonic": _shape("ripple_harmonic", 3.0),
    },
    "start_decay": {
        "power": Strength("decay_power", 2.0),
        "time_constant": _shape("decay_time", 25.0),
    },
    "slope_threshold": {
        "power_per_rad": Strength("threshold_power", 40.0),
        "threshold": _shape("threshold_slope", 0.05),
    },
    "yaw_speed": {"coefficient": Strength("yaw_speed_power", 5.0)},
}

EFFECTS: dict[str, dict[str, Strength]] = {**CATALOGUE, **OUTSIDE}

# Beyond these multiples of a stated strength an effect stops making sense (a share below 0, a
# battery that cannot deliver): sizes that would need more are refused by the caller's calibration.
LARGEST_SCALE = {"regeneration_limit": 1.0, "com_offset": 5.0, "gear_asymmetry": 7.0}

Settings = dict[str, dict[str, Any]]


def check_settings(
    hidden: Mapping[str, Mapping[str, Any]], known: Mapping[str, Mapping[str, Any]], wheels: int
) -> Settings:
    """Settings with every number filled in: from ``hidden``, else ``known``, else the usual one.

    Args:
        hidden: slug → parameter → value; ``size`` is kept as it is.
        known: the vehicle's own values of effects, used where ``hidden`` says nothing.
        wheels: number of wheels, the length of wheel_imbalance's ``excess``.

    Raises:
        InputError: an effect or a parameter that does not exist.
    """
    filled: Settings = {}
    for slug, given in hidden.items():
        if slug not in EFFECTS:
            near = difflib.get_close_matches(slug, EFFECTS, 1)
            hint = f"{near[0]!r}? one of " if near else ""
            raise InputError(
                "hidden", "no such effect", value=slug, accepted=hint + ", ".join(sorted(EFFECTS))
            )
        declared = EFFECTS[slug]
        for name in given:
            if name not in declared and name != "size":
                raise InputError(
                    f"hidden {slug}",
                    "no such parameter",
                    value=name,
                    accepted=", ".join([*declared, "size"]),
                )
        values: dict[str, Any] = {}
        for name, strength in declared.items():
            usual: Any = strength.usual
            if slug == "wheel_imbalance":
                usual = _uneven(wheels, strength.usual)
            elif slug == "surface_rolling":
                usual = {"carpet": strength.usual, "asphalt": -0.25 * strength.usual}
            elif name in known.get(slug, {}):
                usual = known[slug][name]
                if "size" in given and usual == strength.null and strength.scaled:
                    usual = strength.usual  # nothing there that a size could scale
            if given and "size" not in given and strength.scaled and name not in given:
                # A caller who states one strength of an effect means that one alone.
                stated = [n for n in given if n in declared and declared[n].scaled]
                usual = strength.null if stated else usual
            values[name] = given.get(name, usual)
        if "size" in given:
            values["size"] = float(given["size"])
        filled[slug] = values
    return filled


def _uneven(wheels: int, excess: float) -> list[float]:
    """One wheel drags more, one less, the others between: no symmetry of the chassis."""
    pattern = np.linspace(1.0, -0.6, wheels)
    pattern -= pattern.mean()
    return [float(e) for e in excess * pattern / np.abs(pattern).max()]


def scaled(settings: Mapping[str, Any], slug: str, scale: float) -> dict[str, Any]:
    """Settings of one effect with its strengths moved away from null by ``scale``."""
    result = dict(settings)
    for name, strength in EFFECTS[slug].items():
        if not strength.scaled:
            continue
        value = settings[name]
        if name == "efficiency":  # the loss 1/η - 1 is what grows
            result[name] = 1.0 / (1.0 + scale * (1.0 / float(value) - 1.0))
        elif isinstance(value, Mapping):
            result[name] = {label: scale * e for label, e in value.items()}
        elif isinstance(value, Sequence):
            result[name] = [scale * e for e in value]
        else:
            result[name] = strength.null + scale * (float(value) - strength.null)
    return result


def strengths(settings: Settings, wheels: int, surfaces: Sequence[str]) -> Hidden:
    """What the equations of motion read, from settings without ``size``.

    Raises:
        InputError: wheel_imbalance does not give one value a wheel.
    """
    numbers: dict[str, Any] = {
        "wheel_excess": np.zeros(wheels),
        "surface_excess": np.zeros(max(len(surfaces), 1)),
    }
    for slug, values in settings.items():
        for name, strength in EFFECTS[slug].items():
            value = values[name]
            if slug == "surface_rolling":
                value = np.array([float(value.get(s, 0.0)) for s in surfaces] or [0.0])
            elif slug == "wheel_imbalance":
                value = np.asarray(value, dtype=np.float64)
                if value.shape != (wheels,):
                    raise InputError(
                        "hidden wheel_imbalance excess",
                        "not one value a wheel",
                        value=list(value),
                        accepted=f"{wheels} numbers",
                    )
                value = value - value.mean()
            numbers[strength.field] = value if isinstance(value, np.ndarray) else float(value)
    return Hidden(**numbers)
