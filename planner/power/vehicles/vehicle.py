"""A vehicle: geometry, limits and the parameters that its source knows, in SI.

    vehicle = load_vehicle("minibalance")        # from its TOML file
    document = vehicle.document()                # strict JSON: null stands for "no limit"
    Vehicle.from_document(document)              # the same numbers to the last bit

A saved model holds such a document, so that it needs no file of its vehicle. Wheels are written as
the table that the power kernel reads (planner.power.kinematics), one row a wheel: whatever layout
it was made from, it comes back as it was.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from planner.power.kinematics import COLUMNS, WheelLayout, X, Y
from planner.power.vehicles.vehicle_keys import between, every_key, vehicle_keys
from planner.reading import finite_number

PEAK_SHARE = 2.0
"""Largest torque over the continuous one, where a vehicle does not give it: a motor of this size
delivers several times its rated torque until its magnets weaken."""
_ADDED = ("limits.peak_torque", "limits.thermal_time")
_NUMBERS = ("mass", "length", "width", "com_height", "gear_ratio", "traction")


@dataclass(frozen=True)
class Limits:
    """What the vehicle must not exceed; SI.

    Torques are those that the gear takes from each motor, without the motor's own drag: at every
    moment at most ``peak_torque``, and over every ``thermal_time`` at most ``continuous_torque``
    as a root mean square.
    """

    speed: float
    yaw_rate: float
    acceleration: float
    current: float
    voltage: float
    continuous_torque: float
    peak_torque: float
    thermal_time: float
    clearance: float


@dataclass(frozen=True)
class Battery:
    """What feeds the vehicle: V, Ω, J."""

    voltage: float
    resistance: float
    capacity: float


@dataclass(frozen=True)
class Provenance:
    """Where the values of a vehicle come from.

    Attributes:
        sources: by "table.key", where a value comes from.
        defaults_taken: keys that the file does not give.
        uncertainties: by "table.key", the standard deviation that the file states for a value, as
            a share of it.
        derived: by "table.key", the formula of a value that other keys give.
        motor: name of the data sheet that the file names, "" without one.
        without_source: keys whose values name no source.
    """

    sources: Mapping[str, str] = field(default_factory=dict)
    defaults_taken: tuple[str, ...] = ()
    uncertainties: Mapping[str, float] = field(default_factory=dict)
    derived: Mapping[str, str] = field(default_factory=dict)
    motor: str = ""
    without_source: tuple[str, ...] = ()


@dataclass(frozen=True)
class Vehicle:
    """A robot's geometry, limits and the values of every effect that its source knows.

    Attributes:
        parameters: by effect slug and parameter name; a list for one value a wheel, a mapping for
            one value a surface label.
        active: slugs of the effects that planning uses, base model included.
        provenance: where the values come from.
    """

    name: str
    title: str
    mass: float
    length: float
    width: float
    com_height: float
    layout: WheelLayout
    gear_ratio: float
    traction: float
    limits: Limits
    battery: Battery
    parameters: Mapping[str, Mapping[str, Any]]
    active: tuple[str, ...]
    provenance: Provenance = field(default_factory=Provenance)

    @property
    def half_footprint(self) -> float:
        """Half of what its wheels span, m, as a mean of both directions."""
        table = self.layout.table
        return 0.5 * float(np.abs(table[:, X]).max() + np.abs(table[:, Y]).max())

    @property
    def step_height(self) -> float:
        """m; half a wheel's radius is the largest step that it climbs without a run."""
        return 0.5 * self.layout.radius

    def uncertainty_of(self, slug: str, name: str) -> float | None:
        """Standard deviation of an effect's parameter as a share of it; None where none is stated.

        Args:
            slug: of the effect, "copper_loss".
            name: of its parameter, "resistance".
        """
        places = [key.place for key in every_key() if key.effect == (slug, name)]
        stated = (
            self.provenance.uncertainties.get(key) for key in (*places, f"effects.{slug}.{name}")
        )
        return next((share for share in stated if share is not None), None)

    def document(self) -> dict[str, Any]:
        """Everything about the vehicle, ready for strict JSON."""
        known = asdict(self.provenance)
        return {
            "name": self.name,
            "title": self.title,
            **{key: getattr(self, key) for key in _NUMBERS},
            "wheels": {"radius": self.layout.radius, "table": self.layout.table.tolist()},
            "limits": _finite_or_null(asdict(self.limits)),
            "battery": _finite_or_null(asdict(self.battery)),
            "parameters": {slug: dict(values) for slug, values in self.parameters.items()},
            "active": list(self.active),
            **{k: list(v) if isinstance(v, tuple) else v for k, v in known.items()},
        }

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Vehicle:
        """The vehicle that ``document`` wrote.

        Raises:
            KeyError, TypeError, ValueError: something is missing or is not such a number.
        """
        table = np.array(document["wheels"]["table"], float)
        if table.ndim != 2 or len(table) < 3 or table.shape[1] != COLUMNS:
            raise ValueError(f"wheels: three or more rows of {COLUMNS} numbers")
        if not np.isfinite(table).all():
            raise ValueError("wheels: not finite")
        return cls(
            name=_text(document["name"]),
            title=_text(document["title"]),
            **_numbers("body", document),
            layout=WheelLayout(table, _number("wheels", "radius", document["wheels"]["radius"])),
            gear_ratio=_number("drive", "gear_ratio", document["gear_ratio"]),
            traction=_number("contact", "traction", document["traction"]),
            limits=vehicle_limits(_numbers("limits", document["limits"])),
            battery=Battery(**_numbers("battery", document["battery"])),
            parameters={
                slug: {name: _parameter(value) for name, value in values.items()}
                for slug, values in document["parameters"].items()
            },
            active=tuple(map(_text, document["active"])),
            provenance=Provenance(
                sources={_text(k): _text(v) for k, v in document["sources"].items()},
                defaults_taken=tuple(map(_text, document["defaults_taken"])),
                # Files of earlier versions do not have them.
                uncertainties={
                    _text(k): _parameter(v) for k, v in document.get("uncertainties", {}).items()
                },
                derived={_text(k): _text(v) for k, v in document.get("derived", {}).items()},
                motor=_text(document.get("motor", "")),
                without_source=tuple(map(_text, document.get("without_source", []))),
            ),
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


def vehicle_limits(numbers: Mapping[str, float]) -> Limits:
    """The limits with what follows from others: PEAK_SHARE of the continuous torque."""
    limits = Limits(**numbers)
    if not math.isnan(limits.peak_torque):
        return limits
    return replace(limits, peak_torque=PEAK_SHARE * limits.continuous_torque)


def _numbers(table: str, given: Mapping[str, Any]) -> dict[str, float]:
    """Numbers of a table; models saved by older versions lack keys that were added since."""
    numbers = {}
    for name, key in vehicle_keys()[table].items():
        if key.place in _ADDED and name not in given:
            numbers[name] = float(key.default or math.nan)
        elif key.effect is None:
            numbers[name] = _number(table, name, given[name])
    return numbers


def _number(table: str, key: str, value: Any) -> float:
    """A number in the range that the TOML file has for it; None stands for no limit."""
    declared = vehicle_keys()[table][key]
    if value is None and (declared.default == math.inf or key == "peak_torque"):
        return math.inf
    number, (low, high) = float(value), declared.range
    if not low <= number <= high:
        raise ValueError(f"{key}: {value!r} is not in {between(low, high, declared.unit)}")
    return number


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is not text")
    return value
