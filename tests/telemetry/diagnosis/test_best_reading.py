"""Small changes of speed are motion where the power follows them, else noise of the odometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.diagnosis.best_reading import best_reading
from planner.telemetry.logs import Meter
from planner.telemetry.prediction import predict
from planner.telemetry.sampling import open_source
from planner.telemetry.sampling.steady_drive import at_steady_speeds
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
    assert (chosen.reading.steady_rows == 0) == real


@pytest.fixture(scope="module")
def swaying():
    """Ten runs at 50 Hz whose speeds sway slowly, and the same as odometry with noise sees them."""
    lengths = [400] * 10
    random = np.random.default_rng(13)
    log = plain_log(lengths)
    time = STEP * np.concatenate([np.arange(1.0, length + 1.0) for length in lengths])
    log = replace(log, time=time, interval=np.full(len(time), STEP))
    rows, seen = log.rows.copy(), log.rows.copy()
    for speed, rate, most in (
        ("vx", "ax", 0.6),
        ("vy", "ay", 0.4),
        ("wz", "yaw_acceleration", 0.6),
    ):
        parts = []
        for length in lengths:
            beat, phase = random.uniform(0.8, 2.5, 3), random.uniform(0.0, 6.0, 3)
            waves = np.sin(np.outer(STEP * np.arange(length), beat) + phase)
            parts.append(most * waves.mean(axis=1))
        rows[:, INDEX[speed]] = np.concatenate(parts)
        seen[:, INDEX[speed]] = rows[:, INDEX[speed]] + 0.005 * random.standard_normal(len(time))
        for table in (rows, seen):
            of_run = np.split(table[:, INDEX[speed]], len(lengths))
            table[:, INDEX[rate]] = np.concatenate([np.gradient(v, STEP) for v in of_run])
    for table in (rows, seen):
        vx, vy, wz = (table[:, INDEX[name]].copy() for name in ("vx", "vy", "wz"))
        table[:, INDEX["ax"]] -= wz * vy
        table[:, INDEX["ay"]] += wz * vx
    return replace(log, rows=rows), replace(log, rows=seen)


@pytest.mark.parametrize("time_constant", [0.2, pytest.param(0.0, marks=pytest.mark.nightly)])
def test_noise_of_the_motion_does_not_change_the_meter(swaying, robot, base, time_constant):
    """A filter would take away what noisy accelerations add to the power."""
    moved, seen = swaying
    meter = Meter(time_constant) if time_constant else None
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(seen))
    log = replace(seen, power=predict(robot, replace(moved, meter=meter)) + noise)
    chosen = best_reading(open_source(log), base)
    assert chosen.reading.half_width > 0.0
    assert chosen.reading.steady_rows == 0, "no speed is held"
    found = chosen.sample.meter.time_constant_s if chosen.sample.meter else 0.0
    assert found == pytest.approx(time_constant, rel=0.1, abs=0.5 * STEP)


def test_ramps_of_noisy_odometry_bend_sharply(robot, base):
    """Controllers drive ramps; what a parabola blurs at their bends looks like a filter."""
    lengths, random = [400] * 10, np.random.default_rng(14)
    log = plain_log(lengths)
    time = STEP * np.concatenate([np.arange(1.0, length + 1.0) for length in lengths])
    log = replace(log, time=time, interval=np.full(len(time), STEP))
    rows, seen = log.rows.copy(), log.rows.copy()
    for start in range(0, len(time), 400):
        bends = np.linspace(0.0, 9.0, 10) + np.r_[0.0, random.uniform(-0.3, 0.3, 8), 0.0]
        for speed, rate, most in (("vx", "ax", 0.6), ("wz", "yaw_acceleration", 0.6)):
            speeds = np.interp(time[:400], bends, random.uniform(-most, most, len(bends)))
            rows[start : start + 400, INDEX[speed]] = speeds
            rows[start : start + 400, INDEX[rate]] = np.gradient(speeds, STEP)
    for speed in ("vx", "vy", "wz"):
        seen[:, INDEX[speed]] = rows[:, INDEX[speed]] + 0.004 * random.standard_normal(len(time))
    for table in (rows, seen):
        vx, vy, wz = (table[:, INDEX[name]].copy() for name in ("vx", "vy", "wz"))
        if table is seen:
            for name, speeds in (("ax", vx), ("ay", vy), ("yaw_acceleration", wz)):
                runs = np.split(speeds, len(lengths))
                table[:, INDEX[name]] = np.concatenate([np.gradient(v, STEP) for v in runs])
        table[:, INDEX["ax"]] -= wz * vy
        table[:, INDEX["ay"]] += wz * vx
    noise = 0.1 * random.standard_normal(len(time))
    power = predict(robot, replace(log, rows=rows)) + noise
    chosen = best_reading(open_source(replace(log, rows=seen, power=power)), base)
    assert chosen.reading.ramps
    meter = chosen.sample.meter
    assert meter is None or meter.time_constant_s < STEP, "the power is read as it is"


@pytest.mark.parametrize("real", [True, False])
def test_noise_that_a_filter_makes_last_is_no_sideways_motion(robot, base, real):
    """Drives at 20 Hz, the noise of their sideways speed 4 mm/s behind a filter of 0.1 s.

    Of noise that lasts, next rows are alike as those of a swing are. Rollers that stand would get
    friction to either side, which bends what a model finds.
    """
    step, lengths = 0.05, [400] * 8
    random, count = np.random.default_rng(14), sum(lengths)
    log = plain_log(lengths)
    time = step * np.concatenate([np.arange(1.0, length + 1.0) for length in lengths])
    rows, keep = log.rows.copy(), np.exp(-step / 0.1)
    held = np.repeat(random.uniform(0.2, 0.7, count // HELD), HELD)
    forward = np.repeat(random.random(count // HELD) < 0.7, HELD)
    rows[:, INDEX["vx"]], rows[:, INDEX["vy"]] = held * forward, held * ~forward
    beside = np.zeros(count)
    for k in range(1, count):
        beside[k] = keep * beside[k - 1] + 0.004 * np.sqrt(1.0 - keep**2) * random.normal()
    straight = replace(log, rows=rows, time=time, interval=np.full(count, step))
    seen = rows.copy()
    seen[:, INDEX["vy"]] += beside
    seen[:, INDEX["vx"]] += 0.001 * random.standard_normal(count)
    seen_log = replace(straight, rows=seen)
    power = predict(robot, seen_log if real else straight)
    noise = 0.1 * random.standard_normal(count)
    chosen = best_reading(open_source(replace(seen_log, power=power + noise)), base)
    share = np.mean(chosen.sample.rows[forward, INDEX["vy"]] == 0.0)
    assert (share > 0.9) == (not real)


@pytest.mark.parametrize("late", [0.0, 0.01])
def test_counts_of_encoders_that_are_read_early_or_late_are_smoothed(robot, base, late):
    """Rows of 0.1 s, whose speeds are counts over intervals that scatter by ``late`` s."""
    step, lengths = 0.1, [200] * 8
    random, log = np.random.default_rng(15), plain_log(lengths)
    time = step * np.concatenate([np.arange(1.0, length + 1.0) for length in lengths])
    log = replace(log, time=time, interval=np.full(len(time), step))
    rows, seen = log.rows.copy(), log.rows.copy()
    for length, stop in zip(lengths, np.cumsum(lengths), strict=True):
        own = slice(stop - length, stop)
        beat, phase = random.uniform(0.8, 2.5, 3), random.uniform(0.0, 6.0, 3)
        waves = np.sin(np.outer(step * np.arange(length), beat) + phase).mean(axis=1)
        counted = 1.0 + np.diff(late * random.standard_normal(length + 1)) / step
        for table, scatter in ((rows, 1.0), (seen, counted)):
            table[own, INDEX["vx"]] = (0.5 + 0.4 * waves) * scatter
            table[own, INDEX["ax"]] = np.gradient(table[own, INDEX["vx"]], step)
    moved = predict(robot, replace(log, rows=rows))
    noise = 0.1 * random.standard_normal(len(seen))
    chosen = best_reading(open_source(replace(log, rows=seen, power=moved + noise)), base)
    assert (chosen.reading.half_width > 0.0) == (late > 0.0)
    if late:
        as_read = predict(robot, replace(log, rows=seen))
        smooth = predict(robot, replace(chosen.sample, meter=None))
        assert np.std(smooth - moved) < 0.5 * np.std(as_read - moved)
