"""Vehicle files: what they hold, and one clear sentence for everything that is wrong with one."""

from __future__ import annotations

import csv
import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from planner.errors import VehicleError
from planner.power.catalogue import all_effects
from planner.power.model import PowerModel, rows_from
from planner.power.vehicle import VEHICLE_FOLDER, Vehicle, list_vehicles, load_vehicle

NAMES = ("minibalance", "robotino")
each_vehicle = pytest.mark.parametrize("name", NAMES)
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"

SMALLEST = """
[body]
mass = 10.0
length = 0.6
width = 0.5
[wheels]
half_wheelbase = 0.2
half_track = 0.2
radius = 0.05
"""
OMNI = """
[body]
mass = 10.0
length = 0.4
width = 0.4
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
            assert set(value) == {"value", "unit", "source"}, key
            assert len(value["source"]) > 4, key
    assert load_vehicle(name).sources


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


def test_smallest_file_says_what_it_leaves_to_defaults(load: Write) -> None:
    vehicle = load(SMALLEST)
    assert vehicle.mass == 10.0
    for key in ("drive.gear_ratio", "contact.rolling", "limits.speed", "electronics.power"):
        assert key in vehicle.defaults_taken
    assert PowerModel.from_vehicle(vehicle).watts(rows_from(vx=0.3))[0] > 0.0


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
    torque = wheels[:, 4]
    assert torque[0] > torque[1]
    assert torque[1] == pytest.approx(torque[2], rel=1e-9)
    mean = torque.mean()
    assert (torque[0] - mean) / (torque[1] - mean) == pytest.approx(-3.0, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SMALLEST.replace("mass = 10.0", "mas = 10.0"), ["[body] mas", "unknown key", "'mass'?"]),
        (SMALLEST + "[motor]\nkt = 1\n", ["motor", "unknown key", "drive"]),
        (SMALLEST.replace("mass = 10.0", ""), ["[body] mass", "missing", "a number in kg"]),
        (SMALLEST.replace("10.0", "-3.0"), ["body.mass", "out of range", "-3.0", "kg"]),
        (SMALLEST.replace("10.0", "nan"), ["body.mass", "out of range", "nan", "kg"]),
        (SMALLEST.replace("10.0", "true"), ["body.mass", "not a number", "True", "kg"]),
        (SMALLEST.replace("10.0", '"heavy"'), ["body.mass", "not a number", "heavy", "kg"]),
        (
            SMALLEST.replace("10.0", '{ value = 10000.0, unit = "g" }'),
            ["body.mass", "unit", "'g'", "accepted: kg"],
        ),
        (
            SMALLEST.replace("10.0", "{ value = 10.0, origin = 1 }"),
            ["origin", "unknown key", "source"],
        ),
        (SMALLEST.replace("10.0", '{ unit = "kg" }'), ["body.mass", "not a number"]),
        ("body = 3\n", ["[body]", "not a table"]),
        ("mass = [", ["not TOML"]),
        (
            SMALLEST.replace("radius", 'layout = "tank"\nradius'),
            ["layout", "tank", "mecanum, omni"],
        ),
        (OMNI, ["[wheels] angles", "three or more angles in rad"]),
        (OMNI + "angles = [0.0, 2.0]\n", ["angles", "three or more"]),
        (OMNI + "angles = [0.0, 2.0, 'x']\n", ["wheels.angles", "not a number"]),
        (
            OMNI + 'angles = { value = [60.0, 180.0, 300.0], unit = "deg" }\n',
            ["wheels.angles", "unit", "deg", "accepted: rad"],
        ),
        (OMNI + "angles = [60.0, 180.0, 300.0]\n", ["wheels.angles", "out of range"]),
        (OMNI + "angles = [0.0, 0.0, 0.0]\n", ["[wheels]", "in every direction"]),
        (
            SMALLEST.replace("radius", "roller_angle = 1.5707963\nradius"),
            ["[wheels]", "in every direction"],
        ),
        (SMALLEST + '[effects]\nactive = ["ether"]\n', ["active", "ether", "air_drag"]),
        (SMALLEST + '[effects]\nactive = "air_drag"\n', ["active", "not a list of effects"]),
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
        (SMALLEST + "[drive]\ngear_efficiency = 0.4\n", ["drive.gear_efficiency", "0.5 to 1"]),
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
    with pytest.raises(VehicleError, match="no such vehicle"):
        load_vehicle("nowhere/tank.toml")
