"""Whitening against the covariance that it is for, and what is estimated against what was drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag, toeplitz

from planner.telemetry.noise import Noise, noise_of, strongest_columns
from tests.telemetry.rows import autoregressive, plain_log

PHI = 0.7
RUNS = {"long": [40, 25], "threes": [3] * 8, "singles": [1] * 12, "mixed": [1, 3, 20, 2, 1, 14]}


def first_order(spread: float = 1.0, by_run: tuple[float, float] = (0.0, 0.0)) -> Noise:
    """Noise with neighbouring rows correlated by PHI."""
    return Noise(
        np.array([0.0]),
        np.array([spread]),
        np.array([[0.0], [PHI]]),
        np.array([1.0, np.sqrt(1.0 - PHI**2)]),
        np.diag(by_run),
        spread,
    )


def correlation(lengths) -> np.ndarray:
    """Correlation of all rows; runs are independent."""
    return block_diag(*(toeplitz(PHI ** np.arange(length)) for length in lengths))


@pytest.mark.parametrize("lengths", RUNS.values(), ids=RUNS)
def test_whitened_rows_are_unit_and_uncorrelated(lengths):
    log = plain_log(lengths)
    spread = np.linspace(0.5, 3.0, len(log))
    covariance = correlation(lengths) * np.outer(spread, spread)
    matrix = first_order().whiten(log, np.zeros(len(log)), spread, np.eye(len(log)))
    assert matrix @ covariance @ matrix.T == pytest.approx(np.eye(len(log)), abs=1e-10)


@pytest.mark.parametrize("lengths", RUNS.values(), ids=RUNS)
def test_offsets_and_gains_of_runs_are_whitened_too(lengths):
    log = plain_log(lengths)
    watts = 30.0 + 10.0 * np.sin(np.arange(len(log)))
    spread = 0.5 + 0.01 * watts
    offset, gain = 0.8, 0.03
    same_run = log.run[:, None] == log.run
    covariance = correlation(lengths) * np.outer(spread, spread)
    covariance += same_run * (offset**2 + gain**2 * np.outer(watts, watts))
    noise = first_order(by_run=(offset**2, gain**2))
    matrix = noise.whiten(log, watts, spread, np.eye(len(log)))
    assert matrix @ covariance @ matrix.T == pytest.approx(np.eye(len(log)), abs=1e-9)


@pytest.mark.parametrize("even_w", [0.0, 0.4])
def test_rows_that_weigh_the_same_are_only_scaled(even_w):
    log = plain_log(RUNS["mixed"])
    spread = np.linspace(0.5, 3.0, len(log))
    noise = replace(first_order(), even_w=even_w)
    used, counts = noise.for_fits(), noise.spread_for_fits(spread)
    matrix = used.whiten(log, np.zeros(len(log)), counts, np.eye(len(log)))
    assert np.array_equal(matrix, np.diag(np.diag(matrix))) is bool(even_w)
    if even_w:
        assert np.diag(matrix) == pytest.approx(1.0 / even_w)


def test_rows_that_correlate_tell_a_fit_of_evenly_weighted_rows_less():
    """A mean of n rows of a first-order autoregression is as sure as n (1 - φ) / (1 + φ) rows."""
    noise = first_order()
    assert noise.redundancy == 1.0  # whitening sees to it
    evenly = replace(noise, even_w=0.4)
    assert evenly.redundancy == pytest.approx((1.0 + PHI) / (1.0 - PHI))


def drawn(lengths, seed: int):
    """A log, its modelled power, and AR(1) noise of 2 % of it."""
    random = np.random.default_rng(seed)
    log = plain_log(lengths)
    watts = random.uniform(10.0, 60.0, len(log))
    error = np.concatenate([autoregressive(n, PHI, random) for n in lengths])
    return log, watts, 0.02 * watts * error


def test_estimated_noise_is_the_one_that_was_drawn():
    log, watts, error = drawn([150] * 20, 3)
    slope = np.linspace(-1.0, 1.0, len(log))[:, None]
    found, _ = noise_of(log, error + 5.0 * slope[:, 0], watts, np.zeros(len(log)), slope)
    assert found.correlation == pytest.approx(PHI, abs=0.05)
    for power in (15.0, 35.0, 55.0):
        spread = found.spread(np.array([power]), np.zeros(1))
        assert spread[0] == pytest.approx(0.02 * power, rel=0.15)
    assert found.floor_w == pytest.approx(np.sqrt(np.mean((0.02 * watts) ** 2)), rel=0.1)
    white = found.whiten(log, watts, found.spread(watts, np.zeros(len(log))), error[:, None])[:, 0]
    assert white.std() == pytest.approx(1.0, abs=0.08)
    inside = log.run[1:] == log.run[:-1]
    assert np.corrcoef(white[1:][inside], white[:-1][inside])[0, 1] == pytest.approx(0.0, abs=0.05)


def test_short_runs_beside_long_ones_are_whitened_from_their_first_row():
    log, watts, error = drawn([200] * 8 + [3] * 150 + [1] * 150, 4)
    found, _ = noise_of(log, error, watts, np.zeros(len(log)), np.ones((len(log), 1)))
    white = found.whiten(log, watts, found.spread(watts, np.zeros(len(log))), error[:, None])[:, 0]
    threes, singles = white[1600:2050].reshape(150, 3), white[2050:]
    assert threes.std(axis=0) == pytest.approx(np.ones(3), abs=0.2)
    assert singles.std() == pytest.approx(1.0, abs=0.2)
    assert np.corrcoef(threes.T)[np.triu_indices(3, 1)] == pytest.approx(np.zeros(3), abs=0.25)


def smooth(lengths, random) -> np.ndarray:
    """Slow noise behind a filter of 8 rows, drawn anew for each stretch."""
    weights = np.exp(-np.arange(30) / 8.0)
    slow = (autoregressive(n + 29, 0.99, random) for n in lengths)
    return np.concatenate([np.convolve(one, weights, "valid") for one in slow])


def test_smooth_noise_of_short_stretches_is_never_blown_up():
    """From so few rows the size of what is left is unsure, but by a factor and not by powers."""
    lengths = [50] * 10
    log = plain_log(lengths)
    watts, sure = np.full(len(log), 30.0), np.zeros(len(log))
    for seed in range(60):
        random = np.random.default_rng(seed)
        found, _ = noise_of(log, smooth(lengths, random), watts, sure, np.ones((len(log), 1)))
        anew, spread = smooth(lengths, random), found.spread(watts, sure)
        left = replace(found, by_run=np.zeros((2, 2))).whiten(log, watts, spread, anew[:, None])
        assert left.std() < 10.0


def test_doubtful_inputs_widen_the_spread_of_their_rows_alone():
    noise = first_order(spread=3.0)
    input_error = np.array([0.0, 4.0])
    assert noise.spread(np.array([1.0, 1.0]), input_error) == pytest.approx([3.0, 5.0])


def test_outliers_are_no_noise():
    log, watts, error = drawn([150] * 20, 6)
    clean, _ = noise_of(log, error, watts, np.zeros(len(log)), np.ones((len(log), 1)))
    hit = np.random.default_rng(7).random(len(log)) < 0.015
    dirty, _ = noise_of(log, error + 30.0 * hit, watts, np.zeros(len(log)), np.ones((len(log), 1)))
    assert dirty.floor_w == pytest.approx(clean.floor_w, rel=0.15)


def test_rows_whose_inputs_are_unsure_are_part_of_the_floor():
    """A tenth of the rows, in no order of the power, scatters four times as much."""
    log, watts, error = drawn([150] * 20, 6)
    wild = np.where(np.random.default_rng(8).random(len(log)) < 0.1, 4.0, 1.0)
    noise, _ = noise_of(log, wild * error, watts, np.zeros(len(log)), np.ones((len(log), 1)))
    rms = float(np.sqrt(np.mean((wild * error) ** 2)))
    assert noise.floor_w == pytest.approx(rms, rel=0.05)


def test_variance_of_run_offsets_is_recovered():
    lengths = [80] * 60
    random = np.random.default_rng(11)
    log = plain_log(lengths)
    watts = random.uniform(10.0, 60.0, len(log))
    offsets = 0.5 * random.standard_normal(len(lengths))
    error = random.standard_normal(len(log)) + offsets[log.run]
    found, _ = noise_of(log, error, watts, np.zeros(len(log)), np.zeros((len(log), 0)))
    # What the whole of the noise says about a mean over a run: this is what an offset does to it.
    spread = found.spread(watts, np.zeros(len(log)))
    run = log.take(log.run == 0)
    matrix = found.whiten(run, watts[:80], spread[:80], np.eye(80))
    covariance = np.linalg.inv(matrix.T @ matrix)
    of_mean = float(np.ones(80) @ covariance @ np.ones(80)) / 80.0**2
    assert of_mean == pytest.approx(np.var(offsets) + 1.0 / 80.0, rel=0.3)


def test_runs_without_offsets_get_none():
    log, watts, _ = drawn([80] * 30, 12)
    error = np.random.default_rng(13).standard_normal(len(log))
    found, _ = noise_of(log, error, watts, np.zeros(len(log)), np.zeros((len(log), 0)))
    assert np.sqrt(found.by_run[0, 0]) < 0.1
    assert 40.0 * np.sqrt(found.by_run[1, 1]) < 0.15


def test_nothing_beside_a_model_explains_nothing():
    residual = np.random.default_rng(5).standard_normal(40)
    assert strongest_columns(residual, np.ones((40, 1)), np.empty((40, 0))) == []
