"""The parameters of a custom effect, and what only running its formula shows.

``read_parameters`` checks names, units, bounds and null values; ``check_values`` runs the formula
on states all over the possible range: it must vanish at the null values, be finite, and act at all.
"""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.errors import ModelError
from planner.power.effect import HOOKS, Effect, Parameter
from planner.power.formulas.dimensions import Dimension, parse_unit
from planner.power.formulas.formula import FUNCTIONS, Formula
from planner.quantities import QUANTITIES

MAX_PARAMETERS = 8
"""Parameters of one formula: a log cannot identify more."""
_EXTRA = {"speed": "m/s", "heading": "rad"}
QUANTITY_BY_NAME = {q.name: q for q in QUANTITIES if q.name != "surface"}
NAMES: dict[str, Dimension] = {
    **{name: parse_unit(quantity.unit) for name, quantity in QUANTITY_BY_NAME.items()},
    **{name: parse_unit(unit) for name, unit in _EXTRA.items()},
}
"""Dimension of every name that a formula may use beside its parameters."""

IDENTIFIER = re.compile(r"[a-z][a-z0-9_]{0,39}")
_PARAMETER_KEYS = ("unit", "bounds", "null", "default", "fitted", "doc", "grid", "spread")
_PROBES = 64
"""Number of random states on which a formula is run before it is accepted."""


def read_parameters(declared: Any, field: str) -> tuple[dict[str, Parameter], dict[str, Dimension]]:
    """Declarations and dimensions of a custom effect's parameters by name.

    Raises:
        ModelError: one of them cannot be used.
    """
    if not isinstance(declared, dict) or not 1 <= len(declared) <= MAX_PARAMETERS:
        raise ModelError(
            f"{field}: parameters",
            "are missing or too many",
            accepted=f"1 to {MAX_PARAMETERS} parameters by name",
        )
    parameters: dict[str, Parameter] = {}
    dimensions: dict[str, Dimension] = {}
    for name, entry in declared.items():
        where = f"{field}: {name}"
        if not IDENTIFIER.fullmatch(name) or keyword.iskeyword(name):
            raise ModelError(where, "not a name for a parameter", accepted="lower case letters")
        if name in NAMES or name in FUNCTIONS or name in HOOKS or name in ("surface", *_TAKEN):
            raise ModelError(where, "this name has another meaning", accepted="another name")
        parameters[name] = _parameter(entry, where)
        dimensions[name] = parse_unit(parameters[name].unit, f"{where}: unit")
    if all(parameter.null is None for parameter in parameters.values()):
        raise ModelError(
            f"{field}: parameters",
            "none has a null value, at which the effect is absent",
            accepted='"null": 0 in the parameter that scales the effect',
        )
    return parameters, dimensions


_TAKEN = frozenset((*Effect.__annotations__, *vars(Effect)))
"""Attributes of an effect that a parameter must not hide."""


def _parameter(entry: Any, where: str) -> Parameter:
    if not isinstance(entry, dict) or not {"unit", "bounds"} <= set(entry):
        raise ModelError(where, "needs unit and bounds", accepted=", ".join(_PARAMETER_KEYS))
    for key in entry:
        if key not in _PARAMETER_KEYS:
            raise ModelError(where, "no such key", value=key, accepted=", ".join(_PARAMETER_KEYS))
    bounds = entry["bounds"]
    if not isinstance(bounds, list) or len(bounds) != 2:
        raise ModelError(f"{where}: bounds", "not a range", value=bounds, accepted="[least, most]")
    low, high = (_number(value, f"{where}: bounds") for value in bounds)
    if not low < high:
        raise ModelError(f"{where}: bounds", "not a range", value=bounds, accepted="[least, most]")
    null = entry.get("null")
    values = {"null": null, "default": entry.get("default")}
    for key, value in values.items():
        if value is not None and not low <= _number(value, f"{where}: {key}") <= high:
            raise ModelError(
                f"{where}: {key}", "out of its bounds", value=value, accepted=f"{low:g} to {high:g}"
            )
    default = values["default"]
    if default is None:
        default = 0.5 * (low + high) if null is None else null
    grid = entry.get("grid", [])
    fitted = entry.get("fitted", True)
    doc = entry.get("doc", "")
    if not isinstance(grid, list) or not isinstance(fitted, bool) or not isinstance(doc, str):
        raise ModelError(where, "grid, fitted or doc cannot be used", accepted="list, bool, text")
    return Parameter(
        unit=str(entry["unit"]),
        default=float(default),
        bounds=(low, high),
        doc=doc[:300],
        null=None if null is None else float(null),
        fitted=fitted,
        grid=tuple(_number(value, f"{where}: grid") for value in grid),
        spread=_number(entry.get("spread", 0.15), f"{where}: spread"),
    )


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1e15:
        raise ModelError(where, "not a number", value=value, accepted="a finite number")
    return float(value)


@lru_cache(maxsize=1)  # constants
def _probes() -> dict[str, Array]:
    """States over the range of all quantities; the first stands still on flat ground."""
    random = np.random.default_rng(7)
    spread = {
        "gravity_normal": (9.0, 9.81),
        "payload": (0.0, 20.0),
        "motor_temp": (-10.0, 90.0),
        "ambient_temp": (-10.0, 40.0),
        "battery_voltage": (10.0, 50.0),
        "rolling_factor": (0.5, 3.0),
        "traction_factor": (0.3, 1.0),
        "sensor_rate": (0.0, 100.0),
        "slope_rate": (0.0, 1.0),
        "odometer": (0.0, 1e4),
        "time_since_start": (0.0, 3600.0),
        "com_x": (-0.1, 0.1),
        "com_y": (-0.1, 0.1),
    }
    values = {
        name: random.uniform(*spread.get(name, (-2.0, 2.0)), _PROBES) for name in QUANTITY_BY_NAME
    }
    for name, quantity in QUANTITY_BY_NAME.items():
        values[name][0] = 0.0 if math.isnan(quantity.default) else quantity.default
    values["speed"] = np.hypot(values["vx"], values["vy"])
    values["heading"] = np.arctan2(values["vy"], values["vx"])
    return values


def check_values(formula: Formula, parameters: Mapping[str, Parameter], field: str) -> None:
    """Run a formula: 0 at the null values, finite, and not 0 always.

    Raises:
        ModelError: it is not so.
    """
    probes = _probes()
    null = {
        name: parameter.default if parameter.null is None else parameter.null
        for name, parameter in parameters.items()
    }
    away = {
        name: parameter.default
        if parameter.null is None
        else parameter.null + 0.1 * _farther(parameter)
        for name, parameter in parameters.items()
    }
    default = {name: parameter.default for name, parameter in parameters.items()}
    shapes = [
        {n: p.bounds[side] for n, p in parameters.items() if p.null is None} for side in (0, 1)
    ]
    moving = False
    for values in (default, away, *(away | shape for shape in shapes)):
        result = np.broadcast_to(formula.evaluate(probes | values), _PROBES)
        wrong = np.flatnonzero(~np.isfinite(result))
        if len(wrong):
            where = "at standstill" if wrong[0] == 0 else "in states that can occur"
            raise ModelError(
                f"{field}: formula",
                f"has no finite value {where}",
                value=formula.text,
                accepted="a formula, and bounds of its parameters, without division by what can "
                "be 0",
            )
        moving = moving or bool(np.any(result != 0.0))
    if not moving:
        raise ModelError(
            f"{field}: formula", "is always 0", value=formula.text, accepted="a formula that acts"
        )
    for values in (null, *(null | shape for shape in shapes)):
        result = np.broadcast_to(formula.evaluate(probes | values), _PROBES)
        wrong = np.flatnonzero(~(result == 0.0))
        if len(wrong):
            raise ModelError(
                f"{field}: formula",
                "does not vanish at the null values of its parameters",
                value=float(result[wrong[0]]),
                accepted="a formula that is 0 there for every state of the robot",
            )


def _farther(parameter: Parameter) -> float:
    low, high = parameter.bounds
    null = parameter.null or 0.0
    return high - null if high - null >= null - low else low - null
