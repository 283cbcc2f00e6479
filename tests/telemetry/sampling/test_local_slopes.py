"""Accelerations of fast logs as slopes of lines: less noise, the same motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling import open_source
from planner.telemetry.sampling.local_slopes import has_local_slopes, with_local_slopes
from tests.telemetry.rows import plain_log

RATE = 100.0
"""Hz."""
NOISE = 0.003
"""m/s, of the odometry."""


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


def test_noise_averages_out_over_the_rows_of_a_line():
    log = fast(vx=0.5 + NOISE * np.random.default_rng(1).standard_normal(2000))
    inner = np.r_[10:990, 1010:1990]
    rows = 21
    expected = NOISE * RATE * math.sqrt(12.0 / (rows * (rows**2 - 1)))
    ax = column(with_local_slopes(log), "ax")[inner]
    assert ax.std() == pytest.approx(expected, rel=0.15)
    assert expected < 0.06 * NOISE * RATE / math.sqrt(2.0)  # of differences over two rows


def test_a_motion_keeps_its_acceleration_and_its_turning_frame():
    time = np.tile(np.arange(1000) / RATE, 2)
    turning = np.full(2000, 0.5)
    log = with_local_slopes(fast(vx=0.3 * np.sin(2.0 * time), vy=0.2 * time, wz=turning))
    inner = np.r_[2:998, 1002:1998]
    ax = 0.6 * np.cos(2.0 * time) - 0.5 * 0.2 * time
    ay = 0.2 + 0.5 * 0.3 * np.sin(2.0 * time)
    assert np.allclose(column(log, "ax")[inner], ax[inner], atol=0.006)
    assert np.allclose(column(log, "ay")[inner], ay[inner], atol=1e-9)
    assert np.allclose(column(log, "yaw_acceleration"), 0.0, atol=1e-9)


def test_lines_end_with_a_run_and_at_a_gap():
    step = np.repeat([0.0, 1.0], 1000)
    assert np.allclose(column(with_local_slopes(fast(vx=step)), "ax"), 0.0, atol=1e-9)
    log = fast(vx=np.tile(np.repeat([0.0, 1.0], 500), 2))
    gap = replace(log, time=log.time + 5.0 * (log.time >= 5.0))
    assert np.allclose(column(with_local_slopes(gap), "ax"), 0.0, atol=1e-9)
    assert column(with_local_slopes(log), "ax").max() > 1.0


def test_measured_accelerations_and_slow_rows_stay():
    noise = np.random.default_rng(2).standard_normal(2000)
    log = fast(vx=noise, ax=noise)
    measured = replace(log, present=log.present | {"ax", "ay"})
    assert has_local_slopes(log)
    assert not has_local_slopes(measured)
    assert np.array_equal(column(with_local_slopes(measured), "ax"), noise)
    slow = replace(log, time=10.0 * log.time)
    assert not has_local_slopes(slow)
    assert with_local_slopes(slow) is slow


def test_chunks_of_a_long_log_are_read_as_its_sample(monkeypatch):
    log = fast(vx=np.random.default_rng(3).standard_normal(2000))
    monkeypatch.setattr("planner.telemetry.sampling.sample.LogSource.CHUNK_ROWS", 700)
    source = next(one for one in open_source(log).readings() if one.lines)
    chunks = replace(source, complete=False).chunks()
    together = np.concatenate([chunk.rows for chunk in chunks])
    assert np.allclose(together, source.sample.rows, atol=1e-9, equal_nan=True)
