"""Sensors of the virtual robot: their noise and their errors are as told."""

import numpy as np
import pytest

from planner.telemetry.virtual import QUIET, Noise, Sensors, VirtualRobot
from planner.telemetry.virtual.profiles import steady


@pytest.fixture(scope="module")
def rich():
    """A small rich profile: four runs of 30 s."""
    return VirtualRobot("minibalance", seed=4).profile("rich", runs=4, rows=60)


def test_noise_is_as_large_and_as_slow_as_stated():
    robot = VirtualRobot("minibalance")
    flat = steady(vx=[0.2] * 20, duration=150.0)
    quiet = robot.drive(flat, noise=QUIET).columns["power"]

    def scatter(**noise):
        return (robot.drive(flat, noise=Noise(**noise)).columns["power"] - quiet).reshape(20, 300)

    white = scatter(level=0.03, autocorrelated=0.0)
    assert white.std() == pytest.approx(0.03 * quiet.mean(), rel=0.03)
    mixed = scatter(level=0.03, autocorrelated=0.5, correlation=0.8)
    assert mixed.std() == pytest.approx(0.03 * quiet.mean(), rel=0.06)
    neighbours = np.mean(mixed[:, 1:] * mixed[:, :-1]) / np.mean(mixed**2)
    assert neighbours == pytest.approx(0.5 * 0.8, abs=0.04)
    wild = scatter(level=0.03, outliers=0.01)
    share = np.mean(np.abs(wild) > 5.5 * 0.03 * quiet.mean())
    assert share == pytest.approx(0.01, abs=0.003)


def test_sensors_err_as_told(rich):
    robot = VirtualRobot("minibalance")
    right = robot.drive(rich, noise=QUIET).columns

    def wrong(**faults):
        return robot.drive(rich, noise=QUIET, sensors=Sensors(**faults)).columns

    np.testing.assert_allclose(wrong(slope_offset=0.03)["pitch"] - right["pitch"], 0.03)
    np.testing.assert_allclose(wrong(speed_scale=1.05)["vy"], 1.05 * right["vy"])
    np.testing.assert_allclose(
        wrong(power_scale=1.1, power_offset=2.0)["power"], 1.1 * right["power"] + 2.0
    )
    turned = wrong(heading_misalignment=0.1)
    angle = np.arctan2(turned["vy"], turned["vx"]) - np.arctan2(right["vy"], right["vx"])
    moving = np.hypot(right["vx"], right["vy"]) > 0.05
    np.testing.assert_allclose(np.angle(np.exp(1j * (angle - 0.1)))[moving], 0.0, atol=1e-12)
    # A lag of one whole row moves power down by one row within each run.
    late = wrong(delay=0.5)["power"].reshape(4, 60)
    np.testing.assert_allclose(late[:, 1:], right["power"].reshape(4, 60)[:, :-1], rtol=1e-9)
    fewer = wrong(dropouts=0.2, absent=("wind_x", "surface"))
    assert len(fewer["time"]) == pytest.approx(0.8 * 240, abs=20)
    assert "wind_x" not in fewer
    assert "surface" not in fewer
