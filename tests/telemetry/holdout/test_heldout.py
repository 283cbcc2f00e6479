"""A fit that held-out runs refute is not used: the model as stated is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.report.workbench_wording import how_far
from planner.telemetry.comparison import compare
from planner.telemetry.diagnosis import diagnose
from planner.telemetry.estimation import fit
from planner.telemetry.holdout.heldout import base_fit, heldout_rmse, rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import at_steady_speeds
from planner.telemetry.virtual import Noise, VirtualRobot
from tests.power.states import changed
from tests.telemetry.rows import measured

ROW = 0.1
"""Interval of a row, s."""
TIME_CONSTANT = 0.8
"""Of the meter's first-order filter, s."""


@pytest.fixture(scope="module")
def filtered(tmp_path_factory) -> Telemetry:
    """A drive of the stated vehicle whose meter averages the power over some tenths of seconds."""
    path = tmp_path_factory.mktemp("logs") / "filtered.csv"
    robot = VirtualRobot("minibalance", seed=1)
    profile = robot.profile("rich", runs=8, rows=400, row=ROW)
    robot.drive(profile, noise=Noise(level=0.01)).write_csv(path)
    log = Telemetry.read(path)
    power = log.power.copy()
    for k in range(1, len(power)):
        if log.run[k] == log.run[k - 1]:
            gain = 1.0 - np.exp(-ROW / TIME_CONSTANT)
            power[k] = power[k - 1] + gain * (log.power[k] - power[k - 1])
    return replace(log, power=power)


def test_a_filtered_meter_refutes_the_fit(filtered, base):
    steady = at_steady_speeds(filtered)
    stated = rms(steady.power - predict(base, steady))
    assert heldout_rmse(steady, fit(steady, base)) > 1.1 * stated  # what the gate is for
    used = base_fit(steady, base)
    assert np.array_equal(used.model.parameters, base.parameters)
    assert used.rmse_w == pytest.approx(stated)
    assert heldout_rmse(steady, used) == pytest.approx(stated)
    assert used.refused is not None
    assert used.refused.stated_rmse_w == pytest.approx(stated)


def test_a_fit_that_finds_the_robot_is_used(motion, base):
    robot = changed(base, electronics__power=1.3, wheel_rolling__rolling=1.2)
    used = base_fit(measured(motion, robot, 0.02, seed=7), base)
    assert used.refused is None
    assert used.places


def test_comparison_and_diagnosis_say_that_the_fit_is_refused(filtered, base):
    compared = compare(filtered, base.vehicle)
    found = diagnose(filtered, base.vehicle)
    assert not compared.fitted
    assert compared.parameters == ()
    document = compared.to_json()
    for entry, sentence in (
        (document["refused_fit"], how_far(document)),
        (found.to_json()["refused_fit"], found.sentence),
    ):
        assert entry["heldout_rmse_w"] > entry["stated_rmse_w"]
        assert "The fit to this log is not used" in sentence
    steady = at_steady_speeds(filtered)
    assert found.baseline.rmse_w == pytest.approx(rms(steady.power - predict(base, steady)))
    assert found.after.heldout_rmse_w <= found.baseline.heldout_rmse_w
