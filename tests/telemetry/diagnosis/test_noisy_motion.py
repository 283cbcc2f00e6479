"""Noise of speeds and tilts must not look like something that a robot does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.diagnosis import diagnose
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from tests.telemetry.rows import measured, plain_log

STEP = 0.1
"""s between rows: too long to smooth the motion over neighbours."""
RUNS = [250] * 12
TILT_NOISE = 0.003
"""rad of single rows, as of a cheap tilt sensor."""
POWER_NOISE = 0.005
"""Standard deviation of the power over its mean."""
STEERING = 3.0
"""W per rad/s, of a part that works in turns."""


@pytest.fixture(scope="module")
def swaying() -> Telemetry:
    """A drive on level ground whose speeds sway slowly."""
    log, random = plain_log(RUNS), np.random.default_rng(13)
    rows = log.rows.copy()
    for speed, rate, most in (
        ("vx", "ax", 0.6),
        ("vy", "ay", 0.4),
        ("wz", "yaw_acceleration", 0.6),
    ):
        parts = []
        for length in RUNS:
            beat, phase = random.uniform(0.3, 0.9, 3), random.uniform(0.0, 6.0, 3)
            waves = np.sin(np.outer(STEP * np.arange(length), beat) + phase)
            parts.append(most * waves.mean(axis=1))
        rows[:, INDEX[speed]] = np.concatenate(parts)
        rows[:, INDEX[rate]] = np.concatenate([np.gradient(part, STEP) for part in parts])
    vx, vy, wz = (rows[:, INDEX[name]].copy() for name in ("vx", "vy", "wz"))
    rows[:, INDEX["ax"]] -= wz * vy
    rows[:, INDEX["ay"]] += wz * vx
    time = STEP * np.concatenate([np.arange(1.0, length + 1.0) for length in RUNS])
    return replace(log, rows=rows, time=time, interval=np.full(len(time), STEP))


def seen(log: Telemetry) -> Telemetry:
    """The log as a noisy tilt sensor shows it."""
    random, rows = np.random.default_rng(14), log.rows.copy()
    for name in ("gravity_x", "gravity_y"):
        noise = TILT_NOISE * STANDARD_GRAVITY * random.standard_normal(len(log))
        rows[:, INDEX[name]] += noise
    return replace(log, rows=rows, present=log.present | {"roll", "pitch"})


def test_noise_of_a_tilt_sensor_is_no_formula(
    swaying: Telemetry, base: PowerModel, robot: PowerModel
) -> None:
    """A formula over the slope would only take back what the model makes of the noise."""
    found = diagnose(seen(measured(swaying, robot, POWER_NOISE, seed=3)), base)
    noise = float(np.std(predict(robot, seen(swaying)) - predict(robot, swaying)))
    assert noise**2 > 0.5 * found.baseline.heldout_rmse_w**2
    assert found.outside is None
    assert not found.selected
    assert found.verdict == "not_identifiable"


def test_what_a_robot_does_is_named_beside_noise_of_a_tilt_sensor(
    swaying: Telemetry, base: PowerModel, robot: PowerModel
) -> None:
    turning = STEERING * np.abs(swaying.rows[:, INDEX["wz"]])
    found = diagnose(seen(measured(swaying, robot, POWER_NOISE, seed=3, extra=turning)), base)
    assert found.verdict == "outside_catalogue"
    assert found.outside is not None
    assert found.outside.quantities == ("yaw_rate",)
