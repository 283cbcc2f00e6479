"""Logs that are odd, short or hardly say anything go through every verb without a stumble."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner import PowerModel, Telemetry, adopt, compare, diagnose
from planner.errors import LogError
from planner.telemetry.virtual import Noise, VirtualLog, VirtualRobot
from tests.telemetry.odd_logs import ODD


def strict(document: Any) -> Any:
    """The document as strict JSON: no NaN, no infinity."""
    return json.loads(json.dumps(document, allow_nan=False))


def through_all(path: Path) -> dict[str, Any]:
    rows = len(Telemetry.read(path))
    compared = strict(compare(path, "minibalance").to_json())
    assert compared["log"]["rows"] == rows
    found = strict(diagnose(path, "minibalance").to_json())
    assert found["log"]["report"] == compared["log"]["report"]
    adoption = adopt("air_drag", path, "minibalance")
    adopted = strict(adoption.to_json())
    document = strict(adoption.model.document())
    assert PowerModel.from_document(document).document() == document
    assert adopted["adopted"] == ["air_drag"]
    if "air_drag" not in found["selected"]:
        assert adopted["warnings"]
    return found


@pytest.mark.parametrize("name", ODD)
def test_an_odd_log_is_diagnosed(tmp_path: Path, name: str) -> None:
    write, *_ = ODD[name]
    found = through_all(write(tmp_path))
    # Sixty rows name nothing with certainty.
    assert found["verdict"] in ("complete", "not_identifiable", "sensor_error", "missing_effect")


@pytest.mark.parametrize("verb", [compare, diagnose])
def test_a_log_of_some_rows_is_refused(tmp_path: Path, verb: Any) -> None:
    few = {name: column[:4] for name, column in driven().columns.items()}
    VirtualLog(few, {}).write_csv(tmp_path / "log.csv")
    with pytest.raises(LogError, match="only 4 usable rows"):
        verb(tmp_path / "log.csv", "minibalance")


def driven() -> VirtualLog:
    robot = VirtualRobot("minibalance", seed=8)
    return robot.drive(robot.profile("rich", runs=5, rows=40), noise=Noise(level=0.02))


STRANGE = {
    "standing still": lambda c: {name: 0.0 * c[name] for name in ("vx", "vy", "wz", "ax", "ay")},
    "power without motion": lambda c: {
        "power": np.random.default_rng(1).uniform(0, 50, c["vx"].size)
    },
    "no power at all": lambda c: {"power": 0.0 * c["power"]},
    "power the wrong way round": lambda c: {"power": np.max(c["power"]) - c["power"]},
    "power of another robot": lambda c: {"power": 400.0 + 90.0 * np.abs(c["vx"])},
    "one speed": lambda c: {"vx": 0.0 * c["vx"] + 0.5, "vy": 0.0 * c["vy"], "wz": 0.0 * c["wz"]},
    "upside down": lambda c: {"pitch": -c["pitch"], "roll": -c["roll"]},
    "left is right": lambda c: {"vy": -c["vy"], "ay": -c["ay"]},
    "enormous payload": lambda c: {"payload": 0.0 * c["vx"] + 900.0},
    "mass outside the wheels": lambda c: {"com_x": 0.0 * c["vx"] + 5.0},
    "boiling": lambda c: {"motor_temp": 0.0 * c["vx"] + 240.0},
    "storm": lambda c: {"wind_x": 0.0 * c["vx"] + 60.0},
}


@pytest.mark.parametrize("name", STRANGE)
def test_a_strange_drive_is_diagnosed_or_refused_in_one_sentence(tmp_path: Path, name: str) -> None:
    columns = dict(driven().columns)
    columns |= {
        key: np.broadcast_to(value, columns["power"].shape)
        for key, value in STRANGE[name](columns).items()
    }
    VirtualLog(columns, {}).write_csv(tmp_path / "log.csv")
    through_all(tmp_path / "log.csv")
