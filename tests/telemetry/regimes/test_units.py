"""Independent pieces of a log: blocks are as long as the residual is correlated."""

from __future__ import annotations

import numpy as np
import pytest

from planner.telemetry.regimes.units import (
    CLUSTER_CORRELATION_TIMES,
    LEAST_REGIME_ROWS,
    MOST_REGIME_CLUSTERS,
    cluster_length,
    correlation_time,
    units_of,
)


def autoregressive(rows: int, rho: float, seed: int) -> np.ndarray:
    chance = np.random.default_rng(seed)
    noise = chance.normal(size=rows)
    for k in range(1, rows):
        noise[k] = rho * noise[k - 1] + np.sqrt(1.0 - rho * rho) * noise[k]
    return noise


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8])
def test_correlation_time_of_a_first_order_process(rho: float) -> None:
    # 1 + 2·Σ ρ^k = (1 + ρ)/(1 - ρ), in rows.
    found = correlation_time(autoregressive(40_000, rho, seed=3), np.zeros(40_000, int))
    assert found == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.15)


def test_rows_of_different_runs_are_not_taken_for_neighbours() -> None:
    # Every run is off as a whole, with the sign of the one before turned.
    run = np.repeat(np.arange(400), 2)
    residual = np.where(run % 2, 1.0, -1.0)
    # Within runs of two rows the neighbours agree; across them they would not.
    assert correlation_time(residual, run) == pytest.approx(3.0)


def test_blocks_are_several_correlation_times_long_and_not_too_short() -> None:
    number = np.zeros(40_000, int)
    white, slow = (autoregressive(40_000, rho, seed=4) for rho in (0.0, 0.8))
    assert cluster_length(white, number) == LEAST_REGIME_ROWS
    assert cluster_length(slow, number) == pytest.approx(CLUSTER_CORRELATION_TIMES * 9.0, rel=0.15)
    assert correlation_time(np.zeros(50), np.zeros(50, int)) == 1.0


@pytest.mark.parametrize("lengths", [(1000,), (300, 50, 650), (40,) * 12, (12,) * 300])
def test_clusters_are_consecutive_rows_within_runs(lengths: tuple[int, ...]) -> None:
    run = np.repeat(np.arange(len(lengths)), lengths)
    units = units_of(run, autoregressive(len(run), 0.5, seed=5))
    assert set(np.diff(units.cluster)) <= {0, 1}
    assert units.cluster[0] == 0
    assert units.cluster[-1] == units.clusters - 1
    assert units.clusters <= max(MOST_REGIME_CLUSTERS, units.runs) + len(lengths)
    # Every cluster stands in one run, which ``of`` names.
    np.testing.assert_array_equal(units.of[units.cluster], units.run)
    # A run is whole: it is not divided between groups.
    assert len(set(zip(run.tolist(), units.run.tolist(), strict=True))) == len(lengths)
    assert units.runs == len(set(units.run.tolist())) <= len(lengths)


def test_many_short_runs_are_put_together() -> None:
    run = np.repeat(np.arange(300), 12)
    units = units_of(run, np.random.default_rng(6).normal(size=len(run)))
    assert units.runs == units.clusters == MOST_REGIME_CLUSTERS
