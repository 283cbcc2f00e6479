"""Values as data sheets state them: units, motors by name, derived values, uncertainties."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from planner.errors import VehicleError
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles.derived import DUTY
from planner.power.vehicles.motors import read_motors
from planner.power.vehicles.vehicle import Vehicle
from planner.power.vehicles.vehicle_file import load_vehicle, wheel_values
from planner.telemetry.virtual.chassis import read_vehicle

IN_SI = """
[body]
mass = 12.5
length = 0.6
width = 0.5
[wheels]
layout = "omni"
base_radius = 0.2
angles = [0.0, 2.0943951, 4.1887902]
radius = 0.05
[drive]
gear_ratio = 20.0
torque_constant = 0.0335
resistance = 0.978
rotor_inertia = 1.35e-5
[limits]
speed = 1.5
[battery]
voltage = 24.0
capacity = 432000.0
"""
SPELLED = {
    "body.mass": (
        "12.5",
        ('12500, unit = "g"', '12.5, unit = "kilogram"', '12500000, unit = "mg"'),
    ),
    "body.length": ("0.6", ('600, unit = "mm"', '60, unit = "cm"', '600, unit = "millimeter"')),
    "wheels.radius": ("0.05", ('50, unit = "mm"', '5.0, unit = "cm"', '1.968503937, unit = "in"')),
    "wheels.angles": (
        "[0.0, 2.0943951, 4.1887902]",
        tuple(f'[0, 120, 240], unit = "{unit}"' for unit in ("deg", "°", "degree")),
    ),
    "drive.torque_constant": (
        "0.0335",
        ('33.5, unit = "mN·m/A"', '33.5, unit = "mNm/A"', '33.5, unit = "mV·s/rad"'),
    ),
    "drive.resistance": (
        "0.978",
        ('978, unit = "mΩ"', '0.978, unit = "ohm"', '0.978, unit = "Ohm"'),
    ),
    "drive.rotor_inertia": (
        "1.35e-5",
        ('135, unit = "g·cm²"', '135, unit = "gcm2"', '135, unit = "g cm^2"'),
    ),
    "limits.speed": ("1.5", ('5.4, unit = "km/h"', '1500, unit = "mm/s"', '150, unit = "cm/s"')),
    "battery.capacity": (
        "432000.0",
        ('5, unit = "Ah"', '5000, unit = "mAh"', '0.12, unit = "kWh"'),
    ),
}


def load(folder: Path, text: str) -> Vehicle:
    """A vehicle from the text of its file."""
    path = folder / "robot.toml"
    path.write_text(text, encoding="utf-8")
    return load_vehicle(str(path))


def numbers(vehicle: Vehicle) -> list[float]:
    """All numbers of a vehicle's document."""
    document = vehicle.document()
    for words in ("sources", "derived", "defaults_taken", "name"):
        document.pop(words)
    found: list[float] = []

    def collect(value: object) -> None:
        if isinstance(value, dict):
            for one in value.values():
                collect(one)
        elif isinstance(value, list):
            for one in value:
                collect(one)
        elif isinstance(value, int | float):
            found.append(float(value))

    collect(document)
    return found


@pytest.mark.parametrize("key", SPELLED)
def test_a_unit_spelled_three_ways_is_one_value(tmp_path: Path, key: str) -> None:
    name, (own, spellings) = key.partition(".")[2], SPELLED[key]
    expected = numbers(load(tmp_path, IN_SI))
    for spelling in spellings:
        line = f"{name} = {own}\n"
        assert line in IN_SI
        text = IN_SI.replace(line, f"{name} = {{ value = {spelling} }}\n")
        assert numbers(load(tmp_path, text)) == pytest.approx(expected, rel=1e-7, abs=1e-7), (
            spelling
        )


def test_a_speed_constant_is_one_over_the_torque_constant(tmp_path: Path) -> None:
    # 285 rpm/V: 60/(2π·285) V·s/rad.
    for unit in ("rpm/V", "1/min/V", "min⁻¹/V"):
        given = f'torque_constant = {{ value = 285, unit = "{unit}" }}'
        vehicle = load(tmp_path, IN_SI.replace("torque_constant = 0.0335", given))
        constant = vehicle.parameters["copper_loss"]["torque_constant"]
        assert constant == pytest.approx(60.0 / (2.0 * math.pi * 285.0))


def test_the_virtual_robot_reads_the_same_geometry(tmp_path: Path) -> None:
    text = IN_SI.replace("base_radius = 0.2", 'base_radius = { value = 20, unit = "cm" }')
    load(tmp_path, text)
    path = str(tmp_path / "robot.toml")
    assert wheel_values(path)["base_radius"] == pytest.approx(0.2)
    vehicle, chassis = read_vehicle(path)
    reach = [*map(math.hypot, chassis.wheels.x, chassis.wheels.y)]
    assert reach == pytest.approx([0.2] * vehicle.layout.wheel_count)


def test_what_is_derived_is_said_with_its_formula(tmp_path: Path) -> None:
    text = IN_SI.replace("[drive]", "mass = 0.3\n[drive]\nno_load_current = 0.185")
    vehicle = load(tmp_path, text)
    values = vehicle.parameters
    assert values["inertia"]["yaw_inertia"] == pytest.approx(12.5 / 12 * (0.6**2 + 0.5**2))
    assert values["inertia"]["wheel_inertia"] == pytest.approx(0.5 * 0.3 * 0.05**2)
    assert values["coulomb_drag"]["coulomb_torque"] == pytest.approx(0.0335 * 0.185)
    assert vehicle.limits.voltage == pytest.approx(DUTY * 24.0)
    assert vehicle.provenance.derived["body.yaw_inertia"] == "mass/12·(length² + width²)"
    words = PowerModel.from_vehicle(vehicle).defaults_in_words()
    assert "limits.voltage = 22.8 V (0.95·battery.voltage)" in words
    assert not set(vehicle.provenance.derived) & set(vehicle.provenance.defaults_taken)


@pytest.mark.parametrize("scale", [1.0, 0.05, 20.0])
def test_rotors_of_an_unstated_inertia_fit_motor_and_robot(tmp_path: Path, scale: float) -> None:
    text = IN_SI.replace("rotor_inertia = 1.35e-5\n", "")
    text = text.replace("resistance = 0.978", f"resistance = {0.978 / scale}")
    vehicle = load(tmp_path, text)
    assert "drive.rotor_inertia" in vehicle.provenance.derived
    rotor = vehicle.parameters["inertia"]["rotor_inertia"]
    time = rotor * 0.978 / scale / 0.0335**2
    acts_like = 3 * rotor * (20.0 / 0.05) ** 2
    # Data sheets of motors have 5 to 20 ms; a strong one is geared so that the robot is quick.
    assert acts_like <= 12.5 * (1.0 + 1e-9)
    assert 0.005 < time < 0.02 or acts_like == pytest.approx(12.5)


def friction(vehicle: Vehicle) -> float:
    """N·m at the shaft of one motor."""
    return vehicle.parameters["coulomb_drag"]["coulomb_torque"]


@pytest.mark.parametrize("name", read_motors())
def test_friction_of_an_unstated_motor_is_that_of_its_size(tmp_path: Path, name: str) -> None:
    sheet = read_motors()[name].values
    known = {"drive.no_load_current", "drive.coulomb_torque"} & sheet.keys()
    motor = IN_SI.replace("torque_constant = 0.0335\nresistance = 0.978\n", f'motor = "{name}"\n')
    vehicle = load(tmp_path, motor)
    kt, ohm = (vehicle.parameters["copper_loss"][key] for key in ("torque_constant", "resistance"))
    bare = IN_SI.replace("0.0335", f"{kt}").replace("0.978", f"{ohm}")
    unstated = load(tmp_path, bare)
    assert "drive.coulomb_torque" in unstated.provenance.derived
    # Without load a motor takes a small part of its current at a standstill.
    volts = read_motors()[name].voltage
    assert 0.005 < friction(unstated) / kt / (volts / ohm) < 0.1
    if known:
        assert 0.5 < friction(unstated) / friction(vehicle) < 2.0


def test_friction_of_a_toy_and_of_a_truck(tmp_path: Path) -> None:
    """A gear motor of 12 mm with 0.1 A of 1.6 A at 6 V, and a motor of 32 kW."""
    for kt, ohm, volts in ((0.0019, 3.75, 6.0), (0.2, 0.05, 80.0)):
        text = IN_SI.replace("0.0335", f"{kt}").replace("0.978", f"{ohm}")
        vehicle = load(tmp_path, text.replace("voltage = 24.0", f"voltage = {volts}"))
        assert 0.0005 < friction(vehicle) / kt / (volts / ohm) < 0.1


@pytest.mark.parametrize("layout", ['"differential"', "3", "[1]"])
def test_an_unknown_layout_is_said_before_its_keys(tmp_path: Path, layout: str) -> None:
    """Who writes half_track in the place of track has no differential robot then either."""
    text = IN_SI.replace('"omni"\nbase_radius = 0.2', f"{layout}\ntrack = 0.4")
    with pytest.raises(VehicleError, match=r"unknown wheel layout.*mecanum, omni; .*sideways"):
        load(tmp_path, text)


def test_a_given_value_is_not_derived(tmp_path: Path) -> None:
    text = IN_SI.replace("speed = 1.5", "speed = 1.5\nvoltage = 20.0")
    vehicle = load(tmp_path, text.replace("width = 0.5", "width = 0.5\nyaw_inertia = 0.9"))
    assert vehicle.limits.voltage == 20.0
    assert vehicle.parameters["inertia"]["yaw_inertia"] == 0.9
    assert not {"limits.voltage", "body.yaw_inertia"} & set(vehicle.provenance.derived)


@pytest.mark.parametrize("name", read_motors())
def test_every_motor_gives_a_vehicle_and_its_sources(tmp_path: Path, name: str) -> None:
    motor = IN_SI.replace("torque_constant = 0.0335\nresistance = 0.978\n", f'motor = "{name}"\n')
    vehicle = load(tmp_path, motor.replace("rotor_inertia = 1.35e-5\n", ""))
    assert vehicle.provenance.motor == name
    for key in ("drive.torque_constant", "drive.resistance"):
        assert vehicle.provenance.sources[key].startswith(f"motor {name}: ")
        assert len(vehicle.provenance.sources[key]) > len(f"motor {name}: ") + 4
    # A motor turns at no more than V/k_t: below 30,000 rpm for those that robots have.
    constant = vehicle.parameters["copper_loss"]["torque_constant"]
    assert 100.0 < 24.0 / constant < 3500.0


def test_a_motor_runs_at_its_own_voltage_where_the_file_states_none(tmp_path: Path) -> None:
    motor = 'motor = "pololu-37d-12v"'
    text = IN_SI.replace("torque_constant = 0.0335\nresistance = 0.978", motor)
    vehicle = load(tmp_path, text.replace("voltage = 24.0\n", ""))
    assert (vehicle.battery.voltage, vehicle.limits.voltage) == (12.0, DUTY * 12.0)
    said = PowerModel.from_vehicle(vehicle).defaults_in_words()
    assert "battery.voltage = 12 V (nominal voltage of motor pololu-37d-12v)" in said
    assert load(tmp_path, text).battery.voltage == 24.0
    # A charge becomes energy only with the voltage of the pack itself.
    charge = text.replace("voltage = 24.0\ncapacity = 432000.0", 'capacity = {value=5, unit="Ah"}')
    with pytest.raises(VehicleError, match=r"battery\.voltage"):
        load(tmp_path, charge)


def test_a_value_beside_the_motor_takes_precedence(tmp_path: Path) -> None:
    text = IN_SI.replace("resistance = 0.978", 'motor = "pololu-37d-12v"')
    assert load(tmp_path, text).parameters["copper_loss"]["torque_constant"] == 0.0335
    assert load(tmp_path, text).parameters["copper_loss"]["resistance"] == 2.18


def test_uncertainty_is_carried_with_the_vehicle(tmp_path: Path) -> None:
    given = "resistance = { value = 978, unit = 'mΩ', uncertainty = 0.07 }"
    text = IN_SI.replace("resistance = 0.978", given) + (
        "[effects.air_drag]\ndrag_area = { value = 0.2, uncertainty = 0.5 }\n"
    )
    vehicle = load(tmp_path, text)
    assert vehicle.uncertainty_of("copper_loss", "resistance") == 0.07
    assert vehicle.uncertainty_of("air_drag", "drag_area") == 0.5
    assert vehicle.uncertainty_of("copper_loss", "torque_constant") is None
    back = Vehicle.from_document(json.loads(json.dumps(vehicle.document())))
    assert back.provenance.uncertainties == vehicle.provenance.uncertainties
    assert (back.provenance.derived, back.provenance.motor) == (
        vehicle.provenance.derived,
        vehicle.provenance.motor,
    )
    older = vehicle.document()
    for key in ("uncertainties", "derived", "motor"):
        older.pop(key)
    assert Vehicle.from_document(older).provenance.uncertainties == {}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass = 12.5", 'mass = { value = 12.5, unit = "m" }', ["body.mass", "'m'", "kg"]),
        ("mass = 12.5", "mass = { value = 12.5, unit = 3 }", ["body.mass", "3", "kg"]),
        ("mass = 12.5", 'mass = { value = 5, unit = "mg" }', ["body.mass", "5 mg", "0.001"]),
        ("0.0335", '{ value = 0, unit = "rpm/V" }', ["drive.torque_constant", "0 rpm/V"]),
        ("0.978", "{ value = 1, uncertainty = 7 }", ["drive.resistance uncertainty", "7", "share"]),
        ("0.978", "{ value = 1, uncertainty = 0 }", ["drive.resistance uncertainty", "0", "share"]),
        (
            "resistance = 0.978",
            'motor = "pittmann"',
            ["drive.motor", "pittmann", "pittman-9233s013"],
        ),
        ("resistance = 0.978", "motor = 3", ["drive.motor", "3", "pololu-37d-12v"]),
        ("resistance = 0.978", "", ["drive.resistance is missing", "drive.motor", "pololu"]),
        ("voltage = 24.0", "", ["battery.capacity", "'Ah'", "battery.voltage"]),
        ("432000.0", '{ value = 5, unit = "A" }', ["battery.capacity", "'A'", "Wh", "Ah"]),
    ],
)
def test_one_sentence_for_what_is_wrong(
    tmp_path: Path, old: str, new: str, words: list[str]
) -> None:
    text = IN_SI.replace(old, new)
    if old.startswith("voltage"):
        text = text.replace("432000.0", '{ value = 5, unit = "Ah" }')
    with pytest.raises(VehicleError) as caught:
        load(tmp_path, text)
    sentence = str(caught.value)
    assert "\n" not in sentence
    for word in ("robot.toml", "accepted:", *words):
        assert word in sentence


def test_the_battery_of_the_file_is_the_one_that_sags(tmp_path: Path) -> None:
    """Half of the voltage is four times the loss; it was that of a 24 V pack for all."""
    resistance = "voltage = 24.0\nresistance = 0.2"
    text = IN_SI.replace("voltage = 24.0", resistance) + '[effects]\nactive = ["battery_sag"]\n'
    rows = rows_from(vx=np.array([1.0]))

    def lost(text: str) -> float:
        model = PowerModel.from_vehicle(load(tmp_path, text))
        plain = PowerModel.from_vehicle(load(tmp_path, text.replace('["battery_sag"]', "[]")))
        return float((model.watts(rows) - plain.watts(rows))[0])

    watts = float(PowerModel.from_vehicle(load(tmp_path, IN_SI)).watts(rows)[0])
    assert lost(text) == pytest.approx(0.2 * (watts / 24.0) ** 2, rel=0.03)
    assert lost(text.replace("24.0", "96.0")) == pytest.approx(0.2 * (watts / 96.0) ** 2, rel=0.03)
    said = PowerModel.from_vehicle(load(tmp_path, text)).defaults_in_words()
    assert "effects.battery_sag.internal_resistance = 0.2 Ω (battery.resistance)" in said
    # What the effect's own table says comes first.
    own = text + "[effects.battery_sag]\ninternal_resistance = 0.0\n"
    assert lost(own) == 0.0
