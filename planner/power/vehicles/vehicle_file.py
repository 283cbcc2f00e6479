"""A vehicle's TOML file: found, read, checked and turned into SI numbers with their sources.

    vehicle = load_vehicle("minibalance")          # a name of planner/power/vehicles, or a path

Every value is a number in SI or ``{ value, unit, source }``. Unknown keys are refused with the
nearest known one. What makes a robot this one and no other is required: body mass, length, width;
wheels layout with its geometry and radius; drive gear_ratio, torque_constant, resistance. Another
missing key takes its default, and ``defaults_taken`` names it.
"""

from __future__ import annotations

import difflib
import math
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import VehicleError
from planner.power.catalogue import all_effects
from planner.power.effect import Parameter
from planner.power.kinematics import RIM, WheelLayout, mecanum, omni
from planner.power.vehicles.vehicle import Battery, Limits, Vehicle
from planner.power.vehicles.vehicle_keys import (
    EFFECT_KEYS,
    GEOMETRY,
    NUMBERS,
    REQUIRED,
    between,
    what_fits,
)
from planner.reading import finite_number, parse_toml

VEHICLE_FOLDER = Path(__file__).parent


def list_vehicles() -> list[dict[str, object]]:
    """Name, title, mass, size and active effects of every vehicle that is installed."""
    found = []
    for path in sorted(VEHICLE_FOLDER.glob("*.toml")):
        vehicle = load_vehicle(path.stem)
        found.append(
            {
                "name": vehicle.name,
                "title": vehicle.title,
                "mass_kg": vehicle.mass,
                "length_m": vehicle.length,
                "width_m": vehicle.width,
                "wheels": vehicle.layout.wheel_count,
                "effects": list(vehicle.active),
                "battery_j": vehicle.battery.capacity,
            }
        )
    return found


def load_vehicle(name: str) -> Vehicle:
    """The vehicle of this name, or in the TOML file at this path.

    Raises:
        VehicleError: no such vehicle, or a value in its file cannot be used.
    """
    known = sorted(path.stem for path in VEHICLE_FOLDER.glob("*.toml"))
    path = VEHICLE_FOLDER / f"{name}.toml" if name in known else Path(name)
    # Unlike Path.is_file this does not raise for a name that no file can have.
    if name not in known and (path.suffix != ".toml" or not os.path.isfile(path)):
        raise VehicleError(
            "vehicle", "no such vehicle", value=name, accepted=f"{', '.join(known)}, a .toml path"
        )
    return _load(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=64)  # parsed files of a few kB
def _load(path: Path, _changed: int) -> Vehicle:
    accepted = "a vehicle's TOML"
    try:
        document = parse_toml(path.read_bytes())
    except OSError as error:
        raise VehicleError(
            str(path), f"cannot be read: {error.strerror}", accepted=accepted
        ) from error
    except ValueError as error:
        raise VehicleError(str(path), f"not TOML: {error}", accepted=accepted) from error
    return _Reader(str(path), document).vehicle()


class _Reader:
    def __init__(self, place: str, document: dict[str, Any]) -> None:
        self.place = place
        self.document = document
        self.sources: dict[str, str] = {}
        self.defaults: list[str] = []
        self.parameters: dict[str, dict[str, Any]] = {}

    def vehicle(self) -> Vehicle:
        tables = {*NUMBERS, "name", "title", "effects"}
        self._refuse_unknown(self.document, tables, "")
        for table in NUMBERS:
            known = {key for key, *_ in NUMBERS[table]}
            known |= {key for owner, key in EFFECT_KEYS if owner == table}
            if table == "wheels":
                known |= {"layout", "angles"}
            self._refuse_unknown(self._table(table), known, f"[{table}] ")
        self._refuse_missing()
        for (table, key), (slug, parameter) in EFFECT_KEYS.items():
            self._base_parameter(table, key, slug, parameter)
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
            limits=Limits(**self._numbers("limits")),
            battery=Battery(**self._numbers("battery")),
            parameters=self.parameters,
            active=active,
            sources=self.sources,
            defaults_taken=tuple(self.defaults),
        )

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

    def _value(self, place: str, raw: Any, unit: str, low: float, high: float) -> float:
        if isinstance(raw, dict):
            self._described(place, raw, unit)
            raw = raw.get("value")
        number = finite_number(raw)
        if number is None or not low <= number <= high:
            real = isinstance(raw, int | float) and not isinstance(raw, bool)
            raise self._wrong(
                place,
                "out of range" if real else "not a number",
                value=raw,
                accepted=between(low, high, unit),
            )
        return number

    def _described(self, place: str, raw: dict[str, Any], unit: str) -> None:
        self._refuse_unknown(raw, {"value", "unit", "source"}, place + " ")
        given = raw.get("unit", unit)
        if given != unit:
            raise self._wrong(place, "unit is not the SI one", value=given, accepted=unit)
        if "source" in raw:
            self.sources[place] = self._text("source", raw, f"{place} ")

    def _text(self, key: str, table: dict[str, Any], place: str = "") -> str:
        text = table.get(key, "")
        if not isinstance(text, str):
            raise self._wrong(f"{place}{key}", "not text", value=text, accepted='text in ""')
        return text

    def _refuse_missing(self) -> None:
        """Name all required keys that the file does not give, in one sentence."""
        layout = self._table("wheels").get("layout")
        geometry = GEOMETRY.get(layout, ()) if isinstance(layout, str) else ()
        needed = (*REQUIRED, *(("wheels", key) for key in geometry))
        missing = [(t, key) for t, key in needed if self._table(t).get(key) is None]
        if missing:
            *others, last = [f"{table}.{key}" for table, key in missing]
            raise VehicleError(
                f"vehicle file {self.place}",
                f"{', '.join(others)} and {last} are missing" if others else f"{last} is missing",
                accepted=", ".join(f"{t}.{key} ({what_fits(t, key)})" for t, key in missing),
            )

    def _number(self, table: str, key: str) -> float:
        unit, default, low, high = next(row[1:] for row in NUMBERS[table] if row[0] == key)
        raw = self._table(table).get(key)
        if raw is None:
            assert default is not None  # _refuse_missing was called
            self.defaults.append(f"{table}.{key}")
            return default
        return self._value(f"{table}.{key}", raw, unit, low, high)

    def _numbers(self, table: str) -> dict[str, float]:
        return {key: self._number(table, key) for key, *_ in NUMBERS[table]}

    def _base_parameter(self, table: str, key: str, slug: str, name: str) -> None:
        parameter = all_effects()[slug].parameters[name]
        raw = self._table(table).get(key)
        if raw is None:
            self.defaults.append(f"{table}.{key}")
            value = parameter.default
        else:
            value = self._value(f"{table}.{key}", raw, parameter.unit, *parameter.bounds)
        self.parameters.setdefault(slug, {})[name] = value

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
                if name not in effects.get(slug, {}) and own.default != own.null:
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
        if kind == "omni":
            raw = wheels.get("angles")
            if isinstance(raw, dict):
                self._described("wheels.angles", raw, "rad")
                raw = raw.get("value")
            if not isinstance(raw, list) or len(raw) < 3:
                raise self._wrong(
                    "[wheels] angles",
                    "not a list of wheel angles",
                    value=raw,
                    accepted="three or more angles in rad",
                )
            return omni(
                base_radius=self._number("wheels", "base_radius"),
                angles=tuple(self._value("wheels.angles", v, "rad", -10.0, 10.0) for v in raw),
                radius=radius,
                roller_angle=math.pi / 2 if math.isnan(angle) else angle,
            )
        raise self._wrong(
            "[wheels] layout", "unknown wheel layout", value=kind, accepted="mecanum, omni"
        )
