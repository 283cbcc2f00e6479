"""A filter of an inertial sensor may make pitch and roll late, or let accelerations into them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from planner.power.rows import gravity_columns
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.holdout import metered_base_fit, overall_error
from planner.telemetry.sampling import open_source
from planner.telemetry.tilt_filter import with_true_tilt
from tests.telemetry.estimation.test_moment_of_motion import RUNS, accelerate
from tests.telemetry.rows import measured, plain_log

ROW = 0.1
"""s of the rows."""
RUN = 300
ATTITUDE = [INDEX[name] for name in ("gravity_x", "gravity_y", "gravity_normal")]


@pytest.fixture(scope="module")
def hilly(robot):
    """A log over ground that rises and falls within seconds; its power has 2 % of noise."""
    random = np.random.default_rng(8)
    log = plain_log([RUN] * RUNS)
    time = ROW * np.arange(1.0, RUN + 1.0)
    rows = log.rows.copy()

    def wave(size: float, slowest: float) -> np.ndarray:
        periods = slowest * random.uniform(0.4, 1.0, (RUNS, 4))
        phases = random.uniform(0.0, 6.3, (RUNS, 4))
        waves = np.sin(2.0 * np.pi * time[:, None, None] / periods + phases).mean(axis=2)
        return size * waves.T.ravel()

    for name, size, slowest in (("vx", 0.8, 20.0), ("vy", 0.5, 20.0), ("wz", 0.5, 15.0)):
        rows[:, INDEX[name]] = wave(size, slowest)
    pitch, roll = wave(0.25, 4.0), wave(0.25, 4.0)
    for name, values in gravity_columns(roll, pitch, gravity=STANDARD_GRAVITY).items():
        rows[:, INDEX[name]] = values
    accelerate(rows, ROW)
    log = replace(
        log,
        rows=rows,
        time=np.tile(time, RUNS),
        interval=np.full(len(rows), ROW),
        present=log.present | {"pitch", "roll"},
    )
    return measured(log, robot, 0.02, seed=5)


def late(log, time_constant: float):
    """The log with pitch and roll behind a first-order filter."""
    keep, rows = np.exp(-ROW / time_constant), log.rows.copy()
    for start, stop in log.run_pieces():
        begin = keep * rows[start : start + 1, ATTITUDE]
        rows[start:stop, ATTITUDE], _ = lfilter(
            [1.0 - keep], [1.0, -keep], rows[start:stop, ATTITUDE], axis=0, zi=begin
        )
    return replace(log, rows=rows)


def bent(log, time_constant: float):
    """The log with angles that follow an accelerometer, as a complementary filter's do."""
    keep, rows = np.exp(-ROW / time_constant), log.rows.copy()
    for start, stop in log.run_pieces():
        for gravity, rate in (("gravity_x", "ax"), ("gravity_y", "ay")):
            felt = lfilter([1.0 - keep], [1.0, -keep], rows[start:stop, INDEX[rate]])
            rows[start:stop, INDEX[gravity]] -= felt
    return replace(log, rows=rows)


def test_late_angles_are_shown_earlier_and_prompt_ones_stay(hilly, base):
    found = with_true_tilt(open_source(late(hilly, 0.15)), base)
    assert 0.1 <= found.tilt_lag <= 0.2
    assert any(finding.kind == "late tilt" for finding in found.sample.report)
    prompt = open_source(hilly)
    assert with_true_tilt(prompt, base) is prompt


@pytest.mark.parametrize("time_constant", [0.5, pytest.param(2.0, marks=pytest.mark.nightly)])
def test_accelerations_are_taken_out_of_the_angles(hilly, base, time_constant):
    wrong = open_source(bent(hilly, time_constant))
    found = with_true_tilt(wrong, base)
    assert 0.6 <= found.tilt_filter / time_constant <= 1.6
    assert any(finding.kind == "bent tilt" for finding in found.sample.report)
    error, noise = (
        overall_error(*metered_base_fit(source.steady().sample, base))
        for source in (found, open_source(hilly))
    )
    assert error < 1.1 * noise


@pytest.mark.parametrize("filtered", [late, pytest.param(bent, marks=pytest.mark.nightly)])
def test_every_chunk_is_read_as_the_sample(hilly, base, filtered):
    source = with_true_tilt(open_source(filtered(hilly, 0.5)), base)
    assert source.tilt_lag or source.tilt_filter
    streamed = replace(source, complete=False)
    rows = np.concatenate([chunk.rows for chunk in streamed.chunks()])
    assert np.allclose(rows, source.sample.rows, equal_nan=True)
    assert source.content != open_source(filtered(hilly, 0.5)).content
