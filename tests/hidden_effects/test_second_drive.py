"""A recommended experiment is driven as it says."""

import math

import numpy as np
import pytest

from planner.telemetry.diagnosis.advice.drives import Drive, settings_of, there_and_back
from planner.telemetry.virtual import QUIET, VirtualRobot
from tests.hidden_effects.cases import cases
from tests.hidden_effects.second_drive import recommended_drive, tie_broken


@pytest.fixture(scope="module")
def robot():
    return VirtualRobot("minibalance")


def settings(robot, *, vx=0.0, vy=0.0, payload=0.0, motor_temp=None, **more):
    legs = there_and_back(robot.vehicle, vx, vy, 0.0)
    drive = Drive("there and back", legs, **more)
    return settings_of(drive, robot.vehicle, [{"payload": payload, "motor_temp": motor_temp}], 2)


def test_legs_are_driven_there_and_back_on_the_ramp(robot):
    asked = settings(robot, vx=0.3, slope=0.08)
    log = robot.drive(recommended_drive(asked), noise=QUIET).columns
    there = asked["legs"][0]
    steady = (log["time"] > there["ramp"] + 0.5) & (log["time"] < there["ramp"] + there["hold"])
    assert log["vx"][steady] == pytest.approx(0.3, abs=0.01)
    assert log["pitch"] == pytest.approx(-0.08, abs=1e-6)  # nose up
    assert np.sum(log["vx"]) * 0.5 == pytest.approx(0.0, abs=0.02)  # back at the start
    # Up costs what comes back downhill, less the losses.
    weight = robot.vehicle.mass * 9.80665 * math.sin(0.08) * 0.3
    up = np.median(log["power"][log["vx"] > 0.29])
    down = np.median(log["power"][log["vx"] < -0.29])
    assert up - down > 1.5 * weight


def test_a_ramp_to_the_left_rolls_the_robot(robot):
    drive = recommended_drive(settings(robot, vy=0.3, slope=0.08, uphill=0.5 * math.pi))
    log = robot.drive(drive, noise=QUIET).columns
    assert log["roll"] == pytest.approx(0.08, abs=1e-6)
    assert log["pitch"] == pytest.approx(0.0, abs=1e-6)


def test_load_and_heat_are_those_asked_for(robot):
    drive = recommended_drive(settings(robot, vx=0.3, payload=4.8, motor_temp=60.0))
    log = robot.drive(drive, noise=QUIET).columns
    assert set(log["payload"]) == {4.8}
    assert log["motor_temp"] == pytest.approx(60.0)
    assert math.isfinite(log["power"].sum())


def test_advice_to_log_something_is_no_drive():
    case = next(c for c in cases(["one"], 1) if c.group == "com_offset")
    advice = {"separates": ["wheel_imbalance", "com_offset"], "run": "Log com_x.", "settings": {}}

    def asked_again(*given, **more):
        raise AssertionError("nothing was driven")

    assert tie_broken(case, None, {"experiments": [advice]}, asked_again) is None
