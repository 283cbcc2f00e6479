"""Energies between many places and the area in reach, against single requests."""

from __future__ import annotations

import math
from threading import Event

import numpy as np
import pytest

from planner import energy_matrix, plan_route, reachable_area
from planner.errors import Cancelled, RequestError
from planner.search.request import MatrixRequest
from planner.search.single_leg import energy_field
from planner.search.situation import situation_of
from planner.search.stopping import Stop
from planner.terrain.heightmap import Terrain
from tests.search.test_cost_to_go import hills

PLACES = [{"x": 3.0, "y": 3.0}, {"x": 16.0, "y": 5.0}, {"x": 9.0, "y": 16.0}]


@pytest.fixture(scope="module")
def relief() -> Terrain:
    """Hills of 20 m by 20 m."""
    return Terrain.from_arrays(hills(), cell=(0.5, 0.5))


def test_a_matrix_holds_what_single_requests_say(relief):
    matrix = energy_matrix(terrain=relief, starts=PLACES)
    assert matrix.error_share == 0.0
    for i, start in enumerate(PLACES):
        for j, goal in enumerate(PLACES):
            single = plan_route(terrain=relief, start=start, goal=goal, planner="grid")
            expected = single.routes[0].energy_j if i != j else 0.0
            assert matrix.energy_j[i, j] == pytest.approx(expected, rel=0.01, abs=1e-9)
    document = matrix.to_json()
    assert document["driven"] == 6
    assert len(document["energy_j"]) == 3


def test_pairs_that_are_not_driven_are_right_within_what_is_said(relief):
    rng = np.random.default_rng(3)
    places = [{"x": float(x), "y": float(y)} for x, y in rng.uniform(2.0, 18.0, (8, 2))]
    matrix = energy_matrix(terrain=relief, starts=places)
    assert 0.0 < matrix.error_share < 0.1
    rest = np.argwhere(~matrix.driven & ~np.eye(8, dtype=bool))[:6]
    for i, j in rest:
        single = plan_route(terrain=relief, start=places[i], goal=places[j], planner="grid")
        allowed = max(3.0 * matrix.error_share, 0.02)
        assert matrix.energy_j[i, j] == pytest.approx(single.routes[0].energy_j, rel=allowed)


def test_keywords_lie_over_a_request_that_is_ready(relief):
    ready = MatrixRequest.from_json({"map": "here", "starts": PLACES})
    matrix = energy_matrix(ready, terrain=relief, goals=PLACES[:1])
    assert matrix.energy_j.shape == (3, 1)
    loaded = energy_matrix(ready, terrain=relief, goals=PLACES[:1], payload={"mass": 5.0})
    assert loaded.energy_j[1, 0] > 1.1 * matrix.energy_j[1, 0]


def test_no_way_is_said_in_a_matrix():
    obstacles = np.zeros((40, 40), bool)
    obstacles[20, :] = True
    terrain = Terrain.from_arrays(np.zeros((40, 40)), cell=(0.5, 0.5), obstacles=obstacles)
    ends = [{"x": 5.0, "y": 4.0}, {"x": 5.0, "y": 16.0}]
    matrix = energy_matrix(terrain=terrain, starts=ends)
    assert math.isinf(matrix.energy_j[0, 1])
    assert matrix.to_json()["energy_j"][0] == [0.0, None]


def test_level_ground_is_reached_in_a_circle():
    """The same energy leads as far in every direction, and as far as a single request says."""
    terrain = Terrain.from_arrays(np.zeros((80, 80)), cell=(0.5, 0.5))
    start = {"x": 20.0, "y": 20.0}
    single = plan_route(terrain=terrain, start=start, goal={"x": 32.0, "y": 20.0}, planner="grid")
    energy = single.routes[0].energy_j
    reach = reachable_area(terrain=terrain, start=start, energy_j=energy)
    (outline,) = reach.outlines
    radius = np.hypot(*(outline - 20.0).T)
    assert radius == pytest.approx(12.0, rel=0.02)
    assert reach.area_m2 == pytest.approx(math.pi * 12.0**2, rel=0.03)
    back = reachable_area(terrain=terrain, start=start, energy_j=2.0 * energy, and_back=True)
    assert back.area_m2 == pytest.approx(reach.area_m2, rel=0.02)


def test_the_edge_of_the_area_takes_the_energy(relief):
    start = {"x": 10.0, "y": 10.0}
    reach = reachable_area(terrain=relief, start=start, energy_j=150.0)
    outline = max(reach.outlines, key=len)
    inner = outline[(np.abs(outline - 10.0) < 8.0).all(axis=1)]
    for x, y in inner[:: max(1, len(inner) // 6)]:
        goal = {"x": float(x), "y": float(y)}
        single = plan_route(terrain=relief, start=start, goal=goal, planner="grid")
        assert single.routes[0].energy_j == pytest.approx(150.0, rel=0.02)


def test_uphill_is_not_as_far_as_downhill():
    x = 0.5 * np.arange(80)
    terrain = Terrain.from_arrays(np.tile(0.05 * x, (80, 1)), cell=(0.5, 0.5))
    start = {"x": 20.0, "y": 20.0}
    reach = reachable_area(terrain=terrain, start=start, energy_j=200.0)
    (outline,) = reach.outlines
    assert 20.0 - outline[:, 0].min() > 1.2 * (outline[:, 0].max() - 20.0)


def test_what_cannot_be_answered_is_refused(relief):
    with pytest.raises(RequestError, match="energy_j"):
        reachable_area(terrain=relief, start=PLACES[0], energy_j=-1.0)
    with pytest.raises(RequestError, match="starts"):
        energy_matrix(terrain=relief, starts=[])
    with pytest.raises(RequestError, match=r"starts\[1\]"):
        energy_matrix(terrain=relief, starts=[PLACES[0], {"x": 500.0, "y": 1.0}])
    with pytest.raises(Cancelled):
        energy_matrix(terrain=relief, starts=PLACES, cancelled=lambda: True)
    with pytest.raises(Cancelled):
        reachable_area(terrain=relief, start=PLACES[0], energy_j=200.0, cancelled=lambda: True)


def test_wish_to_stop_is_seen_while_nobody_asks():
    asked = Event()

    def cancelled() -> bool:
        asked.set()
        return True

    with Stop(cancelled) as stop:
        assert asked.wait(10.0)
    assert stop.flag[0]  # compiled searches look at this
    with pytest.raises(Cancelled):
        stop.check()


def test_compiled_search_stops_for_the_flag(relief):
    situation = situation_of(MatrixRequest(map=relief.name, starts=PLACES), terrain=relief)
    with Stop(lambda: True) as stop:
        assert stop.asked()
        with pytest.raises(Cancelled):
            situation.onward(energy_field(situation), (1.0, 1.0), stop.flag)
