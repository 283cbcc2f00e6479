"""Every usual spelling of a unit is the same unit, and what is none is said to be none."""

from __future__ import annotations

import math
import time

import pytest

from planner.units import conversion

RPM = 2.0 * math.pi / 60.0


@pytest.mark.parametrize(
    ("own", "factor", "spellings"),
    [
        ("m", 1e-3, ("mm", "millimeter", "millimetre")),
        ("m", 0.0254, ("in", "inch", '"')),
        ("kg", 1e-3, ("g", "gram", "grams")),
        ("kg·m²", 1e-7, ("g·cm²", "gcm²", "gcm2", "g cm^2", "g*cm**2")),
        ("kg·m²", 1.0, ("kgm²", "kg m^2", "kg*m**2", "kgm2")),
        ("N·m/A", 1e-3, ("mN·m/A", "mNm/A", "mN*m/A", "mV·s/rad", "mVs")),
        ("N·m/A", 1e-3 / RPM, ("mV/rpm", "V/krpm", "mV/(1/min)")),
        ("A/(N·m)", RPM, ("rpm/V", "RPM/V", "1/min/V", "min⁻¹/V", "U/min/V")),
        ("N·m", 1e-3, ("mN·m", "mNm", "mN m")),
        ("N·m", 0.0980665, ("kgf·cm", "kgf cm", "kgf*cm", "kg·cm", "kg-cm", "kgcm")),
        ("N·m/A", 0.0254 * 0.028349523125 * 9.80665, ("oz·in/A", "oz-in/A", "ozf*in/A")),
        ("N·m·s", 1e-6, ("µN·m·s", "µNms", "uN*m*s")),
        ("Ω", 1.0, ("ohm", "Ohm", "\u2126")),
        ("A·s", 3600.0, ("Ah", "A·h", "A*h")),
        ("J", 3600.0, ("Wh", "W·h", "watt*hour")),
        ("rad", math.pi / 180.0, ("deg", "°", "degree")),
        ("rad/s", RPM, ("rpm", "1/min", "min⁻¹", "rev/min")),
        ("m/s", 1.0 / 3.6, ("km/h", "kph", "kilometer/hour")),
        ("m/s²", 1.0, ("m/s^2", "m/s2", "m/s**2")),
        ("1", 0.01, ("%", "percent")),
    ],
)
def test_spellings_of_one_unit(own: str, factor: float, spellings: tuple[str, ...]) -> None:
    for spelling in spellings:
        assert conversion(spelling, own) == (pytest.approx(factor, rel=1e-9), 0.0), spelling


def test_a_weight_times_a_lever_stays_what_it_is_where_no_torque_is_asked() -> None:
    assert conversion("kg·cm", "kg·m") == (pytest.approx(0.01), 0.0)
    for unit in ("kg·cm²", "g·cm²", "kg"):
        with pytest.raises(ValueError, match=r"\w"):
            conversion(unit, "N·m")


def test_temperatures_have_an_offset() -> None:
    factor, offset = conversion("°F", "°C")
    assert 212.0 * factor + offset == pytest.approx(100.0)


@pytest.mark.parametrize("unit", ["", "kg", "furlongs per", "m/", "((", "m" * 50, "1/0", "nan"])
def test_what_is_no_length_is_refused(unit: str) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        conversion(unit, "m")


@pytest.mark.parametrize("unit", ["9**9**9**9*m", "(9**9)**9**9*m", "9**99999999*m", "m^9^9^9"])
def test_a_hostile_power_is_not_worked_out(unit: str) -> None:
    before = time.process_time()
    with pytest.raises(ValueError, match="not a unit"):
        conversion(unit, "m")
    assert time.process_time() - before < 0.1
