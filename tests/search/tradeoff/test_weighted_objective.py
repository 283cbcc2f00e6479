"""A price of time in the search: what stops and metres cost with it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.requests import SituationRequest
from planner.search.situation import Situation, situation_of
from planner.search.tradeoff.weighted_objective import PricedSituation
from planner.search.turns import turning
from planner.terrain.heightmap import Terrain


@pytest.fixture(scope="module")
def plain() -> Situation:
    """20 m by 20 m of level ground, without a price."""
    level = Terrain.from_arrays(np.zeros((40, 40)), cell=(0.5, 0.5))
    return situation_of(SituationRequest(map="level"), terrain=level)


def test_a_stop_costs_its_seconds_where_seconds_are_priced(plain):
    """Both ramps take v/a longer than going on; prices of the plain model are not taken for it."""
    unpriced = turning(plain.conditions, 0)
    priced = turning(PricedSituation.of(plain, 50.0).conditions, 0)
    seconds = turning(plain.conditions, 1).stop
    limits = plain.conditions.limits
    assert seconds == limits[0] / plain.conditions.model.vehicle.limits.acceleration
    assert priced.stop == pytest.approx(unpriced.stop + 50.0 * seconds)
    assert turning(plain.conditions, 0) is unpriced


def test_energy_and_time_together_cost_no_less_than_the_least_of_each(plain):
    priced = PricedSituation.of(plain, 50.0).costs("energy").best[0, 0, 0]
    energy, seconds = (plain.costs(objective).best[0, 0, 0] for objective in ("energy", "time"))
    assert priced >= energy + 50.0 * seconds * (1.0 - 1e-6)
    assert seconds > 0.0
