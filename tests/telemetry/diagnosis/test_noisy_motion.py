"""Noise of speeds and tilts must not look like something that a robot does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.diagnosis import diagnose
from planner.telemetry.estimation.parameter_errors import INTERVAL_Z
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict
from tests.power.states import changed
from tests.telemetry.rows import TRUTH, base_model, measured, plain_log

STEP = 0.1
"""s between rows: too long to smooth the motion over neighbours."""
RUNS = [250] * 12
TILT_NOISE = 0.003
"""rad of single rows, as of a cheap tilt sensor."""
SPEED_NOISE = 0.008
"""m/s of single rows, as of coarse encoders."""
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
    assert found.verdict == "complete"


def test_what_a_robot_does_is_named_beside_noise_of_a_tilt_sensor(
    swaying: Telemetry, base: PowerModel, robot: PowerModel
) -> None:
    turning = STEERING * np.abs(swaying.rows[:, INDEX["wz"]])
    found = diagnose(seen(measured(swaying, robot, POWER_NOISE, seed=3, extra=turning)), base)
    assert found.verdict == "outside_catalogue"
    assert found.outside is not None
    assert found.outside.quantities == ("yaw_rate",)


@pytest.mark.nightly
def test_what_noise_of_the_speeds_blurs_is_in_the_intervals(swaying: Telemetry) -> None:
    """Noise of a speed near rest spreads friction at rest over more of it, so that less is seen."""
    true = {"strength": 2.0, "stiction_speed": 0.05}
    sticky = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=("stiction",))
    sticky = changed(sticky, **TRUTH, **{f"stiction__{name}": v for name, v in true.items()})
    log, random = measured(swaying, sticky, POWER_NOISE, seed=3), np.random.default_rng(5)
    rows = log.rows.copy()
    for name in ("vx", "vy"):
        rows[:, INDEX[name]] += SPEED_NOISE * random.standard_normal(len(log))
    found = diagnose(replace(log, rows=rows), base_model())
    assert found.selected == ("stiction",)
    (named,) = (c for c in found.candidates if c.effect == "stiction")
    for name, value in true.items():
        told = named.parameters[name]
        assert told.stderr is not None
        assert abs(told.value - value) < INTERVAL_Z * told.stderr
        assert told.stderr < 0.4 * value
