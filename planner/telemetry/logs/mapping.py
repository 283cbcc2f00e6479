"""Mapping file: it turns the columns of another log into quantities.

TOML, for example::

    power_at = "source"             # where power was measured; "terminals" when left out
    [columns]
    "Vel X [mm/s]" = { quantity = "vx", unit = "mm/s" }
    P_bat = { quantity = "power", unit = "kW", sign = -1 }
    stamp = "time"
    [constants]
    run = "yard"
    payload = { value = 12, unit = "lb" }
    [rosbag]
    odometry = "/odom"
    interval = 0.1

In Python the same may be given as a dictionary. A column that the file does not name keeps its
heading. Units other than SI are converted here and nowhere else; the sign comes after the unit.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planner.errors import LogError
from planner.reading import finite_number, parse_toml
from planner.telemetry.logs.columns import (
    TEXT,
    UNITS,
    is_quantity,
    is_wheel_speed,
    suggestion,
    unit_of,
)
from planner.units import LONGEST_UNIT, conversion

ACCEPTED = "a mapping file as docs/logs.md describes it"
MappingLike = str | Path | AnyMapping[str, Any]
"""A mapping file's path, or its content as a dictionary."""
_ROSBAG_KEYS = ("odometry", "imu", "battery", "interval")


@dataclass(frozen=True)
class Column:
    """Where a quantity comes from: value = factor · cell + offset."""

    heading: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Mapping:
    """What a mapping file says.

    Attributes:
        columns: quantity to its column.
        constants: quantity to a value in SI (text for run and surface).
        power_at: "terminals" of the robot, or "source": what the battery's cells give.
        rosbag: topics and interval (s) for recordings.
        path: the file; "" without one.
    """

    columns: dict[str, Column] = field(default_factory=dict)
    constants: dict[str, float | str] = field(default_factory=dict)
    power_at: str = "terminals"
    rosbag: dict[str, Any] = field(default_factory=dict)
    path: str = ""

    def resolve(
        self, headings: list[str], log: str, dates: Collection[str] = ()
    ) -> dict[str, Column]:
        """Quantity to column for a log with these headings.

        Args:
            headings: of all columns.
            log: its name.
            dates: headings of columns that hold moments or durations, which are read as seconds.

        Raises:
            LogError: the mapping names a column that the log does not have, or gives one of dates
                a unit.
        """
        for quantity, column in self.columns.items():
            if column.heading in dates and column.factor != 1.0:
                problem = f"gives the column {column.heading!r} a unit, but it holds dates"
                raise LogError(self.path, problem, accepted=f'"{quantity}" alone')
        taken = {column.heading for column in self.columns.values()}
        for heading in sorted(taken - set(headings)):
            hint = suggestion(heading, headings)
            raise LogError(
                self.path,
                f"names the column {heading!r}, which {log} does not have{hint}",
                accepted=", ".join(headings[:40]),
            )
        own = [name for name in headings if is_quantity(name) and name not in taken]
        return {name: Column(name) for name in own if name not in self.constants} | self.columns


def read_mapping(given: MappingLike, *, wheel_speeds: bool = False) -> Mapping:
    """Read a mapping file, or its content as a dictionary.

    Args:
        given: its path, or the dictionary.
        wheel_speeds: whether columns may be wheel speeds as well.

    Raises:
        LogError: not TOML, an unknown key or quantity, a unit of another dimension.
    """
    where = str(given) if isinstance(given, str | Path) else "mapping"
    if isinstance(given, AnyMapping):
        document = {str(key): value for key, value in given.items()}
    else:
        document = _content(where, given)
    _only(document, ("power_at", "columns", "constants", "rosbag"), where)
    power_at = document.get("power_at", "terminals")
    if power_at not in ("terminals", "source"):
        raise LogError(
            f"{where}: power_at", "no such place", value=power_at, accepted='"terminals", "source"'
        )
    columns: dict[str, Column] = {}
    for heading, entry in _table(document, "columns", where).items():
        place = f"{where}: columns.{heading}"
        quantity, column = _column(place, heading.strip(), entry, wheel_speeds)
        if quantity in columns:
            problem, accepted = "a second column for the same quantity", "one column a quantity"
            raise LogError(
                f"{where}: columns.{heading}", problem, value=quantity, accepted=accepted
            )
        columns[quantity] = column
    constants: dict[str, float | str] = {}
    for quantity, entry in _table(document, "constants", where).items():
        constants[quantity] = _constant(f"{where}: constants.{quantity}", quantity, entry)
        if quantity in columns:
            problem, accepted = "is given by a column as well", "a column or a constant"
            raise LogError(f"{where}: constants.{quantity}", problem, accepted=accepted)
    rosbag = _table(document, "rosbag", where)
    _only(rosbag, _ROSBAG_KEYS, f"{where}: rosbag")
    for key, value in rosbag.items():
        good, accepted = isinstance(value, str), "a topic's name"
        if key == "interval":
            good, accepted = (finite_number(value) or 0.0) > 0.0, "seconds above 0"
        if not good:
            raise LogError(
                f"{where}: rosbag.{key}", "cannot be used", value=value, accepted=accepted
            )
    return Mapping(columns, constants, power_at, rosbag, where)


def _content(where: str, path: str | Path) -> dict[str, Any]:
    """The TOML document of a mapping file."""
    try:
        return parse_toml(Path(path).read_bytes())
    except OSError as error:
        raise LogError(where, f"cannot be opened: {error.strerror}", accepted=ACCEPTED) from error
    except TypeError:
        raise LogError(where, "is not a mapping", value=path, accepted=ACCEPTED) from None
    except ValueError as error:
        raise LogError(where, f"is not TOML: {str(error)[:120]}", accepted=ACCEPTED) from error


def _column(where: str, heading: str, entry: Any, wheel_speeds: bool) -> tuple[str, Column]:
    if isinstance(entry, str):
        entry = {"quantity": entry}
    if not isinstance(entry, dict):
        raise LogError(where, "cannot be used", value=entry, accepted="a quantity or a table")
    _only(entry, ("quantity", "unit", "sign"), where)
    quantity = entry.get("quantity")
    if not (wheel_speeds and is_wheel_speed(quantity)):
        _known(where, quantity)
    sign = entry.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise LogError(f"{where}.sign", "is not a sign", value=sign, accepted="1 or -1")
    if quantity in TEXT and ("unit" in entry or sign != 1):
        raise LogError(where, "a label has no unit and no sign", accepted=f'"{quantity}" alone')
    factor, offset = _conversion(where, quantity, entry.get("unit"))
    return str(quantity), Column(heading, sign * factor, sign * offset)


def _constant(where: str, quantity: str, entry: Any) -> float | str:
    _known(where, quantity)
    if quantity in TEXT:
        if not isinstance(entry, str) or not entry:
            raise LogError(where, "is not a label", value=entry, accepted="text")
        return entry
    unit = None
    if isinstance(entry, dict):
        _only(entry, ("value", "unit"), where)
        entry, unit = entry.get("value"), entry.get("unit")
    accepted = "a finite number in SI, or with a unit"
    number = finite_number(entry)
    if number is None:
        raise LogError(where, "is not a number", value=entry, accepted=accepted)
    factor, offset = _conversion(where, quantity, unit)
    constant = factor * number + offset
    if not math.isfinite(constant):
        raise LogError(where, f"too large in {unit_of(quantity)}", value=entry, accepted=accepted)
    return constant


def _known(where: str, quantity: Any) -> None:
    if not isinstance(quantity, str) or not is_quantity(quantity):
        problem = f"no such quantity{suggestion(quantity, UNITS)}"
        accepted = ", ".join(sorted(UNITS))
        if is_wheel_speed(quantity):
            accepted = "wheel speeds in joulepath logs join, which makes vx, vy and wz of them"
        raise LogError(where, problem, value=quantity, accepted=accepted)


def _conversion(where: str, quantity: Any, unit: Any) -> tuple[float, float]:
    """Factor and offset from ``unit`` to the quantity's own."""
    if unit is None:
        return 1.0, 0.0
    own = unit_of(quantity)
    accepted = f"a unit that converts to {own}"
    if not isinstance(unit, str) or len(unit) > LONGEST_UNIT:
        raise LogError(f"{where}.unit", "is not a unit", value=unit, accepted=accepted)
    try:
        return conversion(unit, own)
    except ValueError as error:
        raise LogError(
            f"{where}.unit", f"cannot be converted ({error})", value=unit, accepted=accepted
        ) from error


def _table(document: dict[str, Any], key: str, where: str) -> dict[str, Any]:
    table = document.get(key, {})
    if not isinstance(table, dict):
        raise LogError(f"{where}: {key}", "is not a table", value=table, accepted=f"[{key}]")
    return table


def _only(table: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in known:
            problem = f"no such key{suggestion(key, known)}"
            raise LogError(f"{where}: {key}", problem, accepted=", ".join(known))
