"""Dimensions and units of formulas: exponents of kg, m, s, A and K.

rad counts as 1, a temperature in °C as K (differences of temperatures). Units are SI without
prefixes, because everything that a formula touches is in SI.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

from planner.errors import ModelError

Dimension = tuple[Fraction, ...]
"""Exponents of kg, m, s, A, K."""

_BASE = ("kg", "m", "s", "A", "K")


def _dimension(*exponents: int) -> Dimension:
    return tuple(Fraction(e) for e in exponents)


NUMBER = _dimension(0, 0, 0, 0, 0)
UNITS: dict[str, Dimension] = {
    "1": NUMBER,
    "rad": NUMBER,
    "kg": _dimension(1, 0, 0, 0, 0),
    "m": _dimension(0, 1, 0, 0, 0),
    "s": _dimension(0, 0, 1, 0, 0),
    "A": _dimension(0, 0, 0, 1, 0),
    "K": _dimension(0, 0, 0, 0, 1),
    "°C": _dimension(0, 0, 0, 0, 1),
    "Hz": _dimension(0, 0, -1, 0, 0),
    "N": _dimension(1, 1, -2, 0, 0),
    "J": _dimension(1, 2, -2, 0, 0),
    "W": _dimension(1, 2, -3, 0, 0),
    "V": _dimension(1, 2, -3, -1, 0),
    "Ω": _dimension(1, 2, -3, -2, 0),
    "ohm": _dimension(1, 2, -3, -2, 0),
    "Pa": _dimension(1, -1, -2, 0, 0),
}
"""SI units, without prefixes: a parameter is fitted in SI."""


def parse_unit(unit: Any, field: str = "unit") -> Dimension:
    """Dimension of a unit such as "N·s/m", "W/(m/s)^2" or "1/K".

    Raises:
        ModelError: not a product of powers of SI units without prefix.
    """
    accepted = f"a product of powers of {', '.join(UNITS)}, e.g. N·s/m"
    if not isinstance(unit, str) or not unit.strip() or len(unit) > 60:
        raise ModelError(field, "not a unit", value=unit, accepted=accepted)
    text = unit.replace("²", "^2").replace("³", "^3").replace("⁻¹", "^-1").replace("**", "^")
    tokens = re.findall(r"\^-?[0-9]+(?:\.[0-9]+)?|[·*/()]|°C|[A-Za-zΩ]+|1|\S", text)
    try:
        dimension, rest = _unit_product(tokens)
    except (ValueError, IndexError, RecursionError) as error:
        raise ModelError(field, "not a unit", value=unit, accepted=accepted) from error
    if rest:
        raise ModelError(field, "not a unit", value=unit, accepted=accepted)
    return dimension


def _unit_product(tokens: list[str]) -> tuple[Dimension, list[str]]:
    total, tokens = _unit_power(tokens)
    while tokens and tokens[0] in "·*/":
        turn = -1 if tokens[0] == "/" else 1
        factor, tokens = _unit_power(tokens[1:])
        total = times(total, factor, turn)
    return total, tokens


def _unit_power(tokens: list[str]) -> tuple[Dimension, list[str]]:
    if tokens[0] == "(":
        base, rest = _unit_product(tokens[1:])
        if rest[0] != ")":
            raise ValueError("a bracket stays open")
        rest = rest[1:]
    elif tokens[0] in UNITS:
        base, rest = UNITS[tokens[0]], tokens[1:]
    else:
        raise ValueError("unknown unit")
    if rest and rest[0].startswith("^"):
        return tuple(e * Fraction(rest[0][1:]) for e in base), rest[1:]
    return base, rest


def format_dimension(dimension: Dimension) -> str:
    """A dimension in words of base units, "1" for a pure number."""
    for name in ("W", "N", "V", "Ω", "J"):
        if UNITS[name] == dimension:
            return name
    parts = [
        name if exponent == 1 else f"{name}^{exponent}"
        for name, exponent in zip(_BASE, dimension, strict=True)
        if exponent
    ]
    return "·".join(parts) or "1"


def times(a: Dimension, b: Dimension, turn: int = 1) -> Dimension:
    """Dimension of a product; of a quotient with turn = -1."""
    return tuple(x + turn * y for x, y in zip(a, b, strict=True))
