"""The meter of a log: found where there is one, with its errors, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.estimation import with_meter
from planner.telemetry.logs import Meter
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import predict
from tests.telemetry.rows import plain_log


def shown_by(meter: Meter | None, log, robot, *, noise: float, seed: int = 3):
    """The log as this meter writes it; noise in W comes after the filter."""
    # What the meter showed before each run is what it shows of the first row.
    settled = replace(log, power=predict(robot, log), meter=meter)
    watts = predict(robot, settled)
    scatter = noise * np.random.default_rng(seed).standard_normal(len(log))
    return replace(log, power=watts + scatter, meter=None)


@pytest.mark.parametrize(
    ("tau", "sampling"), [(0.5, "mean"), (0.8, "mean"), (0.5, "end"), (0.8, "end")]
)
def test_time_constant_and_moment_are_found(motion, robot, base, tau, sampling):
    log = shown_by(Meter(tau, sampling=sampling), motion, robot, noise=0.2)
    meter = with_meter(log, base, free_places(base, log)).meter
    assert meter is not None
    assert meter.sampling == sampling
    assert meter.delay_s == 0.0
    assert abs(meter.time_constant_s - tau) < max(0.15 * tau, 2.0 * meter.time_constant_error_s)


def test_a_plain_delay_is_no_filter(motion, robot, base):
    log = shown_by(Meter(delay_s=0.6), motion, robot, noise=0.2)
    meter = with_meter(log, base, free_places(base, log)).meter
    assert meter is not None
    assert meter.time_constant_s == 0.0
    assert meter.delay_s == pytest.approx(0.6, abs=max(0.05, 2.0 * meter.delay_error_s))


def driven_at(rate: float, swaying: bool):
    """Six runs of 10 s. Speeds change within 0.3 s and are held for 1.2 s, or they sway."""
    step, count = 1.0 / rate, round(60.0 * rate)
    random, log = np.random.default_rng(17), plain_log([count // 6] * 6)
    time = np.tile(step * np.arange(1.0, count // 6 + 1.0), 6)
    rows, held, ramp = log.rows.copy(), round(1.2 * rate), max(round(0.3 * rate), 1)
    for speed, derivative, most in (
        ("vx", "ax", 0.7),
        ("vy", "ay", 0.4),
        ("wz", "yaw_acceleration", 0.8),
    ):
        values = np.repeat(random.uniform(-most, most, count // held + 1), held)[:count]
        if swaying:
            beats, phases = random.uniform(0.5, 2.5, 3), random.uniform(0.0, 6.0, 3)
            waves = np.sin(np.outer(step * np.arange(count), beats) + phases)
            values = most * waves.mean(axis=1)
        values = np.convolve(values, np.ones(ramp) / ramp, "same")
        rows[:, INDEX[speed]] = values
        of_run = np.split(values, 6)
        rows[:, INDEX[derivative]] = np.concatenate([np.gradient(v, step) for v in of_run])
    return replace(log, rows=rows, time=time, interval=np.full(count, step))


@pytest.mark.parametrize("swaying", [False, True])
@pytest.mark.parametrize(
    ("rate", "tau", "delay"),
    [
        (100, 0.65, 0.12),
        (100, 0.15, 0.22),
        (100, 0.0, 0.24),
        (50, 0.0, 0.19),
        (20, 0.3, 0.26),
        (20, 0.4, 1.8),
        (100, 0.4, 2.6),
        (100, 0.0, 2.53),
        (10, 3.0, 0.0),
        (50, 0.0, -0.2),
    ],
)
def test_a_meter_many_rows_late_or_early_is_found(robot, base, rate, tau, delay, swaying):
    """The search may not end at another peak of the likelihood, of a meter that comes at once."""
    log = shown_by(Meter(tau, delay), driven_at(rate, swaying), robot, noise=0.2)
    meter = with_meter(log, base, free_places(base, log)).meter
    assert meter is not None
    assert meter.time_constant_s == pytest.approx(tau, rel=0.1, abs=0.5 / rate)
    assert meter.delay_s == pytest.approx(delay, abs=1.0 / rate)


def test_rows_that_are_alone_in_their_runs_show_no_meter(robot, base):
    log = plain_log([1] * 200)
    log = replace(log, interval=np.zeros(200), power=np.linspace(5.0, 9.0, 200))
    assert with_meter(log, base, free_places(base, log)).meter is None


def test_a_filter_does_not_foresee_the_power(motion, robot, base):
    """Readings that smooth over later rows as well, as noise of the speeds would have it."""
    row = float(np.median(motion.interval))
    log = shown_by(Meter(2.0 * row, delay_s=-row), motion, robot, noise=0.2)
    meter = with_meter(log, base, free_places(base, log)).meter
    assert meter is not None
    assert meter.time_constant_s > 0.0
    assert meter.delay_s >= (-0.5 * row if meter.sampling == "mean" else 0.0)
    assert meter.delay_error_s < row


def test_a_motion_whose_stamps_are_late_lets_the_power_lead(motion, robot, base):
    log = shown_by(Meter(delay_s=-0.6), motion, robot, noise=0.2)
    meter = with_meter(log, base, free_places(base, log)).meter
    assert meter is not None
    assert meter.time_constant_s == 0.0
    assert "leads the motion by" in meter.sentence


@pytest.mark.parametrize("seed", range(3))
def test_no_meter_is_found_where_there_is_none(motion, robot, base, seed):
    log = shown_by(None, motion, robot, noise=0.3, seed=seed)
    assert with_meter(log, base, free_places(base, log)).meter is None


def test_slow_noise_is_no_meter(motion, robot, base):
    """Noise with an autocorrelation of 0.95 from row to row beside a power that is on time."""
    log = shown_by(None, motion, robot, noise=0.05)
    drive = np.random.default_rng(8).standard_normal(len(log))
    slow = np.empty(len(log))
    slow[0] = drive[0]
    for k in range(1, len(log)):
        slow[k] = 0.95 * slow[k - 1] + 0.31 * drive[k]
    log = replace(log, power=log.power + 0.5 * slow)
    assert with_meter(log, base, free_places(base, log)).meter is None


@pytest.mark.parametrize("tau", [0.0, 0.8])
def test_a_meter_that_holds_its_readings_is_found_behind_noise(motion, robot, base, tau):
    """Noise that comes after the meter makes all rows differ; four rows show one reading."""
    period = 4.0 * float(np.median(motion.interval))
    exact = shown_by(Meter(tau, sampling="end"), motion, robot, noise=0.0)
    first = np.floor(motion.time / period + 1e-6)
    new = (np.diff(first, prepend=-1.0) != 0.0) | (np.diff(motion.run, prepend=-1) != 0)
    shown = exact.power[np.maximum.accumulate(np.where(new, np.arange(len(motion)), 0))]
    scatter = 0.2 * np.random.default_rng(3).standard_normal(len(motion))
    log = replace(motion, power=shown + scatter)
    meter = with_meter(log, base, free_places(base, log)).meter
    assert meter is not None
    assert meter.sampling == "held"
    assert meter.period_s == pytest.approx(period, rel=2e-3)
    assert abs(meter.time_constant_s - tau) <= max(0.15 * tau, 2.0 * meter.time_constant_error_s)
    assert "holds each reading for 2 s" in meter.sentence
