"""Energies of a graph's edges, against single requests and against physics."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from planner import energy_graph, plan_route
from planner.errors import Cancelled, RequestError
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.quantities import STANDARD_GRAVITY
from planner.terrain.heightmap import Terrain
from tests.search.grid.test_least_cost import hills
from tests.search.route_graphs import edge, graph

PLACES = [{"x": 3.0, "y": 3.0}, {"x": 8.0, "y": 5.0}, {"x": 7.0, "y": 11.0}]
TRIANGLE = [(0, 1), (1, 2), (2, 0)]


@pytest.fixture(scope="module")
def relief() -> Terrain:
    """Hills of 20 m by 20 m."""
    return Terrain.from_arrays(hills(), cell=(0.5, 0.5))


@pytest.fixture(scope="module")
def halves() -> Terrain:
    """A flat room with a wall that leaves a gap at its eastern end, 7 m off the places."""
    obstacles = np.zeros((40, 40), bool)
    obstacles[20, :30] = True
    return Terrain.from_arrays(np.zeros((40, 40)), cell=(0.25, 0.25), obstacles=obstacles)


ACROSS = [{"x": 2.0, "y": 3.0}, {"x": 2.0, "y": 7.0}]


def edges_of(document: dict[str, Any]) -> dict[int, dict[str, Any]]:
    """Properties of the edges, by id."""
    every = [feature["properties"] for feature in document["features"]]
    return {one["id"]: one for one in every if "startid" in one}


def test_energies_are_those_of_single_requests(relief: Terrain) -> None:
    found = energy_graph(terrain=relief, graph=graph(PLACES, TRIANGLE))
    assert found.closed == {}
    assert len(found.drives) == 6
    for (a, b), drive in found.drives.items():
        single = plan_route(terrain=relief, start=PLACES[a], goal=PLACES[b]).routes[0]
        assert drive.energy_j == pytest.approx(single.energy_j, rel=0.005)
        lifted = load_vehicle("minibalance").mass * STANDARD_GRAVITY * single.rise_m
        assert drive.cost == pytest.approx(single.energy_j - lifted, rel=0.005)
        # What climbing stores comes back: it is the same both ways, with the other sign.
        back = found.drives[b, a]
        assert drive.energy_j - drive.cost == pytest.approx(back.cost - back.energy_j, rel=1e-6)
    # Round a closed loop the heights cancel: costs add up to energies.
    loop = [found.drives[way] for way in TRIANGLE]
    assert sum(d.cost for d in loop) == pytest.approx(sum(d.energy_j for d in loop), rel=1e-9)


def test_no_cost_is_below_zero_where_a_descent_returns_energy() -> None:
    slope = 0.25 * np.arange(40)[None, :] * np.ones((40, 1)) * 0.25
    terrain = Terrain.from_arrays(slope, cell=(0.25, 0.25))
    ends = [{"x": 8.0, "y": 5.0}, {"x": 2.0, "y": 5.0}]
    base = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=())
    found = energy_graph(terrain=terrain, model=base, graph=graph(ends, [(0, 1)]))
    down = found.drives[0, 1]
    assert down.energy_j < 0.0 < down.cost


def test_the_file_is_written_back_with_energies(relief: Terrain) -> None:
    given = graph(PLACES, [])
    open_door = {"open_door": {"type": "OpenDoor", "trigger": "ON_ENTER"}}
    given["features"] += [
        edge(9, 0, 1, cost=1.0, overridable=True, metadata={"speed_limit": 0.5}),
        edge(20, 1, 0, operations=open_door),
        edge(21, 1, 2, operations=open_door),
    ]
    found = energy_graph(terrain=relief, graph=given)
    document = found.to_json()
    assert document["name"] == "graph"
    assert document["features"][:3] == given["features"][:3]
    edges = edges_of(document)
    assert list(edges) == [9, 20, 21]
    assert edges[20]["operations"] == open_door
    for one in edges.values():
        drive = found.drives[one["startid"], one["endid"]]
        assert (one["cost"], one["overridable"]) == (drive.cost, False)
        assert one["metadata"]["energy_j"] == drive.energy_j
        # The route server takes primitives alone.
        assert {type(value) for value in one["metadata"].values()} == {float}
    assert edges[9]["metadata"]["speed_limit"] == 0.5
    assert "energy_back_j" not in edges[9]["metadata"]
    assert edges[21]["metadata"]["energy_back_j"] == found.drives[2, 1].energy_j
    both = edges_of(energy_graph(terrain=relief, graph=given, add_opposite=True).to_json())
    assert list(both) == [9, 20, 21, 22]
    assert (both[22]["startid"], both[22]["endid"]) == (2, 1)
    assert both[22]["cost"] == found.drives[2, 1].cost
    assert "operations" not in both[22]
    assert "energy_back_j" not in both[21]["metadata"]


def test_a_corridor_keeps_the_route_near_its_edge(halves: Terrain) -> None:
    asked = {"terrain": halves, "graph": graph(ACROSS, [(0, 1)])}
    free = energy_graph(**asked)
    assert free.drives[0, 1].length_m > 11.0
    near = energy_graph(**asked, corridor_m=2.0)
    assert near.drives == {}
    assert near.closed == dict.fromkeys([(0, 1), (1, 0)], "no path within 2 m of the edge")
    wide = energy_graph(**asked, corridor_m=9.0)
    assert wide.drives[0, 1].energy_j == pytest.approx(free.drives[0, 1].energy_j, rel=1e-6)
    # A search within a corridor leaves nothing behind for others.
    again = energy_graph(**asked)
    assert again.drives == free.drives


def test_a_route_may_leave_its_edge_by_the_corridor_alone(halves: Terrain) -> None:
    obstacles = np.zeros((40, 40), bool)
    obstacles[18:22, 14:22] = True
    terrain = Terrain.from_arrays(np.zeros((40, 40)), cell=(0.25, 0.25), obstacles=obstacles)
    ends = [{"x": 5.0, "y": 2.0}, {"x": 5.0, "y": 8.0}]
    asked = {"terrain": terrain, "graph": graph(ends, [(0, 1)])}
    assert energy_graph(**asked, corridor_m=0.5).drives == {}
    # Past the eastern side: half a block and half a robot.
    drive = energy_graph(**asked, corridor_m=1.5).drives[0, 1]
    assert 6.0 < drive.length_m < 2.0 * math.hypot(3.0, 1.5) + 0.5


def test_edges_that_cannot_be_driven_are_left_out(halves: Terrain) -> None:
    places = [*ACROSS, {"x": 2.0, "y": 5.0}]
    found = energy_graph(
        terrain=halves, graph=graph(places, [(0, 1), (1, 2)]), corridor_m=1.0, objective="time"
    )
    document = found.to_json()
    assert edges_of(document) == {}
    reasons = {
        (one["id"], one["startid"]): one["reason"] for one in document["joulepath"]["closed"]
    }
    assert set(reasons) == {(100, 0), (None, 1), (101, 1), (None, 2)}
    assert "within 1 m" in reasons[100, 0]
    assert reasons[101, 1] == "place 2: on an obstacle"


def test_the_objective_is_the_cost(halves: Terrain) -> None:
    places = [{"x": 2.0, "y": 3.0}, {"x": 5.0, "y": 3.0}]
    asked = {"terrain": halves, "graph": graph(places, [(0, 1)])}
    fast = energy_graph(**asked, objective="time").drives[0, 1]
    short = energy_graph(**asked, objective="length").drives[0, 1]
    assert fast.cost == fast.duration_s
    assert short.cost == short.length_m == pytest.approx(3.0, abs=1e-3)
    # Places that coincide: no cost of 0, which the route server refuses.
    same = energy_graph(terrain=halves, graph=graph([ACROSS[0]] * 2, [(0, 1)])).drives[0, 1]
    assert (same.energy_j, same.cost > 0.0) == (0.0, True)


def test_what_cannot_be_answered_is_refused(halves: Terrain) -> None:
    good = graph(ACROSS, [(0, 1)])
    far = graph([ACROSS[0], {"x": 500.0, "y": 1.0}], [(0, 1)])
    with pytest.raises(RequestError, match="place 1: outside the map"):
        energy_graph(terrain=halves, graph=far)
    with pytest.raises(RequestError, match="corridor_m: is too small"):
        energy_graph(terrain=halves, graph=good, corridor_m=0)
    with pytest.raises(RequestError, match="corridor_m: is not a number"):
        energy_graph(terrain=halves, graph=good, corridor_m="1")
    with pytest.raises(RequestError, match="graph: is missing"):
        energy_graph(terrain=halves)
    with pytest.raises(RequestError, match=r"none\.geojson: cannot be read"):
        energy_graph(terrain=halves, graph="none.geojson")
    with pytest.raises(Cancelled):
        energy_graph(terrain=halves, graph=good, cancelled=lambda: True)
