"""Small changes of speed are motion where the power follows them, else noise of the odometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.diagnosis.best_reading import best_reading
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import at_steady_speeds, open_source
from tests.telemetry.rows import plain_log

STEP = 0.02
"""s between rows."""
HELD = 50
"""Rows for which a speed is held."""


@pytest.fixture(scope="module")
def trembling():
    """Ten runs at 50 Hz with speeds that are held for a second, and tremble by 2 mm/s."""
    lengths = [300] * 10
    count = sum(lengths)
    random = np.random.default_rng(12)
    log = plain_log(lengths)
    rows = log.rows.copy()
    for speed, rate, most in (
        ("vx", "ax", 0.7),
        ("vy", "ay", 0.4),
        ("wz", "yaw_acceleration", 0.8),
    ):
        held = np.repeat(random.uniform(-most, most, count // HELD), HELD)
        rows[:, INDEX[speed]] = held + 0.002 * random.standard_normal(count)
        rows[:, INDEX[rate]] = np.gradient(rows[:, INDEX[speed]], STEP)
    time = STEP * np.concatenate([np.arange(1.0, length + 1.0) for length in lengths])
    return replace(log, rows=rows, time=time, interval=np.full(count, STEP))


@pytest.mark.parametrize("real", [True, False])
def test_the_power_says_whether_small_changes_are_motion(trembling, robot, base, real):
    moved = trembling if real else at_steady_speeds(trembling, 10)
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(trembling))
    log = replace(trembling, power=predict(robot, moved) + noise)
    chosen = best_reading(open_source(log), base)
    assert (chosen.steady_rows == 0) == real
