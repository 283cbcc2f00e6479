"""What an answer leaves: its error over the floor, and the regimes that hold it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.telemetry.diagnosis.unexplained import (
    LASTING,
    MOST_OVER_FLOOR,
    Unexplained,
    floor_of,
    unexplained_by,
    without_slow,
)
from planner.telemetry.evidence import DesignColumns, examine
from planner.telemetry.holdout import rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import CLIP
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.prediction import predict
from planner.telemetry.terms import candidate_library
from tests.telemetry.rows import autoregressive, measured

SPREAD = 0.3
ON = 10.0
"""s"""


@pytest.fixture(scope="module")
def watts(motion, base):
    """Power of the model over the drive, W."""
    return predict(base, motion)


def scatter(count: int, seed: int = 1) -> np.ndarray:
    """Noise of a known spread, W."""
    return SPREAD * np.random.default_rng(seed).standard_normal(count)


def test_noise_alone_is_little(motion, watts):
    count = len(motion)
    left = unexplained_by(motion, scatter(count), np.full(count, SPREAD), watts)
    assert left.heldout_over_floor == pytest.approx(1.0, abs=0.03)
    assert left.where == ()
    assert left.little
    assert not left.near


def test_a_bias_where_power_flows_back_is_found(motion, watts):
    watts = watts - np.quantile(watts, 0.08)
    back = watts < 0.0
    residual = scatter(len(motion)) + np.where(back, 1.0, 0.0)
    left = unexplained_by(motion, residual, np.full(len(motion), SPREAD), watts)
    assert any("negative power" in regime.where for regime in left.where), left.where
    assert not left.little


def test_a_floor_does_not_hold_what_a_regime_shows(motion, watts):
    """A floor estimated beside the misfit is as large as the error; the noise is smaller."""
    watts = watts - np.quantile(watts, 0.08)
    residual = scatter(len(motion)) + np.where(watts < 0.0, 5.0 * SPREAD, 0.0)
    left = unexplained_by(motion, residual, np.full(len(motion), rms(residual)), watts)
    assert left.heldout_over_floor == pytest.approx(rms(residual) / SPREAD, rel=0.15)
    assert left.heldout_over_floor > 1.5


def switched(log: Telemetry, seed: int) -> np.ndarray:
    """(n,) of -1 and 1: a load that is on and off for ON s in turn, whatever the robot does."""
    first = np.random.default_rng(seed).uniform(0.0, 2.0 * ON, int(log.run.max()) + 1)
    return np.where((log.time + first[log.run]) % (2.0 * ON) < ON, 1.0, -1.0)


def test_a_load_that_no_column_tells_is_no_noise(motion, watts):
    """The floor was estimated beside it, and is as large as the error."""
    half = 6.0 * SPREAD
    residual = scatter(len(motion)) + half * switched(motion, 1)
    left = unexplained_by(motion, residual, np.full(len(motion), rms(residual)), watts)
    # Rows LASTING apart see different states where a switch lies between them.
    assert left.slow_w == pytest.approx(half * np.sqrt(1.0 - 2.0 * LASTING / ON), rel=0.1)
    fast = np.sqrt(rms(residual) ** 2 - left.slow_w**2)
    assert left.heldout_over_floor == pytest.approx(rms(residual) / fast)
    assert not left.little


def test_a_power_that_is_large_now_and_then_is_no_noise(motion, watts):
    """Few stretches hold most of it: its mean square is known badly, not that it lasts."""
    random = np.random.default_rng(6)
    stretch = (motion.time // ON).astype(int) + 1000 * motion.run
    sizes = np.exp(1.5 * random.standard_normal(stretch.max() + 1))
    residual = scatter(len(motion)) + 6.0 * SPREAD * sizes[stretch]
    left = unexplained_by(motion, residual, np.full(len(motion), rms(residual)), watts)
    assert left.slow_w > 0.5 * rms(residual)
    assert not left.little
    # What a claim must take off is counted from what does not last.
    floor = without_slow(np.full(len(motion), rms(residual)), residual, left.slow_w)
    assert rms(floor) < 0.9 * rms(residual)
    assert np.all(without_slow(floor, residual, 0.0) == floor)


@pytest.mark.parametrize("period", [1.0, 2.0])
def test_a_power_that_swings_does_not_last(motion, watts, period):
    """It is the same again 2 s later, and was not in between."""
    swing = np.where(np.floor(2.0 * motion.time / period) % 2.0 < 1.0, 1.0, -1.0)
    residual = scatter(len(motion)) + 10.0 * SPREAD * swing
    left = unexplained_by(motion, residual, np.full(len(motion), rms(residual)), watts)
    assert left.slow_w == 0.0


def test_a_drift_of_the_meter_is_noise(motion, watts):
    row = float(np.median(np.diff(motion.time[:100])))
    drift = autoregressive(len(motion), np.exp(-row / 4.0), np.random.default_rng(4))
    residual = scatter(len(motion)) + 0.02 * float(np.mean(np.abs(watts))) * drift
    left = unexplained_by(motion, residual, np.full(len(motion), rms(residual)), watts)
    assert left.slow_w == 0.0
    assert left.little


def test_a_few_rows_far_out_count_at_the_clip(motion, watts):
    count = len(motion)
    residual = scatter(count)
    rng = np.random.default_rng(2)
    far = rng.choice(count, count // 100, replace=False)
    residual[far] = 50.0 * rng.choice([-1.0, 1.0], len(far))
    left = unexplained_by(motion, residual, np.full(count, SPREAD), watts)
    assert left.heldout_over_floor == pytest.approx(np.sqrt(1.0 + 0.01 * CLIP**2), abs=0.03)
    assert left.little


@pytest.mark.parametrize("ratio", [1.19, 1.21])
def test_a_decision_close_to_its_threshold_is_a_near_one(ratio):
    assert Unexplained(ratio).near
    assert Unexplained(ratio).little is (ratio < MOST_OVER_FLOOR)
    assert not Unexplained(1.0).near


@pytest.mark.parametrize("tails", [False, True])
def test_the_floor_is_the_error_of_a_perfect_model(motion, base, tails):
    """Rows in motion: with tails, a tenth of the rows scatters three times as much."""
    count = len(motion)
    spread = np.full(count, SPREAD)
    if tails:
        spread[np.random.default_rng(3).random(count) < 0.1] *= 3.0
    log = measured(motion, base, 0.0, seed=1, extra=spread * scatter(count) / SPREAD)
    library = candidate_library(base, log)
    found = examine(log, DesignColumns(library, Dictionary.of(log)))
    floor = floor_of(log, found, ())
    assert rms(floor) == pytest.approx(rms(spread), rel=0.2)
