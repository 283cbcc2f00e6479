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


def test_a_steady_acceleration_is_no_slope(settled):
    """After many time constants a filter shows all of it: the nose up by a/g."""
    rows = np.tile(settled.rows[:12], (10, 1))
    rows[:, INDEX["ax"]], rows[:, INDEX["ay"]] = RATE, -TURN
    rows[:, INDEX["gravity_x"]], rows[:, INDEX["gravity_y"]] = -RATE, TURN
    log = with_tilt_freed(plain_log([len(rows)], rows), 2 * STEP)
    first, last = log.rows[0], log.rows[-1]
    assert last[INDEX["gravity_x"]] == pytest.approx(0.0, abs=1e-9)
    assert last[INDEX["gravity_y"]] == pytest.approx(0.0, abs=1e-9)
    assert first[INDEX["gravity_x"]] == pytest.approx(-RATE * np.exp(-0.5))
    assert np.array_equal(log.rows[:, INDEX["ax"]], rows[:, INDEX["ax"]])
