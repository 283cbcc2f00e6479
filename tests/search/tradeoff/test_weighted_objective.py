"""A price of time in the search: what stops and metres cost with it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.requests import PlanRequest, SituationRequest
from planner.search.run import Run
from planner.search.situation import Situation, situation_of
from planner.search.tradeoff import weighted_objective
from planner.search.tradeoff.weighted_objective import PricedSearch, PricedSituation
from planner.search.turns import turning
from planner.terrain.heightmap import Terrain
from tests.search.grid.test_least_cost import hills
from tests.search.test_front import WAY


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
    priced = PricedSituation.of(plain, 64.0).costs("energy").best[0, 0, 0]
    energy, seconds = (plain.costs(objective).best[0, 0, 0] for objective in ("energy", "time"))
    assert priced >= energy + 64.0 * seconds * (1.0 - 1e-6)
    assert seconds > 0.0


def test_weights_close_together_share_what_is_tabulated(plain):
    one, same, other = (PricedSituation.of(plain, watts) for watts in (60.0, 70.0, 120.0))
    assert same.costs("energy") is one.costs("energy")
    assert other.costs("energy").best[0, 0, 0] > one.costs("energy").best[0, 0, 0]
    field = one.field("energy")
    assert same.lattice("energy", field) is one.lattice("energy", field)
    # A motion is priced with the weight itself.
    assert turning(same.conditions, 0).stop > turning(one.conditions, 0).stop


def test_a_weight_between_two_steps_finds_as_good_a_route(monkeypatch):
    relief = Terrain.from_arrays(2.0 * hills(), cell=(0.5, 0.5))
    request = PlanRequest.from_json({"map": "here", **WAY})
    situation = situation_of(request, terrain=relief)
    search = PricedSearch(Run(request, situation, silent, CancellationToken()))
    for watts in (11.4, 45.0):
        stepped = search.at(watts).cost(watts)
        with monkeypatch.context() as patched:
            patched.setattr(weighted_objective, "WEIGHT_STEP", 1.0001)
            assert stepped <= 1.002 * search.at(watts).cost(watts)
