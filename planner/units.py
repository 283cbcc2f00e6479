"""Units as people and data sheets write them, converted to SI.

    factor, offset = conversion("mN·m/A", "N·m/A")      # value in SI = factor · value + offset

One unit has many spellings: "g·cm²", "gcm2", "g*cm^2" and "g cm**2" are the same. "1/min", "min⁻¹"
and "U/min" on a data sheet are revolutions a minute.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import Any

LONGEST_UNIT = 40
"""Characters; no unit needs more, and a long text is no unit."""

_PLAIN = {"°C": "degC", "°F": "degF", "°": "deg", "": "dimensionless", "1": "dimensionless"}
_WORDS = {
    "Ohm": "ohm",
    "OHM": "ohm",
    "Ohms": "ohm",
    "rev": "turn",
    '"': "inch",
    "kph": "km/h",
    "kmh": "km/h",
    "RPM": "rpm",
}
_TOWER = re.compile(r"\*\*\s*(?:-?\d+\s*\*\*|-?\d{2}|\()|\)\s*\*\*|\d{5}")
"""Powers of powers and of large numbers, which would be worked out for hours."""
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_ROTATION = re.compile(r"(?<![\w*])(?:1\s*/\s*min|min\s*\*\*\s*-1|(?:U|rev|r|turns?)\s*/\s*min)\b")
_COMPACT = {
    **{f"{p}N{q}m": f"{p}N*{q}m" for p in ("", "m", "k", "c", "u", "µ") for q in ("", "m", "c")},
    **{f"{p}Nms": f"{p}N*m*s" for p in ("", "m", "u", "µ")},
    **{f"{p}{q}m": f"{p}*{q}m" for p in ("kg", "g", "kgf", "gf") for q in ("", "c", "m")},
    "Vs": "V*s",
    "mVs": "mV*s",
    "ozin": "ozf*inch",
}
_MASS = re.compile(r"(?<![\w])(kg|g|oz|lb)(?=\s*\*\s*(?:cm|mm|m|in|inch|ft)\b(?!\s*\*\*))")
"""Weights times a lever, as torques stand on many data sheets: kg·cm, oz·in."""
_COMPACT_WORD = re.compile(rf"(?<![\w])({'|'.join(sorted(_COMPACT, key=len, reverse=True))})(?!\w)")


def conversion(unit: str, own: str) -> tuple[float, float]:
    """Factor and offset from one unit to another.

    Args:
        unit: as given.
        own: unit of the result, as planner.quantities and the effects write them.

    Raises:
        ValueError: it is no unit, or measures something else; the message is a phrase.
    """
    if unit == own:
        return 1.0, 0.0
    if len(unit) > LONGEST_UNIT or _TOWER.search(_spelled(unit)):
        raise ValueError("not a unit")
    try:
        units = _registry()
        given, target = units.Unit(_spelled(unit)), units.Unit(_spelled(own))
        if not given.is_compatible_with(target):
            given = units.Unit(_MASS.sub(r"\1f", _spelled(unit)))
        zero = float(units.Quantity(0.0, given).to(target).magnitude)
        one = float(units.Quantity(1.0, given).to(target).magnitude)
    except Exception as error:  # The unit library raises many kinds, some of other libraries.
        raise ValueError(" ".join(str(error).split())[:120] or "not a unit") from error
    if not (math.isfinite(zero) and math.isfinite(one)) or one == zero:
        raise ValueError("not a unit")
    return one - zero, zero


def _spelled(unit: str) -> str:
    """The unit as the library reads it."""
    text = " ".join(unit.split())
    if text in _PLAIN:
        return _PLAIN[text]
    text = re.sub(
        r"([⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+)", lambda found: "**" + found[1].translate(_SUPERSCRIPTS), text
    )
    text = re.sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", "*", text)
    text = re.sub(r"[·⋅×]", "*", text).replace("^", "**").replace("°", "deg").replace("\u2126", "Ω")
    text = re.sub(r"\b(k?g|kgf|gf)?([cm]?m)([23])\b", _with_power, text)
    text = re.sub(r"\bs([23])\b", r"s**\1", text)
    text = _COMPACT_WORD.sub(lambda found: _COMPACT[found[1]], text)
    text = re.sub(r"(?<![\w])[A-Za-z\"]+(?!\w)", lambda found: _WORDS.get(found[0], found[0]), text)
    return _ROTATION.sub("rpm", text).replace("turn/min", "rpm")


def _with_power(found: re.Match[str]) -> str:
    """ "gcm2" as a product; "m2" as a power."""
    first = f"{found[1]}*" if found[1] else ""
    return f"{first}{found[2]}**{found[3]}"


@lru_cache(maxsize=1)  # constants
def _registry() -> Any:
    import pint  # Takes 0.4 s of CPU, and most files are in SI.

    return pint.UnitRegistry()
