"""Logs of the benchmark: what is hidden can be seen where it is said to be, and nowhere else."""

import json

import numpy as np
import pytest

from planner.telemetry.logs import Telemetry
from tests.hidden_effects.cases import cases
from tests.hidden_effects.logs import make


def case_of(name):
    """A case of the whole table."""
    return next(case for case in cases() if case.name == name)


@pytest.fixture(scope="module")
def drag(tmp_path_factory):
    return make(case_of("one/air_drag/0"), tmp_path_factory.mktemp("logs"))


def test_an_effect_that_differs_from_the_base_model_is_visible(drag):
    # Air drag on a windy drive resembles nothing in the base model.
    assert drag.truth["rho"]["air_drag"] > 1.0
    assert drag.truth["apart"] > 20.0


def test_an_effect_that_the_base_model_absorbs_is_not(tmp_path):
    # A ripple of the current adds to R·I² in proportion: the winding's resistance takes it up.
    made = make(case_of("one/current_ripple/0"), tmp_path)
    assert made.truth["strengths"]["current_ripple"]["ripple_squared"] > 0.0
    assert made.truth["rho"]["current_ripple"] < 1e-6


def test_the_log_says_nothing_about_what_is_hidden(drag):
    assert "drag" not in drag.log.name
    log = Telemetry.read(drag.log)
    assert log.present <= {
        *("vx", "vy", "wz", "power", "roll", "pitch", "ax", "ay", "payload", "com_x", "com_y"),
        *("motor_temp", "ambient_temp", "battery_voltage", "battery_current", "surface"),
        *("wind_x", "wind_y", "sensor_rate", "run", "time"),
        *(f"wheel_current_{k}" for k in range(1, 5)),
    }


def test_held_out_runs_are_other_runs(drag):
    training, later = Telemetry.read(drag.log), Telemetry.read(drag.held_out)
    assert len(training) == 16 * 300
    assert len(later) == 8 * 300
    assert not set(training.run_names) & set(later.run_names)


def test_a_log_is_made_once(drag):
    written = drag.log.stat().st_mtime_ns
    again = make(case_of("one/air_drag/0"), drag.log.parent)
    assert again.log == drag.log
    assert again.log.stat().st_mtime_ns == written
    assert json.dumps(again.truth) == json.dumps(drag.truth)


def test_noise_is_what_the_case_asks_for(drag):
    case = case_of("one/air_drag/0")
    assert drag.truth["level"] == case.noise["level"]
    # The spread follows the power, so that its rms lies somewhat above level times mean power.
    ratio = drag.truth["noise_w"] / (drag.truth["level"] * drag.truth["mean_power_w"])
    assert 0.9 < ratio < 1.5


def test_the_robot_is_not_the_vehicle_of_the_diagnosis(drag):
    from planner.power.vehicles import load_vehicle

    robot, vehicle = load_vehicle(str(drag.robot)), load_vehicle("minibalance")
    differ = [
        robot.parameters[slug][name] / vehicle.parameters[slug][name] - 1.0
        for slug, name in (
            ("wheel_rolling", "rolling"),
            ("roller_drag", "roller"),
            ("copper_loss", "resistance"),
            ("electronics", "power"),
        )
    ]
    assert np.abs(differ).max() > 0.02
    assert np.abs(differ).max() < 0.31
    assert robot.mass == vehicle.mass  # given, not fitted
