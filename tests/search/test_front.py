"""The front of duration against energy: its ends, its order, its prices."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import energy_time_front, plan_route
from planner.errors import Cancelled, RequestError
from planner.power.vehicles import load_vehicle
from planner.search.front import Front
from planner.terrain.heightmap import Terrain
from tests.search.grid.test_least_cost import hills

WAY = {"start": {"x": 3.0, "y": 3.0}, "goal": {"x": 16.0, "y": 17.0}}


@pytest.fixture(scope="module")
def relief() -> Terrain:
    """Hills of 20 m by 20 m, steep enough that the frugal way is not the quick one."""
    return Terrain.from_arrays(2.0 * hills(), cell=(0.5, 0.5))


@pytest.fixture(scope="module")
def front(relief) -> Front:
    """Its front."""
    return energy_time_front(terrain=relief, **WAY, points=5)


def test_no_route_is_dominated(front):
    assert 2 < len(front.points) <= 5
    seconds = [point.route.duration_s for point in front.points]
    joules = [point.route.energy_j for point in front.points]
    assert (np.diff(seconds) > 0.0).all()
    assert (np.diff(joules) < 0.0).all()


def test_the_ends_are_the_frugal_and_the_fast_route(front, relief):
    """Neither end is worse than a request for its aim alone."""
    frugal = plan_route(terrain=relief, **WAY).routes[0]
    fast = plan_route(terrain=relief, **WAY, objective="time").routes[0]
    assert front.points[-1].route.energy_j < 1.003 * frugal.energy_j
    assert front.points[0].route.duration_s < 1.003 * fast.duration_s


def test_prices_are_the_slopes_between_neighbours(front):
    for quick, slow in zip(front.points[:-1], front.points[1:], strict=True):
        a, b = quick.route, slow.route
        slope = (a.energy_j - b.energy_j) / (b.duration_s - a.duration_s)
        assert quick.price_w[0] == slow.price_w[1] == pytest.approx(slope)
    assert front.points[0].price_w[1] == math.inf
    assert front.points[-1].price_w[0] == 0.0
    # At a price within a route's own two, no other has less energy and priced time.
    for point in front.points:
        low, high = point.price_w
        price = 0.5 * (low + min(high, 2.0 * low + 1.0))
        costs = [p.route.energy_j + price * p.route.duration_s for p in front.points]
        assert min(costs) == pytest.approx(point.route.energy_j + price * point.route.duration_s)


def test_every_route_can_be_driven_and_its_account_closes(front, relief):
    limits = load_vehicle("minibalance").limits
    for route in (point.route for point in front.points):
        assert sum(route.breakdown_j.values()) == pytest.approx(route.energy_j, rel=1e-9)
        assert route.arrays["energy_j"][-1] == route.energy_j
        assert route.lower_bound_j < route.energy_j
        assert route.arrays["speed"].max() <= limits.speed * (1.0 + 1e-9)
        assert (np.diff(route.arrays["t"]) > 0.0).all()
        for k, place in ((0, WAY["start"]), (-1, WAY["goal"])):
            assert (route.arrays["x"][k], route.arrays["y"][k]) == (place["x"], place["y"])
            assert route.arrays["speed"][k] == 0.0


def test_within_is_the_cheapest_that_is_quick_enough(front):
    for point in front.points:
        assert front.within(point.route.duration_s) is point
    assert front.within(0.99 * front.points[0].route.duration_s) is None


def test_mirrored_questions_on_a_tilted_plane_have_mirrored_fronts():
    """The fall line is the plane's axis of symmetry."""
    rise = np.tile(0.12 * 0.5 * np.arange(40), (40, 1))
    plane = Terrain.from_arrays(rise, cell=(0.5, 0.5))
    middle = 0.5 * 39 * 0.5
    ends = []
    for side in (1.0, -1.0):
        front = energy_time_front(
            terrain=plane,
            start={"x": 3.0, "y": middle + 6.0 * side},
            goal={"x": 16.0, "y": middle - 5.0 * side},
            points=3,
        )
        ends.append([(p.route.duration_s, p.route.energy_j) for p in front.points])
    assert np.array(ends[0])[[0, -1]] == pytest.approx(np.array(ends[1])[[0, -1]], rel=2e-3)


def test_what_is_said_of_a_front(front):
    document = front.to_json()
    assert document["status"] == "ok"
    assert [p["price_w"][1] is None for p in document["points"]].index(True) == 0
    assert len(document["points"][0]["poses"]) > 10
    assert front._repr_html_().count("<circle") == len(front.points)


def test_no_path_and_what_cannot_be_used():
    obstacles = np.zeros((40, 40), bool)
    obstacles[20, :] = True
    barred = Terrain.from_arrays(np.zeros((40, 40)), cell=(0.5, 0.5), obstacles=obstacles)
    front = energy_time_front(terrain=barred, **WAY)
    assert (front.status, front.points) == ("no_route", ())
    assert front.cause is not None
    assert set(front.cause) == {"limit", "value", "allowed", "x", "y"}
    assert front.to_json()["cause"] == front.cause
    assert "there is an obstacle" in front.reason
    assert "No route" in front._repr_html_()
    with pytest.raises(RequestError, match="points"):
        energy_time_front(terrain=barred, **WAY, points=1)
    with pytest.raises(RequestError, match="goal"):
        energy_time_front(terrain=barred, start=WAY["start"], goal={"x": 500.0, "y": 1.0})
    with pytest.raises(Cancelled):
        energy_time_front(terrain=barred, **WAY, cancelled=lambda: True)
