"""Motors by name, with the values of their data sheets.

    [drive]
    motor = "pololu-37d-12v"        # in a vehicle's file; values given beside it take precedence

The catalogue is motors/motors.toml: tables as a vehicle's file has them, at the motor's own shaft.
A value that no data sheet at hand gives says "assumed" in its source.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from planner.reading import parse_toml

_CATALOGUE = Path(__file__).parent / "motors" / "motors.toml"


@dataclass(frozen=True)
class Motor:
    """One data sheet.

    Attributes:
        name: as a vehicle's file names it.
        title: maker and type.
        voltage: nominal, V; the battery's where a vehicle's file states none.
        values: by "table.key" of a vehicle's file, ``{ value, unit, source }``.
    """

    name: str
    title: str
    voltage: float
    values: dict[str, dict[str, Any]]


@lru_cache(maxsize=1)  # one small file
def read_motors() -> dict[str, Motor]:
    """All motors by name, in alphabetical order."""
    document = parse_toml(_CATALOGUE.read_bytes())
    return {
        name: Motor(
            name,
            entry["title"],
            float(entry["voltage"]),
            {
                f"{table}.{key}": value | {"source": f"motor {name}: {value['source']}"}
                for table in ("drive", "limits")
                for key, value in entry.get(table, {}).items()
            },
        )
        for name, entry in sorted(document.items())
    }
