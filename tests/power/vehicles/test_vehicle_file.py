"""Vehicle files: what they hold, and one clear sentence for everything that is wrong with one."""

from __future__ import annotations

import csv
import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import planner
from planner.errors import VehicleError
from planner.power.account import PerWheel
from planner.power.catalogue import all_effects
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles.vehicle import Vehicle
from planner.power.vehicles.vehicle_file import VEHICLE_FOLDER, list_vehicles, load_vehicle

NAMES = ("minibalance", "robotino")
each_vehicle = pytest.mark.parametrize("name", NAMES)
DATA = Path(planner.__file__).resolve().parents[2] / "shared" / "data"

SMALLEST = """
[body]
mass = 10.0
length = 0.6
width = 0.5
[wheels]
layout = "mecanum"
half_wheelbase = 0.2
half_track = 0.2
radius = 0.05
[drive]
gear_ratio = 20.0
torque_constant = 0.03
resistance = 1.5
"""
REQUIRED = (
    *("body.mass", "body.length", "body.width", "wheels.layout", "wheels.radius"),
    *("wheels.half_wheelbase", "wheels.half_track"),
    *("drive.gear_ratio", "drive.torque_constant", "drive.resistance"),
)
OMNI = """
[body]
mass = 10.0
length = 0.4
width = 0.4
[drive]
gear_ratio = 20.0
torque_constant = 0.03
resistance = 1.5
[wheels]
layout = "omni"
base_radius = 0.15
radius = 0.05
"""

Write = Callable[[str], Vehicle]


@pytest.fixture
def load(tmp_path: Path) -> Write:
    """Load a vehicle from the text of its file."""

    def write(text: str) -> Vehicle:
        path = tmp_path / "robot.toml"
        path.write_text(text, encoding="utf-8")
        return load_vehicle(str(path))

    return write


def test_installed_vehicles() -> None:
    assert {entry["name"] for entry in list_vehicles()} == set(NAMES)
    assert {path.stem for path in VEHICLE_FOLDER.glob("*.toml")} == set(NAMES)


@each_vehicle
def test_every_value_has_unit_and_source(name: str) -> None:
    document = tomllib.loads((VEHICLE_FOLDER / f"{name}.toml").read_text("utf-8"))
    tables = [document[key] for key in document if isinstance(document[key], dict)]
    tables += [table for table in document["effects"].values() if isinstance(table, dict)]
    for table in tables:
        for key, value in table.items():
            if key in ("layout", "active") or key in all_effects():
                continue
            assert set(value) - {"uncertainty"} == {"value", "unit", "source"}, key
            assert len(value["source"]) > 4, key
    assert load_vehicle(name).provenance.sources


def test_minibalance_is_the_papers_robot() -> None:
    # Mass, overall size and supply voltage are printed in the paper.
    vehicle = load_vehicle("minibalance")
    assert (vehicle.mass, vehicle.length, vehicle.width) == (12.0, 0.86, 0.52)
    assert vehicle.layout.wheel_count == 4
    candidates = {slug for slug in vehicle.active if not all_effects()[slug].base}
    assert candidates == {
        *("driver_loss", "sensor_rate", "viscous_drag", "converter_efficiency"),
        *("regeneration_limit", "com_offset"),
    }


def test_robotino_has_three_omni_wheels() -> None:
    vehicle = load_vehicle("robotino")
    assert vehicle.layout.wheel_count == 3
    assert vehicle.gear_ratio == 16.0
    # The measured power is that of the motor terminals.
    assert PowerModel.from_vehicle(vehicle).watts(rows_from())[0] == pytest.approx(0.0, abs=1e-9)


def test_robotino_meets_its_measurements() -> None:
    path = DATA / "robotino" / "robotino_two_floors.csv"
    if not path.is_file():
        pytest.skip("measurements of Robotino are not here")
    with path.open() as file:
        samples = [row for row in csv.DictReader(file) if row["surface"] == "brown"]
    columns = {
        name: np.array([float(row[name]) for row in samples])
        for name in ("vx", "vy", "wz", "power")
    }
    power = columns.pop("power")
    watts = PowerModel.from_vehicle(load_vehicle("robotino")).watts(rows_from(**columns))
    # Priors, uncalibrated: right in the mean, and by heading and speed to a fifth.
    assert watts.mean() == pytest.approx(power.mean(), rel=0.1)
    assert np.sqrt(np.mean((watts - power) ** 2)) < 0.2 * power.mean()


def without(text: str, *keys: str) -> str:
    """The text of a vehicle file without some of its keys ("table.key")."""
    table, kept = "", []
    for line in text.splitlines():
        if line.startswith("["):
            table = line.strip("[]")
        if f"{table}.{line.split(' =')[0]}" not in keys:
            kept.append(line)
    return "\n".join(kept) + "\n"


def test_the_smallest_file_is_enough(load: Write) -> None:
    vehicle = load(SMALLEST)
    assert (vehicle.mass, vehicle.gear_ratio) == (10.0, 20.0)
    motor = vehicle.parameters["copper_loss"]
    assert (motor["torque_constant"], motor["resistance"]) == (0.03, 1.5)
    assert not set(REQUIRED) & set(vehicle.provenance.defaults_taken)
    for key in ("contact.rolling", "limits.speed", "electronics.power", "battery.voltage"):
        assert key in vehicle.provenance.defaults_taken
    assert PowerModel.from_vehicle(vehicle).watts(rows_from(vx=0.3))[0] > 0.0


@pytest.mark.parametrize("key", REQUIRED)
def test_a_robot_is_not_planned_on_the_values_of_another(load: Write, key: str) -> None:
    with pytest.raises(VehicleError, match=rf"{key.replace('.', '[.]')} is missing") as caught:
        load(without(SMALLEST, key))
    assert "robot.toml" in caught.value.field
    assert key in caught.value.accepted


@pytest.mark.parametrize("key", ["base_radius", "angles", "radius"])
def test_an_omni_layout_needs_its_geometry(load: Write, key: str) -> None:
    whole = OMNI + "angles = [0.0, 2.0, 4.0]\n"
    assert load(whole).layout.wheel_count == 3
    with pytest.raises(VehicleError, match=f"wheels.{key} is missing"):
        load(without(whole, f"wheels.{key}"))


def test_all_that_is_missing_is_named_at_once(load: Write) -> None:
    motor = ("drive.gear_ratio", "drive.torque_constant", "drive.resistance")
    with pytest.raises(VehicleError) as caught:
        load(without(SMALLEST, *motor))
    assert caught.value.problem == f"{motor[0]}, {motor[1]} and {motor[2]} are missing"
    assert "N·m/A" in caught.value.accepted
    assert "Ω" in caught.value.accepted
    with pytest.raises(VehicleError) as caught:
        load("")
    geometry = ("wheels.half_wheelbase", "wheels.half_track")
    for key in set(REQUIRED) - set(geometry):
        assert key in caught.value.problem
    # Which geometry is needed depends on the layout.
    assert "half_wheelbase and half_track" in caught.value.accepted
    assert "base_radius and angles" in caught.value.accepted


@pytest.mark.parametrize("key", REQUIRED)
@pytest.mark.parametrize(
    "value",
    [
        *("0", "-1.5", "nan", "inf", "-inf", "true", '"1.5"', "[1.5]", "{ unit = 'm' }"),
        *("1" * 400, "1" * 5000, "0x" + "f" * 5000, "1e400", "1979-05-27"),
    ],
)
def test_no_nonsense_for_a_required_number(load: Write, key: str, value: str) -> None:
    table, name = key.split(".")
    text = without(SMALLEST, key).replace(f"[{table}]\n", f"[{table}]\n{name} = {value}\n")
    with pytest.raises(VehicleError) as caught:
        load(text)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert len(sentence) < 1000
    assert "robot.toml" in sentence


def test_a_changed_file_is_read_anew(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(SMALLEST)
    assert load_vehicle(str(path)).mass == 10.0
    path.write_text(SMALLEST.replace("mass = 10.0", "mass = 11.0"))
    os.utime(path, ns=(1, 1))
    assert load_vehicle(str(path)).mass == 11.0


def test_values_for_wheels_and_surfaces(load: Write) -> None:
    vehicle = load(
        SMALLEST
        + """
[effects]
active = ["wheel_imbalance", "surface_rolling"]
[effects.wheel_imbalance]
excess = [0.3, -0.1, -0.1, -0.1]
[effects.surface_rolling]
excess = { hard = 0.0, carpet = 1.3 }
"""
    )
    model = PowerModel.from_vehicle(vehicle)
    assert model.surfaces == ("hard", "carpet")
    carpet, hard, neither = model.watts(rows_from(vx=0.4, surface=[1.0, 0.0, -1.0]))
    assert carpet > hard
    assert hard == neither
    # Driving forward, the drag of one wheel above the others changes its share, not their sum.
    _, wheels = model.evaluate(rows_from(vx=0.4))
    torque = wheels[:, PerWheel.WHEEL_TORQUE]
    assert torque[0] > torque[1]
    assert torque[1] == pytest.approx(torque[2], rel=1e-9)
    mean = torque.mean()
    assert (torque[0] - mean) / (torque[1] - mean) == pytest.approx(-3.0, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SMALLEST.replace("mass = 10.0", "mas = 10.0"), ["[body] mas", "unknown key", "'mass'?"]),
        (SMALLEST + "[motor]\nkt = 1\n", ["motor", "unknown key", "drive"]),
        (SMALLEST.replace("mass = 10.0", ""), ["body.mass is missing", "0.001 to 100000 kg"]),
        (SMALLEST.replace("10.0", "-3.0"), ["body.mass", "out of range", "-3.0", "kg"]),
        (SMALLEST.replace("10.0", "nan"), ["body.mass", "out of range", "nan", "kg"]),
        (SMALLEST.replace("10.0", "true"), ["body.mass", "not a number", "True", "kg"]),
        (SMALLEST.replace("10.0", '"heavy"'), ["body.mass", "not a number", "heavy", "kg"]),
        (
            SMALLEST.replace("10.0", '{ value = 10.0, unit = "mm" }'),
            ["body.mass", "not a unit", "'mm'", "accepted: kg", "g or lb"],
        ),
        (
            SMALLEST.replace("10.0", "{ value = 10.0, origin = 1 }"),
            ["origin", "unknown key", "source"],
        ),
        (SMALLEST.replace("10.0", '{ unit = "kg" }'), ["body.mass", "not a number"]),
        ("body = 3\n", ["[body]", "not a table"]),
        (
            SMALLEST.replace("[wheels]", "[wheels]\nbase_radius = 0.2"),
            ["[wheels] base_radius", "omni", "half_wheelbase, half_track"],
        ),
        ('name = "a\\u0000b"' + SMALLEST, ["name", "cannot be printed"]),
        ("name = 0x" + "f" * 5000 + SMALLEST, ["name", "not text", "too many digits"]),
        ("name = 3\n" + SMALLEST, ["name", "not text", "3"]),
        (
            SMALLEST.replace("10.0", "{ value = 10.0, source = 1 }"),
            ["body.mass source", "not text"],
        ),
        ("mass = [", ["not TOML"]),
        (
            SMALLEST.replace("mecanum", "tank"),
            ["layout", "tank", "mecanum, omni"],
        ),
        (OMNI, ["wheels.angles is missing", "three or more angles in rad"]),
        (OMNI + "angles = [0.0, 2.0]\n", ["angles", "three or more"]),
        (OMNI + "angles = [0.0, 2.0, 'x']\n", ["wheels.angles", "not a number"]),
        (
            OMNI + 'angles = { value = [60.0, 180.0, 300.0], unit = "kg" }\n',
            ["wheels.angles", "unit", "kg", "accepted: rad", "deg"],
        ),
        (OMNI + "angles = [60.0, 180.0, 300.0]\n", ["wheels.angles", "out of range"]),
        (OMNI + "angles = [0.0, 0.0, 0.0]\n", ["[wheels]", "in every direction"]),
        (
            SMALLEST.replace("radius", "roller_angle = 1.5707963\nradius"),
            ["[wheels]", "in every direction"],
        ),
        (SMALLEST + '[effects]\nactive = ["ether"]\n', ["active", "ether", "air_drag"]),
        (SMALLEST + '[effects]\nactive = "air_drag"\n', ["active", "not a list of effects"]),
        (SMALLEST + '[effects]\nactive = [["air_drag"]]\n', ["active", "not a list of effects"]),
        (SMALLEST + "[effects.ether]\na = 1\n", ["ether", "unknown key"]),
        (
            SMALLEST + "[effects.air_drag]\ndrag_are = 1\n",
            ["[effects.air_drag] drag_are", "'drag_area'?"],
        ),
        (
            SMALLEST + "[effects.air_drag]\ndrag_area = -1.0\n",
            ["effects.air_drag.drag_area", "out of range", "m²"],
        ),
        (
            SMALLEST + "[effects.wheel_imbalance]\nexcess = [0.1, 0.2]\n",
            ["effects.wheel_imbalance.excess", "not one value a wheel", "4 numbers"],
        ),
        (
            SMALLEST + "[effects.surface_rolling]\nexcess = { carpet = -2.0 }\n",
            ["effects.surface_rolling.excess.carpet", "out of range"],
        ),
        (SMALLEST + "gear_efficiency = 0.4\n", ["drive.gear_efficiency", "0.5 to 1"]),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(load: Write, text: str, words: list[str]) -> None:
    with pytest.raises(VehicleError) as caught:
        load(text)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert "robot.toml" in sentence
    assert "accepted:" in sentence
    for word in words:
        assert word in sentence


def test_no_such_vehicle() -> None:
    with pytest.raises(VehicleError, match=r"no such vehicle.*'tank'.*minibalance, robotino"):
        load_vehicle("tank")
    for path in ("nowhere/tank.toml", "t" * 300 + ".toml"):
        with pytest.raises(VehicleError, match="no such vehicle"):
            load_vehicle(path)
