"""`joulepath logs join`: files in, one log and its account out."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from planner.telemetry.logs import Telemetry
from service.cli import run
from tests.service.cli.command import joulepath


def files(folder: Path) -> list[str]:
    """Odometry at 10 Hz and power at 2 Hz of a robot that starts after 5 s."""
    odometry = [f"{k / 10},{0.5 if k > 50 else 0.0},0,0" for k in range(1, 201)]
    power = [f"{k / 2},{20.0 if k > 10 else 5.0}" for k in range(1, 41)]
    (folder / "odom.csv").write_text("\n".join(["time,vx,vy,wz", *odometry]))
    (folder / "power.csv").write_text("\n".join(["time,power", *power]))
    return [str(folder / "odom.csv"), str(folder / "power.csv")]


def test_two_files_become_a_log(tmp_path: Path) -> None:
    out = str(tmp_path / "drive.csv")
    done = joulepath("logs", "join", *files(tmp_path), "--out", out, "--run", "yard", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads(done.stdout)
    assert report["interval_s"] == 0.5
    log = Telemetry.read(out)
    assert log.run_names == ("yard",)
    assert len(log) == report["rows"] == 39
    told = joulepath("logs", "join", *files(tmp_path), "--out", out)
    assert "averaged: vx (odom.csv, 10 Hz)" in told.stdout


def test_one_sentence_for_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both, out = files(tmp_path), str(tmp_path / "drive.csv")
    for arguments, words in (
        (("split", *both, "--out", out), ["logs", "no such command", "logs join"]),
        (("join", both[0], "--out", out), ["'power'", "battery_voltage"]),
        (("join", *both, "--out", out, "--shift", "5"), ["--shift", "FILE=SECONDS"]),
        (("join", *both, "--out", out, "--interval", "-1"), ["interval", "-1"]),
    ):
        assert run(["logs", *arguments]) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert len(told.err.splitlines()) == 1
        for word in words:
            assert word in told.err
