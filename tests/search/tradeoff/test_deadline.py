"""The least energy that arrives in time, against the front and against no limit."""

from __future__ import annotations

import numpy as np
import pytest

from planner import energy_time_front, plan_route
from planner.cancellation import CancellationToken
from planner.errors import RequestError
from planner.progress import silent
from planner.search.requests import PlanRequest
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.tradeoff import PricedSearch
from planner.terrain.heightmap import Terrain
from tests.search.grid.test_least_cost import hills
from tests.search.test_front import WAY


@pytest.fixture(scope="module")
def relief() -> Terrain:
    """Hills of 20 m by 20 m, steep enough that the frugal way is not the quick one."""
    return Terrain.from_arrays(2.0 * hills(), cell=(0.5, 0.5))


def test_a_limit_costs_no_more_than_the_front_says(relief):
    front = energy_time_front(terrain=relief, **WAY, points=4)
    first, last = front.points[0].route, front.points[-1].route
    before = last.energy_j
    for share in (0.7, 0.3):
        most = first.duration_s + share * (last.duration_s - first.duration_s)
        answer = plan_route(terrain=relief, **WAY, max_duration_s=most)
        route = answer.routes[0]
        assert route.duration_s <= most
        # Corners of the front are only some of the routes.
        assert route.energy_j <= 1.003 * front.within(most).route.energy_j
        assert route.energy_j >= 0.997 * before
        assert answer.baselines["fastest"].duration_s <= route.duration_s
        before = route.energy_j


def test_a_limit_that_is_kept_anyway_changes_nothing(relief):
    free = plan_route(terrain=relief, **WAY)
    limited = plan_route(terrain=relief, **WAY, max_duration_s=2.0 * free.routes[0].duration_s)
    assert limited.to_json() == free.to_json()


def test_a_limit_that_cannot_be_kept_is_no_route(relief):
    answer = plan_route(terrain=relief, **WAY, max_duration_s=2.0)
    assert answer.status == "no_route"
    assert "2.0 s are allowed" in answer.reason


def test_a_region_is_entered_in_time(relief):
    goal = {"any": [WAY["goal"], {"x": 6.0, "y": 6.0}]}
    answer = plan_route(terrain=relief, start=WAY["start"], goal=goal, max_duration_s=8.0)
    assert answer.goal["number"] == 1


@pytest.mark.parametrize(
    "wrong", [{"max_duration_s": 0.0}, {"max_duration_s": 9, "objective": "time"}]
)
def test_what_is_no_limit_is_refused(relief, wrong):
    with pytest.raises(RequestError, match="max_duration_s"):
        plan_route(terrain=relief, **WAY, **wrong)


@pytest.fixture
def weights(monkeypatch) -> list[float]:
    """Time weights at which known paths are driven, in their order."""
    tried: list[float] = []
    along = PricedSearch.along

    def counted(self, known, watts):
        tried.append(watts)
        return along(self, known, watts)

    monkeypatch.setattr(PricedSearch, "along", counted)
    return tried


def test_few_weights_find_what_many_find(relief, weights):
    free = plan_route(terrain=relief, **WAY).routes[0]
    quick = plan_route(terrain=relief, **WAY, objective="time").routes[0]
    most = 0.5 * (free.duration_s + quick.duration_s)
    route = plan_route(terrain=relief, **WAY, max_duration_s=most).routes[0]
    assert len(weights) <= 10
    power = free.energy_j / free.duration_s
    request = PlanRequest.from_json({"map": "here", **WAY})
    situation = situation_of(request, terrain=relief)
    search = PricedSearch(Run(request, situation, silent, CancellationToken()))
    scanned = [
        search.along(path, float(watts)).route
        for path in (search.at(0.0), search.at(power))
        for watts in power * np.geomspace(0.03, 10.0, 20)
    ]
    timely = min(one.energy_j for one in scanned if one.duration_s <= most)
    assert route.duration_s <= most
    assert route.energy_j <= 1.001 * timely
