"""The meter of a log: found where there is one, with its errors, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.telemetry.estimation import with_meter
from planner.telemetry.logs import Meter
from planner.telemetry.parameters import free_places
from planner.telemetry.prediction import predict


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
