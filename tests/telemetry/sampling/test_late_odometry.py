"""What a first-order filter makes of a motion is undone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.sampling.late_odometry import with_tilt_freed, with_undone_lag
from tests.telemetry.rows import STEP, plain_log

LAG, RATE, TURN = 0.2, 0.3, 0.4


@pytest.fixture
def settled():
    """Two runs of speeds that rise evenly, as a settled filter shows them: LAG s late."""
    log = plain_log([12, 9])
    rows = log.rows.copy()
    rows[:, INDEX["vx"]] = RATE * (log.time - LAG)
    rows[:, INDEX["wz"]] = TURN
    return replace(log, rows=rows)


def test_a_settled_filter_is_undone(settled):
    log = with_undone_lag(settled, LAG)
    assert log.rows[:, INDEX["vx"]] == pytest.approx(RATE * settled.time)
    assert log.rows[:, INDEX["ax"]] == pytest.approx(RATE)
    assert log.rows[:, INDEX["ay"]] == pytest.approx(TURN * RATE * settled.time)


def test_a_step_of_the_acceleration_is_sharpened(settled):
    time = settled.time[:12] - 6 * STEP
    shown = np.where(time > 0, RATE * (time - LAG * (1 - np.exp(-np.maximum(time, 0) / LAG))), 0)
    rows = settled.rows[:12].copy()
    rows[:, INDEX["vx"]] = shown
    log = replace(settled.take(slice(0, 12)), rows=rows)
    true = RATE * np.maximum(time, 0)
    error = np.abs(with_undone_lag(log, LAG).rows[:, INDEX["vx"]] - true)
    assert error.max() < 0.6 * np.abs(shown - true).max()


def test_a_measured_acceleration_stays(settled):
    rows = settled.rows.copy()
    rows[:, INDEX["ax"]] = 0.7
    log = replace(settled, rows=rows, present=settled.present | {"ax"})
    assert with_undone_lag(log, LAG).rows[:, INDEX["ax"]] == pytest.approx(0.7)


@pytest.fixture
def speeding():
    """A run that speeds up all the time; its angles show that whole acceleration as slopes.

    The accelerometer that was logged is a biased one.
    """
    log = plain_log([120])
    rows = log.rows.copy()
    rows[:, INDEX["vx"]], rows[:, INDEX["vy"]] = RATE * log.time, -TURN * log.time
    rows[:, INDEX["gravity_x"]], rows[:, INDEX["gravity_y"]] = -RATE, TURN
    rows[:, INDEX["ax"]] = RATE + 0.7
    return replace(log, rows=rows, present=log.present | {"ax"})


def test_a_steady_acceleration_is_no_slope(speeding):
    """A settled filter shows all of it, the nose up by a/g, and so it does after a gap."""
    for log in (speeding, speeding.take(np.r_[0:40, 55:120])):
        freed = with_tilt_freed(log, 10 * STEP)
        for name in ("gravity_x", "gravity_y"):
            assert freed.rows[:, INDEX[name]] == pytest.approx(0.0, abs=1e-9)
        assert np.array_equal(freed.rows[:, INDEX["ax"]], log.rows[:, INDEX["ax"]])


def test_a_filter_that_felt_nothing_before_follows_from_then_on(speeding):
    seconds = 10 * STEP
    freed = with_tilt_freed(speeding, seconds, rested=True)
    left = -RATE * np.exp(-(speeding.time - speeding.time[0]) / seconds)
    assert freed.rows[:, INDEX["gravity_x"]] == pytest.approx(left)


def test_turning_at_a_steady_speed_is_felt(settled):
    """On a circle no speed changes, and still the robot seems to lean."""
    rows = settled.rows.copy()
    rows[:, INDEX["vx"]] = speed = 0.5
    rows[:, INDEX["gravity_y"]] = -TURN * speed
    freed = with_tilt_freed(replace(settled, rows=rows), 0.5)
    assert freed.rows[:, INDEX["gravity_y"]] == pytest.approx(0.0, abs=1e-9)
