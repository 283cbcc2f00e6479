"""A recommended experiment is driven as it says."""

import math

import numpy as np
import pytest

from planner.telemetry.virtual import QUIET, VirtualRobot
from tests.hidden_effects.cases import cases
from tests.hidden_effects.second_drive import RAMP, recommended_drive, tie_broken

CLIMB = {"vx": 0.3, "vy": 0.0, "wz": 0.0, "pitch": -0.08, "roll": 0.0, "acceleration": 0.0}
HARD = {"vx": 0.0, "vy": 0.4, "wz": 0.0, "pitch": 0.0, "roll": 0.0, "acceleration": 0.5}


def settings(*segments, payload=0.0, motor_temp=None, seconds=10.0):
    run = {"payload": payload, "motor_temp": motor_temp}
    return {"runs": [{**run, "segments": [{**s, "seconds": seconds} for s in segments]}]}


@pytest.fixture(scope="module")
def robot():
    return VirtualRobot("minibalance")


def test_segments_are_held_one_after_the_other(robot):
    drive = recommended_drive(settings(CLIMB, HARD | {"acceleration": 0.0}), robot.vehicle)
    log = robot.drive(drive, noise=QUIET).columns
    climbing = (log["time"] > RAMP + 1.0) & (log["time"] < 10.0)
    aside = (log["time"] > 10.0 + 2.0 * RAMP + 1.5) & (log["time"] < 21.0)
    assert log["vx"][climbing] == pytest.approx(0.3, abs=0.01)
    assert log["pitch"][climbing] == pytest.approx(-0.08, abs=1e-6)
    assert log["vy"][aside] == pytest.approx(0.4, abs=0.01)
    assert log["pitch"][aside] == pytest.approx(0.0, abs=1e-6)


def test_an_acceleration_is_driven_up_and_down(robot):
    drive = recommended_drive(settings(HARD, seconds=20.0), robot.vehicle)
    log = robot.drive(drive, noise=QUIET).columns
    here = (log["time"] > 3.0) & (log["time"] < 20.0)
    assert np.median(np.abs(log["ay"][here])) == pytest.approx(0.5, rel=0.1)
    assert np.min(log["vy"][here]) >= -0.05
    assert np.max(log["vy"][here]) == pytest.approx(0.8, abs=0.1)


def test_load_and_heat_are_those_asked_for(robot):
    drive = recommended_drive(settings(CLIMB, payload=4.8, motor_temp=60.0), robot.vehicle)
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
