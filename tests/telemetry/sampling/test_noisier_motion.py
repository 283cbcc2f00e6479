"""How noisy a motion is, and the same motion with as much noise again."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling import open_source
from planner.telemetry.sampling.noisier_motion import noise_of_motion, with_more_noise
from tests.telemetry.rows import STEP, plain_log

NOISE = {"vx": 0.004, "vy": 0.002, "wz": 0.008, "ax": 0.05, "gravity_x": 0.003 * STANDARD_GRAVITY}
"""SI units, of single rows."""
RUNS = [500] * 8


@pytest.fixture
def swaying() -> Telemetry:
    """Runs whose speeds and slopes sway smoothly, with NOISE; ax is measured, ay follows vy."""
    log, random = plain_log(RUNS), np.random.default_rng(1)
    rows = log.rows.copy()
    for phase, name in enumerate(NOISE):
        wave = 0.4 * np.sin(0.3 * log.time + phase)
        rows[:, INDEX[name]] = wave + NOISE[name] * random.standard_normal(len(log))
    return replace(log, rows=rows, present=log.present | {"ax", "pitch"})


def column(log: Telemetry, name: str) -> np.ndarray:
    return log.rows[:, INDEX[name]]


def test_noise_is_told_from_a_smooth_motion(swaying):
    found = noise_of_motion(swaying)
    for name, size in NOISE.items():
        assert found[name] == pytest.approx(size, rel=0.1), name
    assert found["gravity_y"] == 0.0  # level across, and no sensor
    assert "ay" not in found  # it was not measured: its noise is that of vy


def test_steps_and_rows_at_rest_are_no_noise(swaying):
    rows = swaying.rows.copy()
    rows[::25, INDEX["vx"]] += 1.0
    jerky = noise_of_motion(replace(swaying, rows=rows))
    assert jerky["vx"] == pytest.approx(NOISE["vx"], rel=0.3)
    rows[np.arange(len(swaying)) % 500 < 400] = plain_log([1]).rows[0]
    halting = noise_of_motion(replace(swaying, rows=rows))
    assert halting["vy"] == pytest.approx(NOISE["vy"], rel=0.3)


def test_a_motion_without_noise_stays(swaying):
    rows = plain_log(RUNS).rows.copy()
    rows[:, INDEX["vx"]] = np.repeat([0.2, 0.5, 0.0, 0.7], 1000)
    steady = replace(swaying, rows=rows)
    same = with_more_noise(steady, np.random.default_rng(2))
    assert np.allclose(same.rows, rows, atol=1e-12, equal_nan=True)
    short = plain_log([2, 1, 3])
    assert np.array_equal(
        with_more_noise(short, np.random.default_rng(2)).rows, short.rows, equal_nan=True
    )


def test_noise_has_twice_the_variance(swaying):
    noisier = with_more_noise(swaying, np.random.default_rng(2))
    for name, size in noise_of_motion(noisier).items():
        assert size == pytest.approx(math.sqrt(2.0) * NOISE.get(name, 0.0), rel=0.1), name
    added = column(noisier, "vx") - column(swaying, "vx")
    before = column(swaying, "vx") - 0.4 * np.sin(0.3 * swaying.time)
    assert abs(np.corrcoef(added, before)[0, 1]) < 0.05
    assert np.array_equal(noisier.power, swaying.power)


def test_accelerations_that_were_not_measured_are_slopes_of_the_noisier_speeds(swaying):
    noisier = with_more_noise(swaying, np.random.default_rng(2))
    inner = np.r_[1:499, 501:999]
    speed, turning = column(noisier, "vy"), column(noisier, "wz") * column(noisier, "vx")
    was = column(swaying, "vy"), column(swaying, "wz") * column(swaying, "vx")
    slope = np.gradient(speed - was[0], STEP)[inner]
    change = (column(noisier, "ay") - column(swaying, "ay"))[inner]
    assert np.allclose(change, slope + (turning - was[1])[inner], atol=1e-12)
    # One measured of itself has the noise of its own sensor, which is not that of the speeds.
    measured = column(noisier, "ax") - column(swaying, "ax")
    assert measured.std() == pytest.approx(NOISE["ax"], rel=0.1)


def test_rows_at_rest_stay(swaying):
    rows = swaying.rows.copy()
    rest = np.arange(len(swaying)) % 500 < 100
    rows[rest] = plain_log([1]).rows[0]
    still = replace(swaying, rows=rows)
    noisier = with_more_noise(still, np.random.default_rng(2))
    names = [INDEX[name] for name in ("vx", "vy", "wz", "gravity_x")]
    assert np.array_equal(noisier.rows[rest][:, names], rows[rest][:, names])


def test_copies_of_a_log_differ_and_are_read_alike(swaying):
    source = open_source(swaying)
    read = source.readings()[-1]
    copies = source.noisier_as(read)
    speeds = [column(copy, "vx") for copy in copies]
    assert len(copies) > 1
    assert not np.array_equal(speeds[0], speeds[1])
    again = source.noisier_as(read)
    for one, other in zip(copies, again, strict=True):
        assert np.array_equal(one.rows, other.rows, equal_nan=True)
    steady = source.noisier_as(source.steady())
    repeated = [np.mean(np.diff(column(kind[0], "vx")) == 0.0) for kind in (copies, steady)]
    plain = [np.mean(np.diff(column(one.sample, "vx")) == 0.0) for one in (read, source.steady())]
    assert repeated == pytest.approx(plain, abs=0.2)
