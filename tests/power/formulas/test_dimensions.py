"""Units are products of powers of base units, read and written."""

from __future__ import annotations

from typing import Any

import pytest

from planner.errors import ModelError
from planner.power.formulas.dimensions import UNITS, format_dimension, parse_unit


@pytest.mark.parametrize(
    ("unit", "exponents"),
    [
        ("W", (1, 2, -3, 0, 0)),
        ("N·s/m", (1, 0, -1, 0, 0)),
        ("W/(m/s)^2", (1, 0, -1, 0, 0)),
        ("m/s²", (0, 1, -2, 0, 0)),
        ("V·A", (1, 2, -3, 0, 0)),
        ("1/K", (0, 0, 0, 0, -1)),
        ("Ω*A^2", (1, 2, -3, 0, 0)),
        ("rad/s", (0, 0, -1, 0, 0)),
        ("1", (0, 0, 0, 0, 0)),
    ],
)
def test_units_are_products_of_base_units(unit: str, exponents: tuple[int, ...]) -> None:
    assert parse_unit(unit) == exponents


@pytest.mark.parametrize(
    "unit", ["", "kW", "m//s", "(m", "m)", "m^", "furlong", "m s", 3, "m" * 99]
)
def test_no_unit(unit: Any) -> None:
    with pytest.raises(ModelError, match="not a unit"):
        parse_unit(unit)


def test_dimensions_are_written_readably() -> None:
    assert format_dimension(parse_unit("N·m/s")) == "W"
    assert format_dimension(parse_unit("m/s")) == "m·s^-1"
    assert format_dimension(UNITS["1"]) == "1"
