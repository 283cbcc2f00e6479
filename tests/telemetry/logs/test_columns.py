"""Columns that a log may have: names, units, and the range of what can be."""

from __future__ import annotations

import pytest

from planner.quantities import QUANTITIES
from planner.telemetry.logs.columns import (
    MAY_BE_UNKNOWN,
    OFTEN_MISTAKEN,
    POSSIBLE,
    REQUIRED,
    TEXT,
    UNITS,
    closest,
    is_quantity,
    is_wheel_current,
    unit_of,
)


def test_every_quantity_of_the_model_is_a_column_in_its_unit() -> None:
    for quantity in QUANTITIES:
        assert is_quantity(quantity.name)
        if quantity.name not in TEXT:
            assert unit_of(quantity.name) == quantity.unit


def test_tables_of_columns_name_columns() -> None:
    for names in (REQUIRED, MAY_BE_UNKNOWN, TEXT, POSSIBLE, OFTEN_MISTAKEN):
        assert set(names) <= set(UNITS)
    assert set(OFTEN_MISTAKEN) <= set(POSSIBLE)
    for low, high in POSSIBLE.values():
        assert low < high


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("vx", 500.0),  # mm/s for 0.5 m/s
        ("pitch", 5.0),  # degrees
        ("battery_voltage", 24_000.0),  # mV
        ("com_x", 20.0),  # mm
        ("motor_temp", 500.0),
        ("gravity_normal", -9.8),
    ],
)
def test_another_unit_is_outside_of_what_can_be(name: str, wrong: float) -> None:
    low, high = POSSIBLE[name]
    assert not low <= wrong <= high


@pytest.mark.parametrize("name", ["wheel_current_1", "wheel_current_12"])
def test_currents_of_wheels_are_columns_in_ampere(name: str) -> None:
    assert is_quantity(name)
    assert unit_of(name) == "A"
    assert is_wheel_current(name)


@pytest.mark.parametrize(
    "name", ["wheel_current_0", "wheel_current_", "wheel_current_1x", "wheel_current_100", "vxx"]
)
def test_other_names_are_none(name: str) -> None:
    assert not is_wheel_current(name)
    assert not is_quantity(name)


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("VX [m/s]", "vx"),
        ("Battery Voltage (V)", "battery_voltage"),
        ("battery_volt", "battery_voltage"),
        ("payloud", "payload"),
        ("humidity", None),
    ],
)
def test_a_misspelt_name_is_recognised(name: str, meant: str | None) -> None:
    assert closest(name, UNITS) == meant


@pytest.mark.parametrize(
    ("heading", "quantity"),
    [
        ("t", "time"),
        ("linear.x", "vx"),
        ("twist.twist.linear.y", "vy"),
        ("yaw_rate", "wz"),
        ("P [W]", "power"),
    ],
)
def test_usual_headings_of_other_logs_are_asked_about(heading: str, quantity: str) -> None:
    assert closest(quantity, ["q", heading, "notes"]) == heading
    assert closest(quantity, ["q", "notes"]) is None
