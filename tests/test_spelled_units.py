"""Every quantity of vehicle files and of logs, with its unit spelled in three ways."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from planner.power.vehicles.vehicle_file import load_vehicle
from planner.power.vehicles.vehicle_keys import vehicle_keys
from planner.telemetry.logs.columns import TEXT, UNITS
from planner.telemetry.logs.mapping import read_mapping
from tests.power.vehicles.test_data_sheets import numbers

DEGREE, RPM = math.pi / 180.0, math.tau / 60.0
SPELLED: dict[str, dict[str, float]] = {
    "1": {"%": 0.01, "percent": 0.01, "1": 1.0},
    "A": {"mA": 1e-3, "ampere": 1.0, "kA": 1e3},
    "Hz": {"kHz": 1e3, "1/s": 1.0, "mHz": 1e-3},
    "J": {"Wh": 3600.0, "kJ": 1e3, "kWh": 3.6e6},
    "N·m": {"mN·m": 1e-3, "Ncm": 1e-2, "kgf·cm": 0.0980665},
    "N·m/A": {"mNm/A": 1e-3, "V·s/rad": 1.0, "mV/rpm": 1e-3 / RPM},
    "N·s/m": {"N s/m": 1.0, "kg/s": 1.0, "mN·s/mm": 1.0},
    "V": {"mV": 1e-3, "volt": 1.0, "kV": 1e3},
    "W": {"mW": 1e-3, "kW": 1e3, "watt": 1.0},
    "kg": {"g": 1e-3, "lb": 0.45359237, "kilogram": 1.0},
    "kg·m²": {"g·cm²": 1e-7, "gcm2": 1e-7, "kg m^2": 1.0},
    "m": {"mm": 1e-3, "cm": 1e-2, "inch": 0.0254},
    "m/s": {"kmh": 1.0 / 3.6, "mm/s": 1e-3, "kph": 1.0 / 3.6},
    "m/s²": {"cm/s²": 1e-2, "m/s2": 1.0, "standard_gravity": 9.80665},
    "rad": {"deg": DEGREE, "°": DEGREE, "mrad": 1e-3},
    "rad/s": {"deg/s": DEGREE, "rpm": RPM, "1/min": RPM},
    "rad/s²": {"deg/s²": DEGREE, "deg/s^2": DEGREE, "rad/s2": 1.0},
    "s": {"ms": 1e-3, "min": 60.0, "hour": 3600.0},
    "°C": {"degC": 1.0, "K": 1.0, "°F": 5.0 / 9.0},
    "Ω": {"ohm": 1.0, "mΩ": 1e-3, "Ohm": 1.0},
}
ZERO = {"K": -273.15, "°F": -32.0 * 5.0 / 9.0}
"""°C at the zero of a scale."""

GEOMETRY = {
    "mecanum": "half_wheelbase = 0.2\nhalf_track = 0.25",
    "omni": "base_radius = 0.15\nangles = [0.0, 2.0, 4.0]",
}
SHEET: dict[str, dict[str, float]] = {
    "body": {"mass": 10.0, "length": 0.6, "width": 0.5},
    "wheels": {"radius": 0.05},
    "drive": {"gear_ratio": 20.0, "torque_constant": 0.03, "resistance": 1.5},
    **{name: {} for name in ("contact", "electronics", "limits", "battery")},
}
KEYS = sorted(
    (table, name) for table, keys in vehicle_keys().items() for name in keys if keys[name].bounds
)


def usual(table: str, key: str) -> float:
    """A value that any robot might have."""
    known = {"half_wheelbase": 0.2, "half_track": 0.25, "base_radius": 0.15, "voltage": 24.0}
    known |= {"no_load_current": 0.1, "capacity": 4e5, **SHEET[table]}
    low, high = vehicle_keys()[table][key].range
    return known.get(key, low + 0.3 * (min(high, low + 1.0) - low))


def sheet(table: str, key: str, entry: str) -> str:
    """A vehicle file with one entry written as given."""
    layout = "omni" if key == "base_radius" else "mecanum"
    tables = {name: {k: f"{v!r}" for k, v in values.items()} for name, values in SHEET.items()}
    tables["wheels"] |= dict(line.split(" = ") for line in GEOMETRY[layout].splitlines())
    tables["wheels"]["layout"] = f'"{layout}"'
    if key == "peak_torque":
        tables["limits"]["continuous_torque"] = "0.2"
    tables[table][key] = entry
    lines = []
    for name, values in tables.items():
        lines += [f"[{name}]", *(f"{k} = {v}" for k, v in values.items())]
    return "\n".join(lines)


@pytest.mark.parametrize(("table", "key"), KEYS, ids=".".join)
def test_a_vehicle_file_means_the_same_in_three_units(tmp_path: Path, table: str, key: str) -> None:
    def load(entry: str) -> list[float]:
        path = tmp_path / f"robot{abs(hash(entry))}.toml"
        path.write_text(sheet(table, key, entry), "utf-8")
        return [n for n in numbers(load_vehicle(str(path))) if math.isfinite(n)]

    value, spelled = usual(table, key), SPELLED[vehicle_keys()[table][key].unit]
    expected = load(repr(value))
    assert len(spelled) == 3
    for unit, factor in spelled.items():
        given = load(f'{{ value = {value / factor!r}, unit = "{unit}" }}')
        assert given == pytest.approx(expected, rel=1e-9), unit


@pytest.mark.parametrize("quantity", [*sorted(set(UNITS) - set(TEXT)), "wheel_current_3"])
def test_a_column_of_a_log_converts_from_three_units(quantity: str) -> None:
    spelled = SPELLED[UNITS.get(quantity, "A")]
    assert len(spelled) == 3
    for unit, factor in spelled.items():
        mapping = read_mapping({"columns": {"x": {"quantity": quantity, "unit": unit}}})
        column = mapping.columns[quantity]
        assert column.factor == pytest.approx(factor, rel=1e-9), unit
        assert column.offset == pytest.approx(ZERO.get(unit, 0.0)), unit


def test_every_quantity_changes_its_vehicle(tmp_path: Path) -> None:
    """The comparison above can fail: another value gives other numbers."""
    told = []
    for table, key in KEYS:
        texts = [sheet(table, key, repr(share * usual(table, key))) for share in (1.0, 0.99)]
        found = []
        for number, text in enumerate(texts):
            path = tmp_path / f"{table}-{key}-{number}.toml"
            path.write_text(re.sub("nan", "0", text), "utf-8")
            found.append(numbers(load_vehicle(str(path))))
        if found[0] == found[1]:
            told.append(f"{table}.{key}")
    assert told == []
