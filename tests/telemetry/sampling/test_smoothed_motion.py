"""A motion smoothed over neighbouring rows: less noise, the same motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling import open_source
from planner.telemetry.sampling.smoothed_motion import can_be_smoothed, with_smoothed_motion
from planner.telemetry.sampling.steady_drive import at_steady_speeds
from tests.telemetry.rows import plain_log

RATE = 100.0
"""Hz."""
NOISE = 0.003
"""m/s, of the odometry."""
HALF_WIDTH = 0.1
"""s."""


def fast(**columns: np.ndarray) -> Telemetry:
    """Two runs of 1000 rows at RATE, with some quantities."""
    log = plain_log([1000, 1000])
    rows = log.rows.copy()
    for name, values in columns.items():
        rows[:, INDEX[name]] = values
    time = np.tile(np.arange(1000) / RATE, 2)
    return replace(log, rows=rows, time=time, interval=np.full(2000, 1.0 / RATE))


def column(log: Telemetry, name: str) -> np.ndarray:
    return log.rows[:, INDEX[name]]


def test_noise_averages_out_over_the_rows_of_a_parabola():
    log = fast(vx=0.5 + NOISE * np.random.default_rng(1).standard_normal(2000))
    inner = np.r_[10:990, 1010:1990]
    rows = 21
    smooth = with_smoothed_motion(log, HALF_WIDTH)
    slope = NOISE * RATE * math.sqrt(12.0 / (rows * (rows**2 - 1)))
    ax = column(smooth, "ax")[inner]
    assert ax.std() == pytest.approx(slope, rel=0.15)
    assert slope < 0.06 * NOISE * RATE / math.sqrt(2.0)  # of differences over two rows
    # Savitzky & Golay's weight of the middle row is the share of the variance that is left.
    value = NOISE * math.sqrt((3 * rows**2 - 7) / (4 * rows * (rows**2 - 4) / 3))
    assert column(smooth, "vx")[inner].std() == pytest.approx(value, rel=0.15)
    assert value < 0.35 * NOISE


def test_a_motion_keeps_its_speed_its_acceleration_and_its_turning_frame():
    time = np.tile(np.arange(1000) / RATE, 2)
    turning = np.full(2000, 0.5)
    vx, vy = 0.3 * np.sin(2.0 * time), 0.2 * time**2
    log = with_smoothed_motion(fast(vx=vx, vy=vy, wz=turning), HALF_WIDTH)
    inner = np.r_[3:997, 1003:1997]
    ax = 0.6 * np.cos(2.0 * time) - 0.5 * vy
    ay = 0.4 * time + 0.5 * vx
    assert np.allclose(column(log, "vx")[inner], vx[inner], atol=1e-5)
    assert np.allclose(column(log, "vy"), vy, atol=1e-9)
    assert np.allclose(column(log, "ax")[inner], ax[inner], atol=0.006)
    assert np.allclose(column(log, "ay")[inner], ay[inner], atol=1e-5)
    assert np.allclose(column(log, "yaw_acceleration"), 0.0, atol=1e-9)


def test_slopes_of_the_ground_and_measured_accelerations_are_smoothed_as_values():
    noise = np.random.default_rng(2).standard_normal(2000)
    log = fast(vx=np.ones(2000), ax=0.2 + noise, gravity_x=0.1 + noise)
    log = with_smoothed_motion(replace(log, present=log.present | {"ax", "ay"}), HALF_WIDTH)
    for name, mean in (("ax", 0.2), ("gravity_x", 0.1)):
        inner = column(log, name)[10:990]
        assert inner.mean() == pytest.approx(mean, abs=0.15)
        assert inner.std() < 0.35 * noise.std()


def test_uneven_rows_are_fitted_at_their_own_times():
    late = np.random.default_rng(3).uniform(-0.3, 0.3, 2000) / RATE
    time = np.tile(np.arange(1000) / RATE, 2) + late
    log = with_smoothed_motion(replace(fast(vx=0.4 * time), time=time), HALF_WIDTH)
    inner = np.r_[3:997, 1003:1997]
    assert np.allclose(column(log, "ax")[inner], 0.4, atol=1e-9)
    assert np.allclose(column(log, "vx")[inner], 0.4 * time[inner], atol=1e-9)


def test_parabolas_end_with_a_run_and_at_a_gap():
    step = np.repeat([0.5, 1.0], 1000)
    assert np.allclose(column(with_smoothed_motion(fast(vx=step), HALF_WIDTH), "ax"), 0.0)
    log = fast(vx=np.tile(np.repeat([0.5, 1.0], 500), 2))
    gap = replace(log, time=log.time + 5.0 * (log.time >= 5.0))
    assert np.allclose(column(with_smoothed_motion(gap, HALF_WIDTH), "ax"), 0.0)
    assert column(with_smoothed_motion(log, HALF_WIDTH), "ax").max() > 1.0


def test_rows_at_rest_and_slow_rows_stay():
    still = np.tile(np.repeat([0.0, 1.0], 500), 2)
    smooth = column(with_smoothed_motion(fast(vx=still), HALF_WIDTH), "vx")
    assert np.all(smooth[:500] == 0.0)
    slow = replace(fast(vx=still), time=np.tile(np.arange(1000) / 10.0, 2))
    assert not can_be_smoothed(slow, HALF_WIDTH)
    assert with_smoothed_motion(slow, HALF_WIDTH) is slow
    assert can_be_smoothed(slow, 3.0 * HALF_WIDTH)


def test_steady_drives_keep_their_means_beside_a_smoothed_motion():
    rng = np.random.default_rng(4)
    ramp = np.concatenate([np.full(500, 0.5), np.linspace(0.5, 1.5, 500)])
    log = fast(vx=np.tile(ramp, 2) + 0.5 * NOISE * rng.standard_normal(2000))
    smooth = with_smoothed_motion(log, HALF_WIDTH)
    both = at_steady_speeds(log, 20, smooth)
    changes = [np.diff(column(one, "vx")[20:480]) != 0.0 for one in (both, smooth)]
    assert changes[0].mean() < 0.3
    assert changes[1].all()
    rising = np.r_[520:980, 1520:1980]
    assert np.array_equal(column(both, "vx")[rising], column(smooth, "vx")[rising])
    assert np.array_equal(column(both, "ax")[rising], column(smooth, "ax")[rising])


def test_chunks_of_a_long_log_are_read_as_its_sample(monkeypatch):
    log = fast(vx=np.random.default_rng(3).standard_normal(2000))
    monkeypatch.setattr("planner.telemetry.sampling.sample.LogSource.CHUNK_ROWS", 700)
    smooth = [one for one in open_source(log).readings() if one.reading.half_width]
    assert len({one.reading for one in smooth}) == len(smooth) == 6
    for source in smooth:
        chunks = replace(source, complete=False).chunks()
        together = np.concatenate([chunk.rows for chunk in chunks])
        assert np.allclose(together, source.sample.rows, atol=1e-9, equal_nan=True)
