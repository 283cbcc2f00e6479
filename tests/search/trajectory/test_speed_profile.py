"""The programme for speed works out only what changed since the round before."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.resolution import LEVELS
from planner.search.trajectory.speed_estimate import REACH
from planner.search.trajectory.speed_profile import relax


@pytest.mark.parametrize("seed", range(4))
def test_a_round_of_speeds_leaves_out_only_what_does_not_change(seed: int) -> None:
    random = np.random.default_rng(seed)
    steps = 120
    expected = random.uniform(1.0, 2.0, (steps, LEVELS, 2 * REACH + 1))
    expected[random.random(expected.shape) < 0.3] = np.inf
    exact = random.random(expected.shape) < 0.5
    cost, came = np.zeros((steps + 1, LEVELS)), np.zeros((steps + 1, LEVELS), np.int64)
    cost[0, 1:] = np.inf
    relax(expected, exact, False, np.ones(steps, bool), cost, came)
    fresh = np.zeros(steps, bool)
    fresh[[17, 60, 61]] = True
    expected[fresh] += random.uniform(0.0, 0.5, expected[fresh].shape)
    whole, origins = cost.copy(), came.copy()
    relax(expected, exact, False, np.ones(steps, bool), whole, origins)
    assert not np.array_equal(came, origins), "nothing is tested"
    relax(expected, exact, False, fresh, cost, came)
    np.testing.assert_allclose(cost, whole, atol=1e-8)
    np.testing.assert_array_equal(came, origins)
