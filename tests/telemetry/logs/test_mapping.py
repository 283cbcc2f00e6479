"""Mapping files: other names, units and signs, and one clear sentence for a bad one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.errors import LogError
from planner.telemetry.logs.log import Telemetry
from tests.telemetry.odd_logs import (
    column,
    table,
    written,
)


def test_a_mapping_adapts_names_units_and_signs(tmp_path: Path) -> None:
    columns = table(runs=1)
    foreign = {
        "stamp": columns["time"] * 1e3,
        "Vel X [mm/s]": columns["vx"] * 1e3,
        "left": -columns["vy"],
        "yaw": np.degrees(columns["wz"]),
        "P": -columns["power"] / 1e3,
        "T": np.full(60, 68.0),
    }
    (tmp_path / "map.toml").write_text(
        """
        power_at = "source"
        [columns]
        stamp = { quantity = "time", unit = "ms" }
        "Vel X [mm/s]" = { quantity = "vx", unit = "mm/s" }
        left = { quantity = "vy", sign = -1 }
        yaw = { quantity = "wz", unit = "deg/s" }
        P = { quantity = "power", unit = "kW", sign = -1 }
        T = { quantity = "ambient_temp", unit = "°F" }
        [constants]
        run = "yard"
        payload = { value = 2, unit = "lb" }
        """,
        encoding="utf-8",
    )
    log = Telemetry.read(written(tmp_path, foreign), tmp_path / "map.toml")
    assert log.power_at == "source"
    assert np.allclose(column(log, "vx"), columns["vx"])
    assert np.allclose(column(log, "vy"), columns["vy"])
    assert np.allclose(column(log, "wz"), columns["wz"])
    assert np.allclose(log.power, columns["power"])
    assert np.allclose(column(log, "ambient_temp"), 20.0)  # 68 °F
    assert np.allclose(column(log, "payload"), 0.90718474)  # the pound of 1959


BAD_MAPPINGS = {
    "unknown key": "unit = 3",
    "not TOML": "columns = [",
    "unknown quantity": '[columns]\nvx = "vel_x"',
    "other dimension": '[columns]\nvx = {quantity="vx", unit="kg"}',
    "no unit": '[columns]\nvx = {quantity="vx", unit="blorp"}',
    "code as unit": '[columns]\nvx = {quantity="vx", unit="__import__(\'os\')"}',
    "sign 0": '[columns]\nvx = {quantity="vx", sign=0}',
    "column not there": '[columns]\nvelocity = "vx"',
    "twice": '[columns]\nvx = "vy"\nvy = "vy"',
    "place": 'power_at = "wall"',
    "constant text": '[constants]\npayload = "2"',
    "constant inf": "[constants]\npayload = inf",
    "constant of 400 digits": f"[constants]\npayload = {'1' * 400}",
    "constant of 5000 digits": f"[constants]\npayload = {'1' * 5000}",
    "constant of 400 digits and a unit": (
        f'[constants]\npayload = {{value={"1" * 400}, unit="lb"}}'
    ),
    "constant too large in SI": '[constants]\npayload = {value=1e308, unit="Gg"}',
    "sign of 400 digits": f'[columns]\nvx = {{quantity="vx", sign={"1" * 400}}}',
    "sign of 5000 hexadecimal digits": (f'[columns]\nvx = {{quantity="vx", sign=0x{"f" * 5000}}}'),
    "interval of 400 digits": f"[rosbag]\ninterval = {'1' * 400}",
    "nested": f"a = {'[' * 20_000}",
    "label with unit": '[columns]\nrun = {quantity="run", unit="m"}',
    "interval": "[rosbag]\ninterval = 0",
    "column and constant": '[columns]\nvx = "vx"\n[constants]\nvx = 2',
}


@pytest.mark.parametrize("name", BAD_MAPPINGS)
def test_a_bad_mapping_is_one_clear_sentence(tmp_path: Path, name: str) -> None:
    (tmp_path / "map.toml").write_text(BAD_MAPPINGS[name])
    with pytest.raises(LogError, match=r"map\.toml.*; accepted: ") as caught:
        Telemetry.read(written(tmp_path, table()), tmp_path / "map.toml")
    assert "\n" not in str(caught.value)


def test_wheel_speeds_in_a_mapping_are_sent_to_join(tmp_path: Path) -> None:
    columns = {"vx": {"quantity": "wheel_speed_1", "unit": "rpm"}}
    with pytest.raises(LogError, match=r"columns\.vx: no such quantity.*joulepath logs join"):
        Telemetry.read(written(tmp_path, table()), {"columns": columns})
