"""Small logs made by hand, and odd ones, each with what is to be found in it."""

from __future__ import annotations

import gzip
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry

Table = dict[str, Any]


def table(count: int = 60, runs: int = 2, interval: float = 0.1) -> Table:
    """A sound log: a slalom at changing speed, two runs."""
    each = count // runs
    k = np.arange(count) % each
    t = (k + 1) * interval
    return {
        "run": [f"run {i}" for i in np.arange(count) // each],
        "time": t,
        "vx": 0.5 + 0.2 * np.sin(t),
        "vy": 0.1 * np.cos(2.0 * t),
        "wz": 0.3 * np.sin(1.5 * t),
        "power": 40.0 + 10.0 * np.sin(t + 0.3),
    }


def text(columns: Table, separator: str = ",", decimal: str = ".") -> str:
    """CSV of a table."""

    def cell(value: Any) -> str:
        return value if isinstance(value, str) else repr(float(value)).replace(".", decimal)

    lines = [separator.join(columns)]
    rows = zip(*columns.values(), strict=True)
    lines += [separator.join(cell(value) for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def written(folder: Path, columns: Table, name: str = "log.csv") -> Path:
    path = folder / name
    path.write_text(text(columns), encoding="utf-8")
    return path


def changed(**columns: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        result = table() | columns
        return written(folder, {k: v for k, v in result.items() if v is not None})

    return write


def as_bytes(content: bytes, name: str = "log.csv") -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return write


def spoilt(name: str, row: int, value: Any) -> list[Any]:
    values: list[Any] = list(table()[name])
    values[row] = value
    return values


LATER = table(runs=1)["time"]


SOUND = text(table())


def column(log: Telemetry, name: str) -> Any:
    return log.rows[:, INDEX[name]]


def kinds(log: Telemetry) -> set[tuple[str, str]]:
    return {(finding.kind, finding.column) for finding in log.report}


GAPPED = table(runs=1)["time"] + np.where(np.arange(60) > 30, 7.0, 0.0)


DOUBLED = table()["time"].copy()


DOUBLED[[5, 40]] = DOUBLED[[4, 39]]


ODD: dict[str, tuple[Callable[[Path], Path], tuple[str, str], int]] = {
    "empty cells": (changed(power=spoilt("power", 3, "")), ("missing", "power"), 59),
    "NaN": (changed(vx=spoilt("vx", 3, math.nan)), ("missing", "vx"), 59),
    "infinity": (changed(vx=spoilt("vx", 3, math.inf)), ("missing", "vx"), 59),
    "1e999": (changed(wz=spoilt("wz", 3, "1e999")), ("missing", "wz"), 59),
    "no label": (changed(run=spoilt("run", 3, "")), ("missing", "run"), 59),
    "pitch lost": (changed(pitch=[0.0, 0.1, "", *[0.02] * 57]), ("missing", "pitch"), 59),
    "wind lost": (changed(wind_x=[1.0, 2.0, "", *[3.0] * 57]), ("filled", "wind_x"), 60),
    "doubled samples": (changed(time=DOUBLED), ("doubled", "time"), 58),
    "gap": (changed(run=["a"] * 60, time=GAPPED), ("gap", "time"), 60),
    "slow seconds": (changed(time=table()["time"] * 200), ("unit", "time"), 60),
    "one-row run": (changed(run=["a"] * 59 + ["b"], time=LATER), ("one-row run", "run"), 60),
    "one-row runs": (changed(run=[f"{k}" for k in range(60)]), ("one-row run", "run"), 60),
    "constant": (changed(vy=np.zeros(60)), ("constant", "vy"), 60),
    "constant power": (changed(power=np.full(60, 9.0)), ("constant", "power"), 60),
    "clipped": (changed(power=np.minimum(table()["power"], 46.0)), ("clipped", "power"), 60),
    "braking cut off": (
        changed(power=np.maximum(table()["power"] - 47.0, 0.0)),
        ("clipped", "power"),
        60,
    ),
    "kW": (changed(power=table()["power"] / 1e3), ("unit", "power"), 60),
    "sign": (
        changed(power=np.where(np.arange(60) % 5, -1.0, 1.0) * table()["power"]),
        ("sign", "power"),
        60,
    ),
    "two meters": (
        changed(battery_voltage=np.full(60, 24.0), battery_current=table()["power"] / 48.0),
        ("disagrees", "power"),
        60,
    ),
    "repeated values": (
        changed(**{k: np.repeat(table()[k][::2], 2) for k in ("vx", "vy", "wz", "power")}),
        ("repeated", ""),
        60,
    ),
    "unknown column": (changed(Roll=np.zeros(60)), ("not used", "Roll"), 60),
    "byte-order mark": (as_bytes(b"\xef\xbb\xbf" + SOUND.encode()), ("format", ""), 60),
    "semicolons and commas": (as_bytes(text(table(), ";", ",").encode()), ("format", ""), 60),
    "separator line of Excel": (
        as_bytes(b"sep=;\n" + SOUND.replace(",", ";").encode()),
        ("format", ""),
        60,
    ),
    "comments above": (as_bytes(b"# robot 7\n# yard\n" + SOUND.encode()), ("format", ""), 60),
    "tabs": (as_bytes(text(table(), "\t").encode()), ("format", ""), 60),
    "gzip": (as_bytes(gzip.compress(SOUND.encode()), "log.csv.gz"), ("format", ""), 60),
    "power cut in the last line": (as_bytes(SOUND.encode() + b"run 1,3.1"), ("ragged", ""), 60),
}
