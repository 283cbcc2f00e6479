"""What `vehicles check` finds in files that are possible, but wrong."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from planner.power.sanity import VehicleReport, check_vehicle
from planner.power.vehicles.vehicle_fields import commented_toml, template
from planner.power.vehicles.vehicle_file import load_vehicle


def checked(folder: Path, **changes: str) -> VehicleReport:
    """The report of the template, with some of its lines replaced."""
    text = template()
    for key, value in changes.items():
        lines = [
            line for line in text.splitlines() if line.removeprefix("# ").startswith(f"{key} =")
        ]
        assert lines, key
        text = text.replace(lines[0], f"{key} = {value}")
    path = folder / "robot.toml"
    path.write_text(text, "utf-8")
    return check_vehicle(load_vehicle(str(path)))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        # 2 mN·m/A in place of 30: fifteen times the current, two hundred times the heat.
        ("torque_constant", "0.002", ["W heat the windings", "on level ground"]),
        ("torque_constant", "0.5", ["1/min without load"]),
        ("resistance", "95.0", ["A at a standstill"]),
        ("resistance", "0.02", ["A at a standstill"]),
        ("speed", "9.0", ["limits.speed: 9 m/s"]),
        ("yaw_rate", "90.0", ["limits.yaw_rate: 90 rad/s", "degrees"]),
        ("rotor_inertia", "135e-6", ["the rotors act like"]),
        ("yaw_inertia", "30.0", ["a plate of this mass and size"]),
        ("half_track", "0.45", ["body.width: ", "the wheels end 0.45 m"]),
        # The whole wheelbase in the place of a half, and grams in the place of kilograms.
        ("half_wheelbase", "0.56", ["body.length: ", "the wheels end 0.61 m"]),
        # The wheels' middles are within the body, their rims are not.
        ("half_wheelbase", "0.28", ["body.length: 0.6 m", "the wheels end 0.33 m"]),
        ("gear_ratio", "0.05", ["drive.gear_ratio: 0.05", "is it 20?"]),
        # Strong enough for the level, and too weak for a slope that no limit keeps it from.
        ("gear_ratio", "4.0", ["limits.continuous_torque: not given", "heat the windings 5° up"]),
        ("mass", "12000.0", ["body.mass: 12000 kg", "kg/m²"]),
        ("radius", "0.5", ["wheels.radius: 0.5 m"]),
        ("com_height", "1.2", ["body.com_height"]),
        ("voltage", "30.0", ["limits.voltage: 30 V"]),
        ("capacity", "5.0", ["a full battery lasts", "without a unit is in J"]),
        ("continuous_torque", "0.008", ["5° up cannot be driven"]),
    ],
)
def test_what_is_odd_is_said(tmp_path: Path, key: str, value: str, words: list[str]) -> None:
    found = checked(tmp_path, **{key: value}).odd
    assert any(all(word in sentence for word in words) for sentence in found), found


def test_nothing_creeps_up_a_slope_by_friction_that_has_only_begun(tmp_path: Path) -> None:
    for torque in range(20, 60):
        report = checked(tmp_path, continuous_torque=f"{torque / 2500.0}")
        up = report.motions[1]
        climbs = up.reachable_m_s > 0.01 and up.torque_share <= 1.0
        assert climbs != any("5° up cannot be driven" in one for one in report.odd)


def test_a_centre_of_mass_beside_the_wheels_is_odd(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    lines = [line for line in template().splitlines() if not line.startswith(("half_", "layout"))]
    wheels = 'layout = "omni"\nbase_radius = 0.2\nangles = [0.0, 0.5, 1.0]'
    path.write_text("\n".join(lines).replace("[wheels]", f"[wheels]\n{wheels}"), "utf-8")
    found = check_vehicle(load_vehicle(str(path))).odd
    assert any("carries nothing on level ground" in sentence for sentence in found), found


def test_the_template_is_a_robot_with_nothing_odd(tmp_path: Path) -> None:
    report = checked(tmp_path)
    assert report.odd == ()
    assert "body.mass" in report.without_source
    flat, up, _, _ = report.motions
    # Climbing at constant speed needs at least the power of the weight.
    climb = 12.0 * 9.80665 * math.sin(math.radians(5.0)) * up.speed_m_s
    assert up.power_w - flat.power_w > climb
    assert flat.torque_share is None


def test_an_assumed_source_is_named(tmp_path: Path) -> None:
    report = checked(tmp_path, mass='{ value = 12, source = "assumed: like mine" }')
    assert report.assumed == ("body.mass: assumed: like mine",)


@pytest.mark.parametrize("name", ["minibalance", "robotino"])
def test_a_commented_file_is_the_same_vehicle(tmp_path: Path, name: str) -> None:
    path = tmp_path / f"{name}.toml"
    path.write_text(commented_toml(name), "utf-8")
    assert load_vehicle(str(path)).document() == load_vehicle(name).document()
    assert commented_toml(str(path)) == commented_toml(name)


def test_the_page_of_fields_is_up_to_date() -> None:
    from docs.make_vehicle_file import PAGE, vehicle_file_page

    assert PAGE.read_text("utf-8") == vehicle_file_page(), "run python -m docs.make_vehicle_file"
