"""Names, units and possible values of the columns of a telemetry log.

They are declared in columns.toml; those without a unit there are of planner.quantities. A value
outside ``POSSIBLE`` is not a measurement of a ground robot but a fault or another unit.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from planner.quantities import QUANTITIES
from planner.reading import parse_toml

_DECLARED = parse_toml((Path(__file__).parent / "columns.toml").read_bytes())


def _having(key: str) -> dict[str, Any]:
    """Names of the columns that declare a key, with its value."""
    return {name: entry[key] for name, entry in _DECLARED.items() if key in entry}


UNITS: dict[str, str] = {q.name: q.unit for q in QUANTITIES} | _having("unit")
TEXT = tuple(name for name, unit in UNITS.items() if unit == "text")
REQUIRED = tuple(_having("required"))
MAY_BE_UNKNOWN = tuple(_having("may_be_unknown"))
"""Quantities that a row may leave unknown (NaN)."""
POSSIBLE: dict[str, list[float]] = _having("possible")
OFTEN_MISTAKEN: dict[str, str] = _having("mistaken")
OTHER_NAMES: dict[str, list[str]] = _having("other_names")
"""What other logs call the required columns; only asked about, never taken."""
_WHEEL_CURRENT = re.compile(r"wheel_current_[1-9][0-9]?")
_WHEEL_SPEED = re.compile(r"wheel_speed_[1-9][0-9]?")


def is_wheel_current(name: str) -> bool:
    """True for "wheel_current_1", "wheel_current_2", …"""
    return _WHEEL_CURRENT.fullmatch(name) is not None


def is_wheel_speed(name: object) -> bool:
    """True for "wheel_speed_1", "wheel_speed_2", …, which files have that are to be joined."""
    return isinstance(name, str) and _WHEEL_SPEED.fullmatch(name) is not None


def is_quantity(name: str) -> bool:
    """True for a name that a column of a log may have."""
    return name in UNITS or is_wheel_current(name)


def unit_of(name: str) -> str:
    """SI unit of a log's quantity ("text" for labels)."""
    if is_wheel_speed(name):
        return "rad/s"
    return "A" if is_wheel_current(name) else UNITS[name]


def closest(name: str, known: Iterable[str]) -> str | None:
    """The known name that a misspelt one most likely stands for."""
    known = list(known)
    folded = {_fold(candidate): candidate for candidate in known}
    if _fold(name) in folded:
        return folded[_fold(name)]
    for other in OTHER_NAMES.get(name, ()):
        if _fold(other) in folded:
            return folded[_fold(other)]
    found = difflib.get_close_matches(_fold(name), list(folded), n=1, cutoff=0.7)
    return folded[found[0]] if found else None


def suggestion(name: object, known: Iterable[str]) -> str:
    """The end of a sentence that asks for the closest known name; "" when none is close."""
    near = closest(name, known) if isinstance(name, str) else None
    return f"; did you mean {near!r}?" if near else ""


def _fold(name: str) -> str:
    return re.sub(r"\[.*?\]|\(.*?\)|[^a-z0-9]", "", name[:80].lower())
