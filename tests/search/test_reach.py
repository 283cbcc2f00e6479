"""The area in reach: circles on level ground, and what single requests to its edge take."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import plan_route, reachable_area
from planner.cancellation import CancellationToken
from planner.errors import Cancelled, RequestError
from planner.search.legs import LegPlanner
from planner.search.reach import EdgeSearch
from planner.search.requests import ReachRequest
from planner.search.situation import situation_of
from planner.terrain.heightmap import Terrain
from tests.search.grid.test_least_cost import hills

START = {"x": 3.0, "y": 3.0}


@pytest.fixture(scope="module")
def relief() -> Terrain:
    """Hills of 20 m by 20 m."""
    return Terrain.from_arrays(hills(), cell=(0.5, 0.5))


def test_level_ground_is_reached_in_a_circle():
    """The same energy leads as far in every direction, and as far as a single request says."""
    terrain = Terrain.from_arrays(np.zeros((80, 80)), cell=(0.5, 0.5))
    start = {"x": 20.0, "y": 20.0}
    single = plan_route(terrain=terrain, start=start, goal={"x": 32.0, "y": 20.0})
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
        single = plan_route(terrain=relief, start=start, goal=goal)
        assert single.routes[0].energy_j == pytest.approx(150.0, rel=0.02)


def test_an_edge_without_a_route_is_said(relief, monkeypatch):
    """A path's metres do not say whether motors and grip suffice for it."""
    asked = {"terrain": relief, "start": {"x": 10.0, "y": 10.0}, "energy_j": 150.0}
    assert not any("no route within all limits" in note for note in reachable_area(**asked).notes)
    drive = LegPlanner.near

    def refused(self, path, yaws=(None, None)):
        return None if path[-1][0] > 12.0 else drive(self, path, yaws)

    monkeypatch.setattr(LegPlanner, "near", refused)
    reach = reachable_area(**asked)
    (note,) = (note for note in reach.notes if "no route within all limits" in note)
    known, places = (int(word) for word in note.split() if word.isdigit())
    assert 0 < known < places == known + reach.checked


def test_the_edge_among_obstacles_takes_the_energy():
    solid = np.zeros((100, 100), bool)
    solid[20:80, 30:34] = solid[48:52, 34:60] = True
    terrain = Terrain.from_arrays(np.zeros(solid.shape), cell=(0.1, 0.1), obstacles=solid)
    start = {"x": 1.5, "y": 5.0}
    reach = reachable_area(terrain=terrain, start=start, energy_j=75.0)
    places = np.vstack(reach.outlines)
    columns, rows = np.rint(places / 0.1).astype(int).T
    room = [
        np.isfinite(reach.needed_j[j - 4 : j + 5, i - 4 : i + 5])
        for i, j in zip(columns, rows, strict=True)
    ]
    # Elsewhere the map or a wall ends the area.
    open_edge = places[[one.shape == (9, 9) and bool(one.all()) for one in room]]
    assert len(open_edge) > 20
    for x, y in open_edge[:: len(open_edge) // 6]:
        single = plan_route(terrain=terrain, start=start, goal={"x": float(x), "y": float(y)})
        assert single.routes[0].energy_j == pytest.approx(75.0, rel=0.03)


def test_uphill_is_not_as_far_as_downhill():
    x = 0.5 * np.arange(80)
    terrain = Terrain.from_arrays(np.tile(0.05 * x, (80, 1)), cell=(0.5, 0.5))
    start = {"x": 20.0, "y": 20.0}
    reach = reachable_area(terrain=terrain, start=start, energy_j=200.0)
    (outline,) = reach.outlines
    assert 20.0 - outline[:, 0].min() > 1.2 * (outline[:, 0].max() - 20.0)


def test_what_cannot_be_answered_is_refused(relief):
    with pytest.raises(RequestError, match="energy_j"):
        reachable_area(terrain=relief, start=START, energy_j=-1.0)
    with pytest.raises(Cancelled):
        reachable_area(terrain=relief, start=START, energy_j=200.0, cancelled=lambda: True)


def test_no_place_beside_a_wall_is_driven_to():
    """There the area ends as well, but not for want of energy, and the body may not stand there."""
    solid = np.zeros((60, 60), bool)
    solid[:, 40:] = True
    terrain = Terrain.from_arrays(np.zeros(solid.shape), cell=(0.1, 0.1), obstacles=solid)
    request = ReachRequest(map="wall", start={"x": 1.0, "y": 3.0}, energy_j=1.0)
    situation = situation_of(request, terrain=terrain)
    field = situation.field("energy")
    with CancellationToken() as token:
        search = EdgeSearch(situation, field, request, 1.0, token)
    needed = search.needed(np.ones(solid.shape))
    wall = np.flatnonzero(np.isfinite(needed[30]))[-1]
    search.budget = 1.02 * needed[30, wall]
    places = search.edge(needed, 1)
    assert len(places) > 10
    _, columns = field.nodes_at(np.array(places))
    assert columns.max() < wall
