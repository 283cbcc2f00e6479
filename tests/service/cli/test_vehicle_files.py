"""Vehicle files at the command line: a template, a check, and one sentence for what is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from planner.errors import VehicleError
from planner.power.vehicles import load_vehicle, template
from service.cli import run
from tests.service.cli.command import joulepath

WRONG = [
    ("mass = 12.0", "mass = -3", "body.mass"),
    ("mass = 12.0", "mass = 0", "body.mass"),
    ("mass = 12.0", "mass = nan", "body.mass"),
    ("mass = 12.0", "mass = true", "body.mass"),
    ("mass = 12.0", 'mass = "12 kg"', "body.mass"),
    ("mass = 12.0", "mass = [12.0]", "body.mass"),
    ("mass = 12.0", "mass = 1" + "0" * 400, "body.mass"),
    ("mass = 12.0", "mas = 12.0", "'mass'?"),
    ("mass = 12.0", 'mass = { value = 12, unit = "mm" }', "body.mass"),
    ("mass = 12.0", 'mass = { value = 12, unit = "" }', "body.mass"),
    ("mass = 12.0", 'mass = { value = 12, unit = "kg/" }', "body.mass"),
    ("mass = 12.0", "mass = { value = 12, unit = 7 }", "body.mass"),
    ("mass = 12.0", 'mass = { unit = "kg" }', "body.mass"),
    ("mass = 12.0", 'mass = { value = 12, units = "kg" }', "'unit'?"),
    ("mass = 12.0", "mass = { value = 12, source = 3 }", "body.mass source"),
    ("mass = 12.0", "mass = { value = 12, uncertainty = -0.1 }", "body.mass uncertainty"),
    ("mass = 12.0", 'mass = { value = 12, uncertainty = "10 %" }', "body.mass uncertainty"),
    ("length = 0.6", "length = 600", "body.length"),
    ("length = 0.6", 'length = { value = 600, unit = "m" }', "body.length"),
    ('layout = "mecanum"', 'layout = "tank"', "layout"),
    ('layout = "mecanum"', "layout = 4", "layout"),
    ('layout = "mecanum"', 'layout = "omni"', "wheels.base_radius"),
    ("half_track = 0.2", "", "wheels.half_track"),
    ("half_track = 0.2", "half_track = 1e9", "wheels.half_track"),
    ("radius = 0.05", 'radius = { value = 50, unit = "Ω" }', "wheels.radius"),
    ("radius = 0.05", "radius = 0.05\nroller_angle = 45", "wheels.roller_angle"),
    ("radius = 0.05", "radius = 0.05\nangles = 3", "angles"),
    ("gear_ratio = 20.0", "gear_ratio = 0", "drive.gear_ratio"),
    ("gear_ratio = 20.0", 'gear_ratio = "20:1"', "drive.gear_ratio"),
    ("gear_ratio = 20.0", 'gear_ratio = { value = 20, unit = "m" }', "drive.gear_ratio"),
    ("resistance = 1.5", "", "drive.resistance"),
    ("resistance = 1.5", 'motor = "my motor"', "drive.motor"),
    ("resistance = 1.5", "resistance = 1.5\ngear_efficiency = 80", "drive.gear_efficiency"),
    ("resistance = 1.5", "resistance = 1.5\nno_load_current = -1", "drive.no_load_current"),
    ("[limits]", "[limits]\nspeed = 'fast'", "limits.speed"),
    ("[limits]", "[limit]", "limit"),
    ("[battery]", '[battery]\ncapacity = { value = 5, unit = "Ah" }', "battery.capacity"),
    ("[battery]", "[battery]\nvoltage = 0", "battery.voltage"),
    ("[battery]", "[effects]\nactive = 'air_drag'", "active"),
    ("[battery]", "[effects.air_drag]\nshape = 1.0", "shape"),
    ("[battery]", "[battery", "not TOML"),
    ('name = "my-robot"', "name = 3", "name"),
]


@pytest.mark.parametrize(("old", "new", "where"), WRONG)
def test_one_sentence_in_python_and_at_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, where: str
) -> None:
    lines = template().splitlines()
    place = next(k for k, line in enumerate(lines) if line.startswith(old))
    path = tmp_path / "robot.toml"
    path.write_text("\n".join([*lines[:place], new, *lines[place + 1 :]]) + "\n", "utf-8")
    with pytest.raises(VehicleError) as caught:
        load_vehicle(str(path))
    assert run(["vehicles", "check", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == f"joulepath: {caught.value}\n"
    for word in ("robot.toml", where, "accepted:"):
        assert word in err


def test_more_than_forty_are_tried() -> None:
    assert len(WRONG) >= 40


def test_a_template_is_checked_and_a_vehicle_written(tmp_path: Path) -> None:
    made = joulepath("vehicles", "new")
    assert (made.returncode, made.stderr) == (0, "")
    path = tmp_path / "robot.toml"
    path.write_text(made.stdout, "utf-8")
    table = joulepath("vehicles", "check", str(path))
    assert table.returncode == 0
    for word in ("level", "5° up", "sideways", "odd", "body.yaw_inertia", "without a source"):
        assert word in table.stdout
    report = json.loads(joulepath("vehicles", "check", str(path), "--json").stdout)
    assert report["motions"][0]["name"] == "level"
    written = joulepath("vehicles", str(path), "--toml")
    path.write_text(written.stdout, "utf-8")
    assert load_vehicle(str(path)).mass == 12.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check"], ["FILE", "is missing", "vehicles check FILE"]),
        (["minibalance", "robotino"], ["too many"]),
        (["check", "nowhere.toml"], ["no such vehicle"]),
    ],
)
def test_what_is_to_be_checked_must_be_named(
    capsys: pytest.CaptureFixture[str], arguments: list[str], words: list[str]
) -> None:
    assert run(["vehicles", *arguments]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    for word in words:
        assert word in told.err
