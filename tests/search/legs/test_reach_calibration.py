"""Routes to the edge of an area in reach follow their neighbours."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.search.grid import grid_path
from planner.search.legs import EdgeRoutes, LegPlanner
from planner.search.legs.single_leg import Leg
from planner.search.results import price
from planner.search.waypoints import waypoint_descent as optimise_waypoints
from planner.terrain.heightmap import Terrain
from tests.search.maps import hills
from tests.search.situations import situation_on

FREE = (None, None)


@pytest.fixture(scope="module")
def hilly():
    """Hills of 24 m by 24 m."""
    relief = hills(96, rms_degrees=7.0, seed=8)
    return situation_on(Terrain.from_arrays(relief, cell=(0.25, 0.25)))


def test_a_route_to_an_edge_that_went_astray_follows_its_neighbours(hilly):
    situation, field = hilly
    start = (12.0, 12.0)
    angles = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
    places = [(12.0 + 8.0 * math.cos(a), 12.0 + 8.0 * math.sin(a)) for a in angles]
    from_start = situation.least_cost_from(field, start)
    routes = EdgeRoutes(situation, field, [from_start], None, CancellationToken())
    nodes = routes.drive(places)
    assert len(nodes) == len(places)
    before, ratios = routes.ratios()
    node = nodes[0]
    spot = (field.x0 + node[1] * field.dx, field.y0 + node[0] * field.dy)
    path = grid_path(field, situation.lattice("energy", field), from_start, spot)
    single = LegPlanner(situation, field, CancellationToken()).near(path)
    expected = single.dissipated(routes.weight) / float(from_start.values[node])
    assert routes.ratio(node) == pytest.approx(expected, rel=0.01)
    astray = np.array([start, (14.0, 4.0), spot])
    motion = optimise_waypoints.drive_roughly(field, situation.conditions, (astray,), FREE).motion
    routes.legs[node] = (Leg(price(field, situation.conditions, motion), astray),)
    assert routes.ratio(node) > 1.2 * ratios.max()
    routes.drive([])
    after, found = routes.ratios()
    np.testing.assert_array_equal(after, before)
    np.testing.assert_allclose(found, ratios, rtol=0.02)


def test_a_place_asks_a_neighbour_only_where_most_of_them_do_better(hilly):
    """Of equal routes one always takes a little less; its path would not help the others."""
    situation, field = hilly
    start = (12.0, 12.0)
    from_start = situation.least_cost_from(field, start)
    routes = EdgeRoutes(situation, field, [from_start], None, CancellationToken())
    routes.drive([(16.0, 12.0), (15.5, 14.0), (16.0, 10.5), (15.0, 10.0), (16.0, 13.0)])
    ratios = {node: routes.ratio(node) for node in routes.legs}
    cheapest, dearest = min(ratios, key=ratios.get), max(ratios, key=ratios.get)
    assert ratios[dearest] > 1.006 * ratios[cheapest]
    for pupil, teacher, _ in routes.tried:
        others = [ratio for node, ratio in ratios.items() if node != pupil]
        assert np.median(others) < 0.994 * ratios[pupil]
        assert ratios[teacher] < 0.994 * ratios[pupil]
