"""Thresholds are round, and lie where few rows are."""

import numpy as np
import pytest

from planner.telemetry.regimes.conditions import conditions_on
from planner.telemetry.regimes.thresholds import best_bounds, thresholds


def test_thresholds_do_not_cut_a_cluster_of_equal_speeds():
    chance = np.random.default_rng(5)
    speed = np.repeat(chance.choice([0.1, 0.2, 0.3, 0.4], 240), 10)
    speed = speed + chance.normal(0.0, 0.002, len(speed))
    axis = conditions_on("speed", speed)
    for condition in axis.sets:
        for bound in (condition.low, condition.high):
            assert bound is None or np.abs(bound - np.array([0.1, 0.2, 0.3, 0.4])).min() > 0.01


def test_thresholds_cut_into_about_equally_full_bins():
    values = np.random.default_rng(1).uniform(0.0, 1.0, 4000)
    found = thresholds(values, 10, least=0.02)
    assert (np.diff(found) > 0.0).all()
    shares = np.diff(np.concatenate([[0.0], np.searchsorted(np.sort(values), found) / 4000, [1.0]]))
    assert len(shares) == 10
    assert 0.5 / 10 < shares.min() <= shares.max() < 2.0 / 10
    # Round: two digits say all of it.
    assert found == pytest.approx(found.round(2), abs=1e-12)


def test_values_that_a_sensor_cannot_tell_apart_have_no_threshold():
    values = 0.5 + np.random.default_rng(2).uniform(0.0, 0.01, 400)
    assert len(thresholds(values, 10, least=0.02)) == 0
    assert len(thresholds(values, 10, least=0.001)) > 0


def test_bounds_move_to_where_the_residual_steps():
    values = np.random.default_rng(3).uniform(0.0, 1.0, 4000)
    residual = 2.0 * ((values >= 0.4) & (values < 0.7))
    low, high = best_bounds(values, residual, 0.45, 0.65, 0.02)
    assert (low, high) == pytest.approx((0.4, 0.7), abs=0.026)
    low, high = best_bounds(values, 2.0 * (values >= 0.4), 0.45, None, 0.02)
    assert low == pytest.approx(0.4, abs=0.026)
    assert high is None
