"""One leg learns from its neighbour's way."""

from __future__ import annotations

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.search.legs import LegPlanner, single_leg
from planner.search.legs.single_leg import Leg
from planner.search.results import price
from planner.search.solve import ONE_OF_MANY
from planner.search.solve.pipeline import Attempt
from planner.search.waypoints import waypoint_descent as optimise_waypoints
from planner.terrain.heightmap import Terrain
from tests.search.situations import situation_on

FREE = (None, None)


@pytest.fixture(scope="module")
def level():
    """Level ground of 24 m by 24 m."""
    return situation_on(Terrain.from_arrays(np.zeros((96, 96)), cell=(0.25, 0.25)))


def test_a_leg_learns_from_a_neighbour_and_only_what_is_better(level):
    situation, field = level
    crooked = np.array([[3.0, 3.0], [9.0, 12.0], [20.0, 3.0]])
    legs = LegPlanner(situation, field, CancellationToken())
    assert legs.near(crooked) is not None
    own = optimise_waypoints.drive_roughly(field, situation.conditions, (crooked,), FREE)
    straight = np.array([[3.0, 3.0], [20.0, 3.5]])
    bad = Leg(price(field, situation.conditions, own.motion), crooked)
    better = legs.like_neighbour(bad, straight)
    assert better.route.energy_j < 0.8 * bad.route.energy_j
    for axis, ends in (("x", (3.0, 20.0)), ("y", (3.0, 3.0))):
        assert better.route.arrays[axis][[0, -1]] == pytest.approx(ends, abs=1e-6)
    assert legs.like_neighbour(better, crooked) is better


@pytest.fixture(scope="module")
def walled():
    """Level ground of 8 m by 8 m with a wall, and the path past it."""
    solid = np.zeros((80, 80), bool)
    solid[:55, 38:42] = True
    situation, field = situation_on(
        Terrain.from_arrays(np.zeros(solid.shape), cell=(0.1, 0.1), obstacles=solid)
    )
    return situation, field, situation.path("energy", field, (2.0, 2.0), (6.5, 2.0))


def test_one_leg_of_many_costs_hardly_more_among_obstacles(walled):
    situation, field, path = walled
    careful, quick = (
        LegPlanner(situation, field, CancellationToken(), many=many).near(path).route.energy_j
        for many in (False, True)
    )
    assert careful * (1.0 - 1e-9) <= quick <= 1.02 * careful


def test_one_leg_of_many_is_found_where_only_much_care_finds_it(walled, monkeypatch):
    """Recovery is short for one of many: the leg is then looked for as a single answer is."""
    situation, field, path = walled
    efforts = []
    plain = single_leg.on_grid

    def picky(run, field, objective, *effort):
        efforts.append(effort)
        return Attempt(field) if effort else plain(run, field, objective)

    monkeypatch.setattr(single_leg, "on_grid", picky)
    leg = LegPlanner(situation, field, CancellationToken(), many=True).near(path)
    assert leg.route.length_m > 8.0
    assert efforts == [(ONE_OF_MANY,), ()]
