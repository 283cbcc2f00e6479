"""Reads one vehicle's TOML document: values into SI, and what follows from them.

    reader = VehicleReader("my-robot.toml", document)
    vehicle = reader.vehicle()              # VehicleError names the place of what is wrong
    reader.si["wheels"]                     # values of a table, SI

planner.power.vehicles.vehicle_file finds the file, and says what a document holds.
"""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import VehicleError
from planner.power.catalogue import all_effects
from planner.power.effect import Parameter
from planner.power.kinematics import RIM, WheelLayout, mecanum, omni
from planner.power.vehicles.derived import Tables, derive
from planner.power.vehicles.motors import read_motors
from planner.power.vehicles.vehicle import Battery, Provenance, Vehicle, vehicle_limits
from planner.power.vehicles.vehicle_keys import (
    GEOMETRY,
    accepted_units,
    between,
    every_key,
    vehicle_keys,
)
from planner.reading import finite_number
from planner.units import conversion

_OF_THE_BATTERY = {
    "voltage": ("battery_sag", "open_circuit_voltage"),
    "resistance": ("battery_sag", "internal_resistance"),
}
"""Effect and parameter that a key of [battery] also gives."""


class VehicleReader:
    """Reads one document: first every given value into SI, then what follows from them."""

    def __init__(self, place: str, document: dict[str, Any]) -> None:
        self.place = place
        self.document = document
        self.keys = vehicle_keys()
        self.si: Tables = {table: {} for table in self.keys}
        self.sources: dict[str, str] = {}
        self.uncertainties: dict[str, float] = {}
        self.derived: dict[str, str] = {}
        self.given: list[str] = []
        self.defaults: list[str] = []
        self.parameters: dict[str, dict[str, Any]] = {}

    def vehicle(self) -> Vehicle:
        self._refuse_unknown(self.document, {*self.keys, "name", "title", "effects"}, "")
        self._refuse_unknown_layout()  # Its keys would be unknown, too.
        for table, keys in self.keys.items():
            self._refuse_unknown(self._table(table), set(keys), f"[{table}] ")
        motor = self._motor()
        self._refuse_missing()
        self._refuse_other_layout()
        for table in ("battery", *self.keys):  # A capacity in Ah needs the voltage.
            self._read_table(table)
        if motor and "voltage" not in self.si["battery"]:
            self.si["battery"]["voltage"] = read_motors()[motor].voltage
            self.derived["battery.voltage"] = f"nominal voltage of motor {motor}"
        derive(self.si, self.derived)
        for place in self.derived:
            table, key = place.split(".")
            low, high = self.keys[table][key].range
            self.si[table][key] = min(max(self.si[table][key], low), high)
        self._base_parameters()
        name = self._text("name", self.document)
        layout = self._layout()
        active = self._effects(layout.wheel_count)
        return Vehicle(
            name=name or Path(self.place).stem,
            title=self._text("title", self.document) or name,
            **self._numbers("body"),
            layout=layout,
            gear_ratio=self._number("drive", "gear_ratio"),
            traction=self._number("contact", "traction"),
            limits=vehicle_limits(self._numbers("limits")),
            battery=Battery(**self._numbers("battery")),
            parameters=self.parameters,
            active=active,
            provenance=Provenance(
                sources=self.sources,
                defaults_taken=tuple(self.defaults),
                uncertainties=self.uncertainties,
                derived=self.derived,
                motor=motor,
                without_source=tuple(key for key in self.given if key not in self.sources),
            ),
        )

    def _motor(self) -> str:
        """Its name; what the file does not give comes from the motor's data sheet."""
        drive = self._table("drive")
        if "motor" not in drive:
            return ""
        named, motors = drive["motor"], read_motors()
        if not isinstance(named, str) or named not in motors:
            raise self._wrong(
                "drive.motor", "no such motor", value=named, accepted=", ".join(motors)
            )
        self.document = self.document | {table: dict(self._table(table)) for table in self.keys}
        for place, value in motors[named].values.items():
            table, key = place.split(".")
            # A measured drag at hand is better than the no-load current of the data sheet.
            if key != "no_load_current" or "coulomb_torque" not in self.document[table]:
                self.document[table].setdefault(key, value)
        return named

    def _read_table(self, table: str) -> None:
        for key, raw in self._table(table).items():
            place = f"{table}.{key}"
            if key not in ("layout", "motor") and place not in self.given:
                self.given.append(place)
            if key in ("layout", "motor") or key in self.si[table]:
                continue
            if key == "angles":
                self.si[table][key] = self._angles(raw)
                continue
            if place == "battery.capacity" and "voltage" in self._table(table):
                self._read_number("battery", "voltage", self._table(table)["voltage"])
            self._read_number(table, key, raw)

    def _read_number(self, table: str, name: str, raw: Any) -> None:
        key = self.keys[table][name]
        self.si[table][name] = self._value(key.place, raw, key.unit, *key.range)

    def _angles(self, raw: Any) -> list[float]:
        factor = 1.0
        if isinstance(raw, dict):
            factor, _ = self._described("wheels.angles", raw, "rad")
            raw = raw.get("value")
        if not isinstance(raw, list) or len(raw) < 3:
            raise self._wrong(
                "[wheels] angles",
                "not a list of wheel angles",
                value=raw,
                accepted="three or more angles in rad",
            )
        return [self._value("wheels.angles", v, "rad", -10.0, 10.0, factor) for v in raw]

    def _wrong(self, place: str, problem: str, **more: Any) -> VehicleError:
        return VehicleError(f"{self.place} {place}", problem, **more)

    def _table(self, name: str) -> dict[str, Any]:
        table = self.document.get(name, {})
        if not isinstance(table, dict):
            raise self._wrong(f"[{name}]", "not a table", accepted=f"[{name}] …")
        return table

    def _refuse_unknown(self, table: dict[str, Any], known: set[str], place: str) -> None:
        for key in table:
            if key not in known:
                near = difflib.get_close_matches(key, known, 1)
                hint = f"{near[0]!r}? one of " if near else ""
                raise self._wrong(
                    f"{place}{key}", "unknown key", accepted=hint + ", ".join(sorted(known))
                )

    def _value(
        self, place: str, raw: Any, unit: str, low: float, high: float, factor: float = 1.0
    ) -> float:
        """A value in SI; ``factor`` is that of a list's common unit."""
        given, offset = raw, 0.0
        if isinstance(raw, dict):
            factor, offset = self._described(place, raw, unit)
            given = raw.get("value")
        number = finite_number(given)
        if number is not None:
            number = 1.0 / (number * -factor) if factor < 0.0 and number else number * factor
            number += offset
        if number is None or not low <= number <= high:
            real = isinstance(given, int | float) and not isinstance(given, bool)
            in_unit = f" {raw['unit']}" if isinstance(raw, dict) and "unit" in raw and real else ""
            raise self._wrong(
                place,
                "out of range" if real else "not a number",
                value=f"{given}{in_unit}" if in_unit else given,
                accepted=between(low, high, unit),
            )
        return number

    def _described(self, place: str, raw: dict[str, Any], unit: str) -> tuple[float, float]:
        """Factor and offset to SI; source and uncertainty are noted.

        A negative factor stands for the reciprocal: a speed constant is one over a torque constant.
        """
        self._refuse_unknown(raw, {"value", "unit", "source", "uncertainty"}, place + " ")
        if "source" in raw:
            self.sources[place] = self._text("source", raw, f"{place} ")
        if "uncertainty" in raw:
            share = finite_number(raw["uncertainty"])
            if share is None or not 0.0 < share <= 1.0:
                raise self._wrong(
                    f"{place} uncertainty",
                    "not a share",
                    value=raw["uncertainty"],
                    accepted="standard deviation over value, above 0 and up to 1",
                )
            self.uncertainties[place] = share
        return self._conversion(place, raw.get("unit", unit), unit)

    def _conversion(self, place: str, given: Any, unit: str) -> tuple[float, float]:
        wrong = self._wrong(
            place, "not a unit of this value", value=given, accepted=accepted_units(unit)
        )
        if not isinstance(given, str):
            raise wrong
        try:
            return conversion(given, unit)
        except ValueError as error:
            try:
                if unit == "N·m/A":
                    return -conversion(given, "A/(N·m)")[0], 0.0
                if place == "battery.capacity":
                    volts = self.si["battery"].get("voltage")
                    charge = conversion(given, "A·s")[0]
                    if volts is None:
                        raise self._wrong(
                            place,
                            "a charge is no energy without battery.voltage",
                            value=given,
                            accepted="battery.voltage beside it, or a capacity in Wh",
                        ) from error
                    self.derived[place] = "charge·battery.voltage"
                    return charge * volts, 0.0
            except ValueError:
                pass
            raise wrong from error

    def _text(self, key: str, table: dict[str, Any], place: str = "") -> str:
        text = table.get(key, "")
        if not isinstance(text, str):
            raise self._wrong(f"{place}{key}", "not text", value=text, accepted='text in ""')
        if not text.isprintable():
            raise self._wrong(
                f"{place}{key}", "cannot be printed", value=text, accepted="text of one line"
            )
        return text

    def _refuse_missing(self) -> None:
        """Name all required keys that the file does not give, in one sentence."""
        layout = self._table("wheels").get("layout")
        geometry = GEOMETRY.get(layout, ()) if isinstance(layout, str) else ()
        needed = [
            key
            for key in every_key()
            if key.required == "yes" or (key.table == "wheels" and key.name in geometry)
        ]
        missing = [key for key in needed if self._table(key.table).get(key.name) is None]
        if missing:
            *others, last = [key.place for key in missing]
            accepted = ", ".join(f"{key.place} ({key.accepted})" for key in missing)
            if {"drive.torque_constant", "drive.resistance"} & {last, *others}:
                accepted += f", or drive.motor ({', '.join(read_motors())})"
            raise VehicleError(
                f"vehicle file {self.place}",
                f"{', '.join(others)} and {last} are missing" if others else f"{last} is missing",
                accepted=accepted,
            )

    def _refuse_unknown_layout(self) -> None:
        kind = self._table("wheels").get("layout")
        if kind is not None and kind not in tuple(GEOMETRY):
            raise self._wrong(
                "[wheels] layout",
                "unknown wheel layout",
                value=kind,
                accepted=f"{', '.join(GEOMETRY)}; a robot that cannot drive sideways, such as one "
                "with a differential drive, has no model here",
            )

    def _refuse_other_layout(self) -> None:
        """What only another layout has would be passed over."""
        wheels = self.document["wheels"]
        own = GEOMETRY.get(wheels["layout"]) if isinstance(wheels["layout"], str) else None
        for other, keys in GEOMETRY.items():
            for key in sorted(wheels.keys() & (set(keys) - set(own or keys))):
                raise self._wrong(
                    f"[wheels] {key}",
                    f'belongs to the layout "{other}"',
                    accepted=f'for "{wheels["layout"]}": {", ".join(own or ())}',
                )

    def _number(self, table: str, key: str) -> float:
        if key in self.si[table]:
            return float(self.si[table][key])
        default = self.keys[table][key].default
        assert default is not None  # _refuse_missing was called
        self.defaults.append(f"{table}.{key}")
        return default

    def _numbers(self, table: str) -> dict[str, float]:
        own = [key for key in self.keys[table].values() if key.effect is None]
        return {key.name: self._number(table, key.name) for key in own}

    def _base_parameters(self) -> None:
        for key in every_key():
            if key.effect is None:
                continue
            value = self.si[key.table].get(key.name)
            if value is None:
                self.defaults.append(key.place)
                value = key.default
            slug, name = key.effect
            self.parameters.setdefault(slug, {})[name] = value
        battery = self.si["battery"]
        for own, (slug, name) in _OF_THE_BATTERY.items():
            if own in battery:
                low, high = all_effects()[slug].parameters[name].bounds
                self.parameters.setdefault(slug, {})[name] = min(max(battery[own], low), high)
                self.derived[f"effects.{slug}.{name}"] = f"battery.{own}"

    def _effects(self, wheels: int) -> tuple[str, ...]:
        effects = dict(self._table("effects"))
        named = effects.pop("active", [])
        catalogue = all_effects()
        candidates = {slug for slug, effect in catalogue.items() if not effect.base}
        self._refuse_unknown(effects, candidates, "[effects] ")
        for slug, table in effects.items():
            if not isinstance(table, dict):
                raise self._wrong(f"[effects.{slug}]", "not a table", accepted="parameters")
            declared = catalogue[slug].parameters
            self._refuse_unknown(table, set(declared), f"[effects.{slug}] ")
            for key, raw in table.items():
                self.parameters.setdefault(slug, {})[key] = self._effect_value(
                    f"effects.{slug}.{key}", raw, declared[key], wheels
                )
                self.derived.pop(f"effects.{slug}.{key}", None)
        wrong = named
        if isinstance(named, list):
            wrong = [n for n in named if not isinstance(n, str) or n not in catalogue]
        if not isinstance(named, list) or wrong:
            raise self._wrong(
                "[effects] active",
                "not a list of effects",
                value=wrong,
                accepted=", ".join(sorted(candidates)),
            )
        active = tuple(s for s, e in catalogue.items() if e.base or s in named)
        for slug in (slug for slug in active if slug in candidates):
            for name, own in catalogue[slug].parameters.items():
                # At its null value a parameter adds nothing, so that nothing is assumed.
                if name not in self.parameters.get(slug, {}) and own.default != own.null:
                    self.defaults.append(f"effects.{slug}.{name}")
        return active

    def _effect_value(self, place: str, raw: Any, parameter: Parameter, wheels: int) -> Any:
        if parameter.per == "wheel" and isinstance(raw, list):
            if len(raw) != wheels:
                raise self._wrong(
                    place,
                    "not one value a wheel",
                    value=raw,
                    accepted=f"a list of {wheels} numbers in {parameter.unit}",
                )
            return [self._value(place, v, parameter.unit, *parameter.bounds) for v in raw]
        if parameter.per == "surface" and isinstance(raw, dict):
            return {
                str(label): self._value(f"{place}.{label}", v, parameter.unit, *parameter.bounds)
                for label, v in raw.items()
            }
        return self._value(place, raw, parameter.unit, *parameter.bounds)

    def _layout(self) -> WheelLayout:
        layout = self._wheels()
        # Axle forces that cannot push and turn the body in every direction leave it adrift.
        if np.linalg.matrix_rank(layout.table[:, RIM : RIM + 3], tol=1e-6) < 3:
            raise self._wrong(
                "[wheels]",
                "the wheels cannot move the robot in every direction",
                value=self._table("wheels"),
                accepted="wheels and rollers that together act along x, along y and about z",
            )
        return layout

    def _wheels(self) -> WheelLayout:
        wheels = self._table("wheels")
        kind = wheels.get("layout")
        radius = self._number("wheels", "radius")
        angle = self._number("wheels", "roller_angle")
        if kind == "mecanum":
            return mecanum(
                half_wheelbase=self._number("wheels", "half_wheelbase"),
                half_track=self._number("wheels", "half_track"),
                radius=radius,
                roller_angle=math.pi / 4 if math.isnan(angle) else angle,
            )
        assert (
            kind == "omni"
        )  # Others are refused above; a new one in GEOMETRY has its branch here.
        return omni(
            base_radius=self._number("wheels", "base_radius"),
            angles=tuple(self.si["wheels"]["angles"]),
            radius=radius,
            roller_angle=math.pi / 2 if math.isnan(angle) else angle,
        )
