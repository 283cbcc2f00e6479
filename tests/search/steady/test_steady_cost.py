"""Looking up steady costs: the table at its nodes, even between them, infinite beyond limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.resolution import DIRECTIONS, STEEPNESSES, YAWS
from planner.search.steady import cost_for_best_yaw, costs_for_yaws, polar, steady_costs
from tests.search.certificate.robots import around_of, model_of


@pytest.fixture(scope="module")
def costs():
    conditions = around_of(model_of("minibalance"))
    return steady_costs(conditions.model, conditions.class_rows)


def test_a_look_up_at_a_node_is_the_table_there(costs) -> None:
    for f in range(0, DIRECTIONS, 5):
        azimuth = 2.0 * math.pi * f / DIRECTIONS
        for s in range(STEEPNESSES):
            steepness = costs.limit[0, f] * s / (STEEPNESSES - 1) * (1.0 - 1e-12)
            found = cost_for_best_yaw(costs.best, costs.limit, 0, azimuth, steepness, 1.0)
            # A direction off its node by rounding is also held to its neighbour's limit.
            if s < STEEPNESSES - 1:
                assert found == pytest.approx(costs.best[0, f, s], rel=1e-6)


def test_directions_go_round(costs) -> None:
    for azimuth in np.linspace(-3.0, 3.0, 31):
        here, on = (
            cost_for_best_yaw(costs.best, costs.limit, 0, azimuth + turn, 0.05, 1.0)
            for turn in (0.0, 2.0 * math.pi)
        )
        assert here == pytest.approx(on, rel=1e-9)


def test_beyond_the_limit_nothing_is_driven(costs) -> None:
    for azimuth in np.linspace(0.0, 6.0, 13):
        steep = 1.01 * costs.limit.max()
        assert math.isinf(cost_for_best_yaw(costs.best, costs.limit, 0, azimuth, steep, 1.0))
        assert math.isfinite(cost_for_best_yaw(costs.best, costs.limit, 0, azimuth, 0.0, 1.0))


def test_all_yaws_at_once_cost_what_each_does(costs) -> None:
    found = np.empty(YAWS)
    random = np.random.default_rng(7)
    limits = 0
    for azimuth, share in random.uniform((-7.0, 0.0), (7.0, 1.1), (100, 2)):
        steep = share * costs.limit.max()
        costs_for_yaws(costs.by_yaw, costs.yaw_limit, 0, azimuth, steep, 0.95, found)
        single = [
            polar(costs.by_yaw[0, turn], costs.yaw_limit[0, turn], azimuth, steep, 0.95)
            for turn in range(YAWS)
        ]
        np.testing.assert_allclose(found, single, rtol=1e-12)
        limits += np.isinf(found).sum()
    assert 0 < limits < 100 * YAWS
