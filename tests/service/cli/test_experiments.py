"""`joulepath experiment`: a diagnosis in, files of velocity commands out."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.power.vehicles import load_vehicle
from planner.telemetry.diagnosis.advice.drives import drives_of, settings_of
from service.cli import run

LOG_IT = {"separates": [], "run": "Log pitch and roll.", "settings": {}}


def diagnosis(path: Path, *experiments: dict[str, Any]) -> str:
    path.write_text(json.dumps({"verdict": "complete", "experiments": experiments}))
    return str(path)


def drive(number: int) -> dict[str, Any]:
    vehicle = load_vehicle("minibalance")
    runs = [{"payload": load, "motor_temp": 60.0} for load in (0.0, 4.8)]
    settings = settings_of(drives_of(vehicle)[number], vehicle, runs, 2)
    return {"separates": ["a", "b"], "run": f"Drive number {number}.", "settings": settings}


def columns(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def test_every_drive_is_a_file_of_commands(tmp_path: Path, capsys) -> None:
    made = diagnosis(tmp_path / "d.json", LOG_IT, drive(0), drive(7))
    out = tmp_path / "drive.csv"
    assert run(["experiment", made, "--out", str(out), "--rate", "10", "--json"]) == 0
    written = json.loads(capsys.readouterr().out)["drives"]
    assert [Path(each["file"]).name for each in written] == ["drive.csv", "drive-2.csv"]
    limits = load_vehicle("minibalance").limits
    for each in written:
        table = columns(Path(each["file"]))
        assert list(table) == ["t", "vx", "vy", "wz"]
        assert np.diff(table["t"]) == pytest.approx(0.1)
        assert table["t"][-1] == pytest.approx(each["seconds"], abs=0.1)
        assert np.all(np.hypot(table["vx"], table["vy"]) <= limits.speed)
        rates = np.hypot(np.diff(table["vx"]), np.diff(table["vy"])) / 0.1
        assert np.all(rates <= 1.01 * limits.acceleration)
        assert each["minutes"] == pytest.approx(2 * table["t"][-1] / 60.0, abs=0.1)
    assert run(["experiment", made, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "run 2: 4.8 kg of load, motors at 60 °C" in said
    assert "needs 4.1 m by 1.1 m" in said


def test_a_drive_fits_the_stated_area(tmp_path: Path, capsys) -> None:
    made, out = diagnosis(tmp_path / "d.json", drive(0)), str(tmp_path / "drive.csv")
    assert run(["experiment", made, "--out", out, "--area", "3.2x1.2", "--json"]) == 0
    (written,) = json.loads(capsys.readouterr().out)["drives"]
    assert written["area"][0] <= 3.2
    table = columns(Path(out))
    x = np.cumsum(table["vx"]) * 0.05
    assert np.ptp(x) + np.hypot(0.86, 0.52) <= 3.25


def test_one_sentence_for_what_is_wrong(tmp_path: Path, capsys) -> None:
    good, none = (
        diagnosis(tmp_path / name, entry) for name, entry in (("g", drive(0)), ("n", LOG_IT))
    )
    out = ("--out", str(tmp_path / "drive.csv"))
    broken = drive(0)
    broken["settings"]["legs"][0]["vx"] = 1e9
    wild = diagnosis(tmp_path / "w", broken)
    for arguments, words in (
        ((str(tmp_path / "absent.json"), *out), ["absent.json", "cannot be read", "diagnose"]),
        ((none, *out), ["recommends no drive", "Log pitch and roll"]),
        ((wild, *out), ["is no diagnosis"]),
        ((good, *out, "--area", "wide"), ["--area", "'wide'", "4x3"]),
        ((good, *out, "--area", "1.2x1.1"), ["area", "1.2 x 1.1 m", "4.1 x 1.1 m"]),
        ((good, *out, "--rate", "0"), ["--rate", "1 to 1000"]),
    ):
        assert run(["experiment", *arguments]) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert len(told.err.splitlines()) == 1
        for word in words:
            assert word in told.err
