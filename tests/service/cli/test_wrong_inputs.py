"""Forty wrong inputs in Python and forty at the command line: one sentence each.

The sentence names the field and the value, and says what is accepted. Nothing is planned.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import planner
from planner.errors import InputError
from service import cli, compiling

MAP, HERE, THERE = "test-bench", {"x": 1.0, "y": 1.5}, {"x": 13.0, "y": 1.5}
GOOD: dict[str, Any] = {"map": MAP, "start": HERE, "goal": THERE}
CIRCLE = {"x": 1, "y": 1, "radius": 1}

FIELDS: list[tuple[dict[str, Any], str, str]] = [
    ({"map": 7}, "map", "7"),
    ({"map": ""}, "map", "''"),
    ({"map": "atlantis"}, "map", "'atlantis'"),
    ({"map": "missing.tif"}, "map", "'missing.tif'"),
    ({"vehicle": "hovercraft"}, "vehicle", "'hovercraft'"),
    ({"vehicle": 3}, "vehicle", "3"),
    ({"model": "m.json", "vehicle": "minibalance"}, "model", "'m.json'"),
    ({"model": "none.json"}, "none.json", ""),
    ({"start": None}, "start", ""),
    ({"start": [1, 2, 3, 4]}, "start", "[1, 2, 3, 4]"),
    ({"start": {"x": 1.0}}, "start.y", ""),
    ({"start": {"x": "1", "y": 1}}, "start.x", "'1'"),
    ({"start": {"x": True, "y": 1}}, "start.x", "True"),
    ({"start": {"x": float("nan"), "y": 1}}, "start.x", "nan"),
    ({"start": {"x": 1e12, "y": 1}}, "start.x", "1000000000000.0"),
    ({"start": {"x": 1, "y": 1, "yaw": "east"}}, "start.yaw", "'east'"),
    ({"start": {"x": 1, "y": 1, "jaw": 0}}, "start.jaw", "'yaw'"),
    ({"start": {"x": 500.0, "y": 1}}, "start", "(500.0, 1.0)"),
    ({"goal": "home"}, "goal", "'home'"),
    ({"goal": {"x": 1, "y": 1, "radius": -1}}, "goal.radius", "-1"),
    ({"goal": {"polygon": [[1, 1], [2, 2]]}}, "goal.polygon", "[1, 1]"),
    ({"goal": {"any": []}}, "goal.any", "[]"),
    ({"via": {"x": 1}}, "via", "{'x': 1}"),
    ({"via": [{"x": 1}]}, "via[0].y", ""),
    ({"payload": 5}, "payload", "5"),
    ({"payload": {"mass": -5}}, "payload.mass", "-5"),
    ({"payload": {"mas": 5}}, "payload.mas", "'mass'"),
    ({"conditions": {"motor_temp": 900}}, "conditions.motor_temp", "900"),
    ({"conditions": {"wind": {"x": "3 m/s"}}}, "conditions.wind.x", "'3 m/s'"),
    ({"conditions": {"battery_charge": 80}}, "conditions.battery_charge", "80"),
    ({"avoid": CIRCLE}, "avoid", "radius"),
    ({"avoid": [{"x": 1, "y": 1}]}, "avoid[0]", "{'x': 1, 'y': 1}"),
    ({"objective": "fun"}, "objective", "'fun'"),
    ({"max_duration_s": 0}, "max_duration_s", "0"),
    ({"alternatives": 9}, "alternatives", "9"),
    ({"alternatives": 1.5}, "alternatives", "1.5"),
    ({"seed": -1}, "seed", "-1"),
    ({"time_budget_s": "2 s"}, "time_budget_s", "'2 s'"),
    ({"iterations": 0}, "iterations", "0"),
    ({"planner": "astar"}, "planner", "'astar'"),
]

LINES: list[tuple[str, str, str]] = [
    ("plan", "request", ""),
    ("plan none.json", "none.json", ""),
    ("plan broken.json", "request", ""),
    ("plan --map test-bench", "start", ""),
    ("plan --map test-bench --start 1 --goal 2,2", "--start", "'1'"),
    ("plan --map test-bench --start 1,1,1,1 --goal 2,2", "--start", "'1,1,1,1'"),
    ("plan --map test-bench --start 1,nan --goal 2,2", "start.y", "nan"),
    ("plan --map atlantis --start 1,1 --goal 2,2", "map", "'atlantis'"),
    ("plan --map test-bench --vehicle hovercraft --start 1,1 --goal 2,2", "vehicle", "hovercraft"),
    ("plan --map test-bench --model none.json --start 1,1 --goal 2,2", "none.json", ""),
    ("plan good.json --objective fun", "objective", "'fun'"),
    ("plan good.json --seed one", "--seed", "'one'"),
    ("plan good.json --seed -1", "seed", "-1"),
    ("plan good.json --time-budget 0", "time_budget_s", "0"),
    ("plan good.json --iterations 0", "iterations", "0"),
    ("plan good.json --certify -1", "certify_s", "-1"),
    ("plan good.json --format kml", "--format", "'kml'"),
    ("plan good.json --format csv --json", "--json", "csv"),
    ("plan good.json --out file/answer", "file/answer", ""),
    ("plan good.json --sped 3", "--sped", ""),
    ("fly", "fly", ""),
    ("matrix good.json", "start", ""),
    ("reach good.json", "goal", ""),
    ("front good.json --out file/answer", "file/answer", ""),
    ("graph test-bench none.geojson", "none.geojson", ""),
    ("graph test-bench broken.json", "broken.json", ""),
    ("graph test-bench good.json", "graph", ""),
    ("compare-planners good.json --runs 0", "--runs", "0"),
    ("serve --port 99999", "--port", "99999"),
    ("compare none.csv --vehicle minibalance", "none.csv", ""),
    ("compare broken.json --vehicle minibalance", "broken.json", ""),
    ("compare log.csv --vehicle hovercraft", "vehicle", "hovercraft"),
    ("diagnose log.csv", "--vehicle", ""),
    ("diagnose log.csv --vehicle minibalance", "power", ""),
    ("adopt air_drag none.csv --vehicle minibalance --out m.json", "none.csv", ""),
    ("maps inspect warehouse", "maps", "'inspect'"),
    ("maps check atlantis", "map", "'atlantis'"),
    ("vehicles check hovercraft", "vehicle", "hovercraft"),
    ("vehicles check", "FILE", ""),
    ("logs join none.csv --out drive.csv", "none.csv", ""),
]


def test_there_are_forty_of_each() -> None:
    assert (len(FIELDS), len(LINES)) == (40, 40)


@pytest.mark.parametrize(("changed", "field", "value"), FIELDS, ids=str)
def test_python_says_field_value_and_what_is_accepted(
    changed: dict[str, Any], field: str, value: str
) -> None:
    with pytest.raises(InputError) as caught:
        planner.plan_route({**GOOD, **changed})
    said = str(caught.value)
    assert "\n" not in said
    assert field in caught.value.field
    assert value in said
    assert "; accepted: " in said
    assert caught.value.accepted


@pytest.mark.parametrize(("line", "field", "value"), LINES, ids=str)
def test_the_command_line_says_it_in_one_line(
    line: str,
    field: str,
    value: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(compiling, "compile_once", lambda *_: False)
    Path("good.json").write_text(json.dumps(GOOD))
    Path("broken.json").write_text("{")
    Path("file").write_text("")
    Path("log.csv").write_text("run,time,vx,vy,wz\na,0,0,0,0\na,1,0,0,0\n")
    assert cli.run(line.split()) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert len(printed.err.strip().splitlines()) == 1
    assert field in printed.err
    assert value in printed.err
    if line != "fly" and "--sped" not in line:
        assert "accepted: " in printed.err or "--help" in printed.err
