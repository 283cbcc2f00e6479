"""Effects that a virtual robot can hide: names, strengths, and how a strength is scaled.

An effect is named by its slug in the catalogue and its strength by the catalogue's parameter
names, in SI, so that what a diagnosis finds can be compared with the truth. ``OUTSIDE`` are effects
that the catalogue does not have; they load the bus:

    resonance        power · exp(-½·((v - speed)/width)²)         a bump around one speed
    heading_ripple   power · cos(harmonic · heading), in motion    heading: travel in the body frame
    start_decay      power · exp(-t/time_constant)                 t since the run began
    slope_threshold  power_per_rad · (climb - threshold), above it climb: slope along the travel
    yaw_speed        coefficient · |yaw rate| · speed

A strength of zero leaves the robot exactly as it is without the effect.

The robot has equations of its own for the effects in ``EQUATIONS``. Any other effect of the
catalogue acts by its own formula (planner.telemetry.virtual.by_formula), so that a new effect needs
no edit here.
"""

from __future__ import annotations

import difflib
from collections import namedtuple
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Array
from planner.errors import InputError
from planner.power.catalogue import all_effects, find_effect
from planner.power.effect import Effect


class Strength(NamedTuple):
    """One number of an effect: where it goes, its usual and its null value, does size scale it."""

    field: str
    usual: float
    null: float = 0.0
    scaled: bool = True
    per: str | None = None
    """"wheel" or "surface" where each has a value of its own."""


EQUATIONS = frozenset(
    (
        *("motor_heating", "load_dependent_rolling", "com_offset", "gear_asymmetry"),
        *("regeneration_limit", "viscous_drag", "stiction", "roller_presliding", "driver_loss"),
        *("sensor_rate", "slope_transition", "current_ripple", "wheel_preload", "wheel_slip"),
        *("yaw_scrub", "surface_rolling", "sinkage", "battery_sag", "converter_efficiency"),
        *("air_drag", "vibration", "cold_grease", "light_load_gear_drag", "wear"),
        "wheel_imbalance",
    )
)
"""Effects that dynamics.py and motors.py have equations for; their parameters are in ``Hidden``."""
_FIELDS = {"surface_rolling": "surface_excess", "wheel_imbalance": "wheel_excess"}
_WITHOUT = ("open_circuit_voltage", "offset_x_squared", "offset_y_squared")
"""Parameters of such effects that the robot's equations do without."""


def _strengths_of(effect: type[Effect]) -> dict[str, Strength]:
    """Strengths of an effect of the catalogue, from its declaration."""
    found = {}
    for name, own in effect.parameters.items():
        usual = own.in_virtual_robot
        null = usual if own.null is None else own.null
        field = _FIELDS.get(effect.slug, name)
        if effect.slug not in EQUATIONS or name not in _WITHOUT:
            found[name] = Strength(field, usual, null, own.null is not None, own.per)
    return found


CATALOGUE: dict[str, dict[str, Strength]] = {
    slug: _strengths_of(effect) for slug, effect in all_effects().items() if not effect.base
}

_OUTSIDE = {
    "resonance": {"power": 1.0, "speed": 0.5, "width": 0.06},
    "heading_ripple": {"power": 1.0, "harmonic": 3.0},
    "start_decay": {"power": 2.0, "time_constant": 25.0},
    "slope_threshold": {"power_per_rad": 40.0, "threshold": 0.05},
    "yaw_speed": {"coefficient": 5.0},
}
"""Usual values of their parameters. The first is the strength, the others give the shape."""
OUTSIDE: dict[str, dict[str, Strength]] = {
    slug: {
        name: Strength(f"{slug}_{name}", value, value if place else 0.0, place == 0)
        for place, (name, value) in enumerate(given.items())
    }
    for slug, given in _OUTSIDE.items()
}

EFFECTS: dict[str, dict[str, Strength]] = {**CATALOGUE, **OUTSIDE}

_READ = {
    strength.field: strength
    for slug in (*sorted(EQUATIONS), *OUTSIDE)
    for strength in EFFECTS[slug].values()
}
_FIRST = sorted(_READ, key=lambda field: _READ[field].per is None)  # those without a default
_NULL = [strength.null for strength in _READ.values() if strength.per is None]
Hidden: Any = namedtuple("Hidden", _FIRST, defaults=_NULL)  # type: ignore[misc]  # not literal
"""Strengths as the equations of motion read them; the defaults are null. ``wheel_excess`` is (n,),
the relative drag of each wheel, mean taken off; ``surface_excess`` (labels,), of each ground."""

_LARGEST_SCALE = {"regeneration_limit": 1.0, "com_offset": 5.0, "gear_asymmetry": 7.0}

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
            if strength.per == "wheel":
                usual = _uneven(wheels, strength.usual)
            elif strength.per == "surface":
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


def largest_scale(slug: str) -> float:
    """Multiple of an effect's usual strengths beyond which no robot has it; infinite for most.

    Beyond it a share falls below 0, or a gear locks itself. An effect that acts by its formula
    stays within the bounds of its parameters.
    """
    if slug not in CATALOGUE or slug in EQUATIONS:
        return _LARGEST_SCALE.get(slug, np.inf)
    reach = [np.inf]
    for name, strength in CATALOGUE[slug].items():
        low, high = find_effect(slug).parameters[name].bounds
        away = strength.usual - strength.null
        if away != 0.0:
            reach.append(((high if away > 0.0 else low) - strength.null) / away)
    return float(min(reach))


def strengths(settings: Settings, wheels: int, surfaces: Sequence[str]) -> Any:
    """The ``Hidden`` that the equations of motion read, from settings without ``size``.

    Raises:
        InputError: wheel_imbalance does not give one value a wheel.
    """
    numbers: dict[str, Any] = {
        "wheel_excess": np.zeros(wheels),
        "surface_excess": np.zeros(max(len(surfaces), 1)),
    }
    for slug, values in settings.items():
        for name, strength in EFFECTS[slug].items():
            if slug in EQUATIONS or slug in OUTSIDE:
                value = by_element(slug, name, values[name], wheels, surfaces)
                numbers[strength.field] = value if strength.per else float(value[0])
    return Hidden(**numbers)


def by_element(slug: str, name: str, value: Any, wheels: int, surfaces: Sequence[str]) -> Array:
    """A strength as an array: of one number, of one for each surface, or for each wheel less mean.

    Raises:
        InputError: it does not give one value a wheel.
    """
    per = EFFECTS[slug][name].per
    if per == "surface":
        return np.array([float(value.get(s, 0.0)) for s in surfaces] or [0.0])
    found: Array = np.atleast_1d(np.asarray(value, dtype=np.float64))
    if per is None:
        return found
    if found.shape != (wheels,):
        raise InputError(
            f"hidden {slug} {name}",
            "not one value a wheel",
            value=found.tolist(),
            accepted=f"{wheels} numbers",
        )
    return np.asarray(found - found.mean(), dtype=np.float64)
