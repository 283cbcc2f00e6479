"""A power may follow another motion than that of its rows: half a row apart, or before a filter."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.signal import lfilter

from planner.quantities import INDEX
from planner.telemetry.comparison import compare
from planner.telemetry.diagnosis.best_reading import best_reading
from planner.telemetry.estimation import followed_motions
from planner.telemetry.holdout import metered_base_fit
from planner.telemetry.logs import Meter
from planner.telemetry.sampling import open_source
from tests.telemetry.rows import plain_log

FINE, COARSE = 0.01, 0.2
"""s of the drive's own steps, and of the rows of its log."""
MANY = round(COARSE / FINE)
RUNS, RUN = 12, 30.0


def ramps(random: np.random.Generator, most: float, pull: float) -> np.ndarray:
    """A speed that goes evenly to one value after the other, at bends that no row knows of."""
    time, speed, now = [0.0], [0.0], 0.0
    while time[-1] < RUN:
        goal = random.uniform(-most, most)
        time += [time[-1] + abs(goal - now) / pull, 0.0]
        time[-1] = time[-2] + random.uniform(0.5, 4.0)
        speed += [goal, goal]
        now = goal
    return np.interp(FINE * np.arange(1, round(RUN / FINE) + 1), time, speed)


def accelerate(rows: np.ndarray, step: float) -> None:
    """Set the accelerations by differences of neighbouring rows of a run."""
    vx, vy, wz = (rows[:, INDEX[name]] for name in ("vx", "vy", "wz"))
    by_run = [np.split(speed, RUNS) for speed in (vx, vy, wz)]
    slopes = [np.concatenate([np.gradient(r, step) for r in runs]) for runs in by_run]
    for name, turning, slope in zip(
        ("ax", "ay", "yaw_acceleration"), (-wz * vy, wz * vx, 0.0), slopes, strict=True
    ):
        rows[:, INDEX[name]] = turning + slope


class Driven(NamedTuple):
    """Motion in steps of FINE s; means and last values of every row; power, (rows, MANY) W."""

    fine: np.ndarray
    means: np.ndarray
    ends: np.ndarray
    power: np.ndarray


@pytest.fixture(scope="module")
def driven(robot):
    """A drive that no row tells all of."""
    random = np.random.default_rng(7)
    count = RUNS * round(RUN / FINE)
    fine = plain_log([round(RUN / FINE)] * RUNS).rows
    for name, most, pull in (("vx", 0.7, 0.35), ("vy", 0.4, 0.2), ("wz", 0.8, 0.4)):
        fine[:, INDEX[name]] = np.concatenate([ramps(random, most, pull) for _ in range(RUNS)])
    accelerate(fine, FINE)
    by_row = fine.reshape(count // MANY, MANY, -1)
    return Driven(fine, by_row.mean(axis=1), by_row[:, -1], robot.watts(fine).reshape(-1, MANY))


def log_of(motion: np.ndarray, power: np.ndarray, step: float = COARSE):
    """Rows of ``step`` s with accelerations from neighbouring rows."""
    lengths = [round(RUN / step)] * RUNS
    time = np.concatenate([step * np.arange(1.0, n + 1.0) for n in lengths])
    rows = motion.copy()
    accelerate(rows, step)
    size = 0.02 * float(np.mean(np.abs(power)))
    noise = size * np.random.default_rng(3).standard_normal(len(rows))
    interval = np.full(len(rows), step)
    return replace(plain_log(lengths), rows=rows, time=time, interval=interval, power=power + noise)


def test_a_power_at_the_end_of_rows_follows_the_motion_between_them(driven, base):
    _, means, _, power = driven
    chosen = best_reading(open_source(log_of(means, power[:, -1])), base)
    assert chosen.reading.ahead
    meter = chosen.sample.meter_as_logged
    assert meter.sampling == "end"
    assert meter.time_constant_s + abs(meter.delay_s) < 0.1 * COARSE


def test_a_mean_power_beside_speeds_of_the_rows_ends_is_half_a_row_late(driven, base):
    _, _, ends, power = driven
    chosen = best_reading(open_source(log_of(ends, power.mean(axis=1))), base)
    assert chosen.reading.ahead
    meter = chosen.sample.meter_as_logged
    assert meter.sampling == "mean"
    assert meter.delay_s == pytest.approx(0.5 * COARSE, abs=0.1 * COARSE)


def test_a_power_of_the_same_moment_follows_the_rows(driven, base):
    _, _, ends, power = driven
    assert followed_motions(open_source(log_of(ends, power[:, -1])), base) == []


def late(rows: np.ndarray, time_constant: float) -> np.ndarray:
    """Speeds of steps of FINE s behind a first-order filter."""
    keep, shown = np.exp(-FINE / time_constant), rows.copy()
    for name in ("vx", "vy", "wz"):
        runs = np.split(rows[:, INDEX[name]], RUNS)
        shown[:, INDEX[name]] = np.concatenate([lfilter([1 - keep], [1, -keep], r) for r in runs])
    return shown


@pytest.mark.parametrize("time_constant", [0.2, pytest.param(0.1, marks=pytest.mark.nightly)])
def test_a_filter_of_the_odometry_is_undone(driven, base, time_constant):
    power = driven.power.reshape(-1, MANY // 2).mean(axis=1)
    means = late(driven.fine, time_constant).reshape(len(power), MANY // 2, -1).mean(axis=1)
    source = open_source(log_of(means, power, 0.5 * COARSE))
    chosen = best_reading(source, base)
    assert chosen.reading.lag == time_constant
    assert any(finding.kind == "late motion" for finding in chosen.sample.report)
    _, found = metered_base_fit(chosen.sample, base)
    _, usual = metered_base_fit(source.steady().sample, base)
    assert found.rmse_w < 0.92 * usual.rmse_w


def test_a_comparison_reads_the_motion_so_too(driven, base, robot):
    """With the robot's own model little but the noise is left, in each row of the log."""
    _, means, _, power = driven
    log = log_of(means, power[:, -1])
    found = compare(log, robot)
    assert found.meter.sampling == "end"
    assert found.rmse_w < 0.07 * float(np.mean(np.abs(log.power)))


def test_a_model_without_a_finite_power_is_left_to_others(driven, base):
    _, means, _, power = driven
    values = base.parameters.copy()
    values[:] = np.nan
    broken = replace(base, parameters=values)
    source = open_source(log_of(means, power[:, -1]))
    assert followed_motions(source, broken, settled=True) == []


def test_a_power_that_is_the_mean_of_its_row_needs_no_meter():
    log = replace(plain_log([9]), meter=Meter(delay_s=0.25), ahead=True)
    assert log.meter_as_logged is None
    assert replace(log, ahead=False).meter_as_logged == log.meter


@pytest.mark.parametrize(
    ("meter", "sampling", "delay"),
    [
        (Meter(), "end", 0.0),
        (Meter(delay_s=0.5), "mean", 0.0),
        (Meter(delay_s=1.0), "mean", 0.5),
        (Meter(sampling="end", delay_s=0.5), "end", 0.0),
        (Meter(sampling="held", delay_s=0.7), "held", 0.2),
    ],
)
def test_a_meter_is_read_by_the_stamps_of_the_rows(meter, sampling, delay):
    later = meter.half_a_row_later(1.0)
    assert later.sampling == sampling
    assert later.delay_s == pytest.approx(delay)
    assert later.plain == (meter == Meter(delay_s=0.5))
