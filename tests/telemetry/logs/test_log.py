"""Telemetry logs: what is read, derived and assumed, in chunks and as a whole."""

from __future__ import annotations

import math
import time as clock
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.quantities import STANDARD_GRAVITY
from planner.telemetry.logs.log import Telemetry
from tests.telemetry.odd_logs import (
    column,
    table,
    written,
)

DATA = Path(planner.__file__).resolve().parents[2] / "shared" / "data"


def test_a_sound_log_has_nothing_to_report(tmp_path: Path) -> None:
    columns = table()
    log = Telemetry.read(written(tmp_path, columns))
    assert log.report == ()
    assert log.run_names == ("run 0", "run 1")
    assert np.array_equal(log.run, np.repeat([0, 1], 30))
    for name in ("vx", "vy", "wz"):
        assert np.array_equal(column(log, name), columns[name])
    assert np.array_equal(log.power, columns["power"])
    assert log.present == {"run", "time", "vx", "vy", "wz", "power"}
    assert any("flat" in sentence for sentence in log.assumed)
    assert np.all(column(log, "gravity_normal") == STANDARD_GRAVITY)


def test_one_hundred_thousand_rows_take_less_than_half_a_second(tmp_path: Path) -> None:
    columns = table(100_000, runs=200)
    path = written(tmp_path, columns | {"pitch": 0.1 * columns["vy"], "surface": ["a"] * 100_000})
    best = math.inf
    for _ in range(3):
        begin = clock.process_time()
        assert len(Telemetry.read(path)) == 100_000
        best = min(best, clock.process_time() - begin)
    assert best < 0.5


# Logs measured by others.


def foreign(name: str) -> Path:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{name} is not part of the project and is not here")
    return path


def test_robotino_log() -> None:
    log = Telemetry.read(foreign("robotino/robotino_two_floors.csv"))
    assert len(log.run_names) == 288
    assert set(log.surfaces) == {"brown", "gray"}
    assert {f"wheel_current_{n}" for n in (1, 2, 3)} <= log.present
    assert np.allclose(log.interval, 1.0)
    # Steady runs: what is derived is small against the 0.1 m/s in one second of a start.
    assert np.median(np.abs(column(log, "ax"))) < 0.02


@pytest.mark.parametrize("name", ["contact_plain.csv", "contact_payload.csv"])
def test_contact_log(name: str) -> None:
    log = Telemetry.read(foreign(f"contact/{name}"))
    assert len(log.run_names) == 12
    # Accelerations were logged as well; the derived ones agree up to the noise of the channels.
    assert {"ax", "ay", "roll", "pitch", "com_x"} <= log.present
    assert log.interval == pytest.approx(0.2)
    change = np.gradient(column(log, "vx")[:250], 0.2)
    derived = change - column(log, "wz")[:250] * column(log, "vy")[:250]
    assert np.corrcoef(derived, column(log, "ax")[:250])[0, 1] > 0.9
