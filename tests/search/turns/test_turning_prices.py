"""Prices of turning and stopping: nothing for going straight, the ramps' time for a stop."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.requests import SituationRequest
from planner.search.resolution import OBJECTIVES, STATES
from planner.search.situation import situation_of
from planner.search.turns.turning_prices import turning
from tests.search.maps import terrain


@pytest.fixture(scope="module")
def conditions():
    ground = terrain(np.zeros((20, 20)))
    return situation_of(SituationRequest(map=ground.name), terrain=ground).conditions


@pytest.mark.parametrize("objective", ["energy", "time"])
def test_turning_costs_and_going_straight_does_not(conditions, objective) -> None:
    table = turning(conditions, OBJECTIVES[objective]).table
    assert table.shape[0] == STATES
    assert not table[:, 0].any()
    assert (table >= 0.0).all()
    assert (table[:, -1] > 0.0).all()


def test_a_stop_takes_the_time_of_both_ramps(conditions) -> None:
    """Speeding up and slowing down evenly lose v/2a each against full speed."""
    limits = conditions.model.vehicle.limits
    prices = turning(conditions, OBJECTIVES["time"])
    assert prices.stop == pytest.approx(limits.speed / limits.acceleration)


def test_a_stop_costs_no_less_than_the_gear_keeps_of_the_motion(conditions) -> None:
    """Part of the kinetic energy, of which braking does not return all, and not many times it."""
    kinetic = 0.5 * conditions.mass * conditions.model.vehicle.limits.speed**2
    assert 0.05 * kinetic < turning(conditions, OBJECTIVES["energy"]).stop < 3.0 * kinetic
