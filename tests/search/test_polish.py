"""Knots moved by what motions cost: parabolas, shares of a motion, straight lines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import plan_route
from planner.search import grid_route, polish
from planner.search.cost_to_go import grid_path
from planner.search.drive import price
from planner.search.edge_routes import EdgeRoutes
from planner.search.kept_limits import broken_limits
from planner.search.request import PlanRequest
from planner.search.run import Run
from planner.search.single_leg import Leg, driven_leg, energy_field, like_neighbour
from planner.search.situation import situation_of
from planner.search.stopping import Stop
from planner.terrain.catalogue import open_map
from planner.terrain.heightmap import Terrain
from tests.search.maps import drawn, hills

FREE = (None, None)


def situation_on(relief: Terrain):
    """A map and the usual model, with the field for energy."""
    ends = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 4.0, "y": 2.0}}
    found = situation_of(PlanRequest.from_json({"map": "here", **ends}), terrain=relief)
    return found, energy_field(found)


@pytest.fixture(scope="module")
def level():
    """Level ground of 24 m by 24 m."""
    return situation_on(Terrain.from_arrays(np.zeros((96, 96)), cell=(0.25, 0.25)))


@pytest.fixture(scope="module")
def hilly():
    """Hills of 24 m by 24 m."""
    relief = hills(96, rms_degrees=7.0, seed=8)
    return situation_on(Terrain.from_arrays(relief, cell=(0.25, 0.25)))


def test_a_parabola_leads_to_where_it_is_least():
    rng = np.random.default_rng(5)
    least, bend = rng.uniform(-1.9, 1.9, 50), rng.uniform(0.1, 9.0, 50)
    values = [bend * (x - least) ** 2 + 3.0 for x in (-1.0, 0.0, 1.0)]
    np.testing.assert_allclose(polish._to_least(*values), least, atol=1e-9)


def test_a_knot_on_a_crest_goes_down_and_one_in_a_trough_between_walls_stays():
    low = np.array([1.0, 3.0, np.inf, np.inf, 2.0, np.inf])
    here = np.array([2.0, 4.0, 4.0, 4.0, 2.0, np.inf])
    high = np.array([2.5, 1.0, 3.0, 5.0, 2.0, np.inf])
    expected = [-1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    np.testing.assert_array_equal(polish._to_least(low, here, high), expected)


def test_what_is_spent_between_knots_adds_up_to_the_whole(hilly):
    situation, field = hilly
    knots = np.column_stack([np.linspace(3.0, 20.0, 9), 12.0 + np.sin(np.arange(9))])
    way = polish.drive_roughly(field, situation.around, (knots,), FREE)
    odd = np.arange(9) % 2 == 1
    spent = polish._spent_beside(way, knots, odd)
    assert len(spent) == 4
    assert spent.sum() == pytest.approx(way.dissipated, rel=1e-12)
    assert (spent > 0.0).all()


def test_what_is_spent_up_to_a_place_is_read_where_the_motion_is_nearest():
    # Out and back along the same line, a joule for each metre.
    x = np.concatenate([np.arange(0.0, 10.5, 0.5), np.arange(9.5, -0.5, -0.5)])
    spent = 0.5 * np.arange(len(x))
    places = np.array([[0.0, 0.0], [4.2, 0.1], [10.0, 0.0], [4.2, -0.1], [0.0, 0.0]])
    along = np.array([0.0, 4.2, 10.0, 15.8, 20.0])
    found = polish._spent_at(x, np.zeros(len(x)), spent, places, along)
    np.testing.assert_allclose(found, along, atol=1e-9)


def test_on_level_ground_a_bent_way_becomes_straight(level):
    situation, field = level
    ends = np.array([[3.0, 3.0], [20.0, 14.0]])
    straight = polish.drive_roughly(field, situation.around, (ends,), FREE)
    share = np.linspace(0.0, 1.0, 5)[:, None]
    across = np.array([-11.0, 17.0]) / math.hypot(11.0, 17.0)
    crooked = ends[0] + share * (ends[1] - ends[0])
    crooked[1:-1] += np.array([0.5, -0.6, 0.4])[:, None] * across
    before = polish.drive_roughly(field, situation.around, (crooked,), FREE)
    after = polish.polish(field, situation.around, [crooked], FREE, steps=(1.0, 0.5, 0.5, 0.25))
    assert before.energy > 1.01 * straight.energy
    assert after.energy < straight.energy + 0.1 * (before.energy - straight.energy)
    [way] = after.legs
    assert np.abs((way - ends[0]) @ across).max() < 0.2


def test_ends_and_places_to_pass_stay_where_they_are(hilly):
    situation, field = hilly
    legs = [np.array([[3.0, 3.0], [9.0, 14.0]]), np.array([[9.0, 14.0], [20.0, 6.0]])]
    given = polish.drive_roughly(field, situation.around, tuple(legs), (None, None, None))
    found = polish.polish(field, situation.around, legs, (None, None, None))
    assert found.energy < given.energy
    for before, after in zip(legs, found.legs, strict=True):
        np.testing.assert_array_equal(after[[0, -1]], before[[0, -1]])


def test_no_knot_moves_to_where_nobody_can_drive():
    picture = "\n".join(
        "." * 40 if j < 12 or j > 14 else "." * 12 + "#" * 16 + "." * 12 for j in range(24)
    )
    situation, field = situation_on(drawn(picture, cell=0.25))
    knots = np.column_stack([np.linspace(1.5, 8.5, 5), np.full(5, 4.0)])
    shifts = np.zeros((5, 2))
    shifts[1:-1, 1] = -1.2
    moved = polish._where_open(field, knots, shifts)
    found = polish.drive_roughly(field, situation.around, (moved,), FREE)
    assert found.motion is not None
    np.testing.assert_array_equal(moved[2], knots[2])
    free = polish._where_open(field, knots, -0.1 * shifts)
    np.testing.assert_allclose(free, knots - 0.1 * shifts)


def test_nothing_is_polished_once_the_caller_wants_to_stop(hilly):
    situation, field = hilly

    def stop() -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        polish.polish(
            field, situation.around, [np.array([[3.0, 3.0], [20.0, 6.0]])], FREE, check=stop
        )


@pytest.mark.parametrize("goal", [(6.4, 12.4), (35.3, 9.6)])
def test_answers_at_once_are_cheaper_for_it_and_keep_all_limits(monkeypatch, goal):
    cone = open_map("cone")
    ends = {"start": {"x": 20.0, "y": 10.0}, "goal": {"x": goal[0], "y": goal[1]}}
    request = PlanRequest.from_json({"map": "cone", **ends})
    with Stop() as stop:
        run = Run(request, situation_of(request, terrain=cone), lambda what, share: None, stop)
        found = grid_route.on_grid(run, run.field("energy"), "energy")
        monkeypatch.setattr(grid_route, "DETOURS", 0)
        monkeypatch.setattr(polish, "SURPLUS", math.inf)
        plain = grid_route.on_grid(run, run.field("energy"), "energy")
    assert found.route.energy_j < 0.995 * plain.route.energy_j
    assert not broken_limits(found.field, run.around, found.route.motion)


def test_ways_beside_one_whose_bends_cost_much_are_tried_but_never_taken_at_a_loss(monkeypatch):
    relief = Terrain.from_arrays(hills(128, rms_degrees=9.0, seed=11), cell=(0.25, 0.25))
    ends = {"start": {"x": 2.0, "y": 3.0}, "goal": {"x": 29.0, "y": 27.0}}
    detours: list[float] = []
    tried = grid_route._attempted

    def noted(*args, below=math.inf, **options):
        attempt = tried(*args, below=below, **options)
        if below < math.inf:
            detours.append(below)
            assert attempt.route is None or attempt.route.energy_j < 1.005 * below
        return attempt

    monkeypatch.setattr(grid_route, "_attempted", noted)
    monkeypatch.setattr(polish, "HINDERED", -1.0)
    found = plan_route(terrain=relief, **ends).routes[0].energy_j
    assert len(detours) == grid_route.DETOURS
    monkeypatch.setattr(grid_route, "DETOURS", 0)
    assert found <= plan_route(terrain=relief, **ends).routes[0].energy_j


def test_where_bends_cost_much_a_way_beside_can_be_cheaper(monkeypatch):
    relief = open_map("fractal-512")
    ends = {"start": {"x": 60.0, "y": 60.0}, "goal": {"x": 75.69457456465163, "y": 24.125}}
    found = plan_route(terrain=relief, **ends).routes[0].energy_j
    monkeypatch.setattr(grid_route, "DETOURS", 0)
    assert found < 0.99 * plan_route(terrain=relief, **ends).routes[0].energy_j


def test_a_leg_learns_from_a_neighbour_and_only_what_is_better(level):
    situation, field = level
    crooked = np.array([[3.0, 3.0], [9.0, 12.0], [20.0, 3.0]])
    motion = driven_leg(situation, field, crooked, stop=_stop())
    assert motion is not None
    own = polish.drive_roughly(field, situation.around, (crooked,), FREE)
    straight = np.array([[3.0, 3.0], [20.0, 3.5]])
    bad = Leg(price(field, situation.around, own.motion), crooked)
    better = like_neighbour(situation, field, bad, straight, stop=_stop())
    assert better.route.energy_j < 0.8 * bad.route.energy_j
    for axis, ends in (("x", (3.0, 20.0)), ("y", (3.0, 3.0))):
        assert better.route.arrays[axis][[0, -1]] == pytest.approx(ends, abs=1e-6)
    assert like_neighbour(situation, field, better, crooked, stop=_stop()) is better


def test_a_route_to_an_edge_that_went_astray_follows_its_neighbours(hilly):
    situation, field = hilly
    start = (12.0, 12.0)
    angles = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
    places = [(12.0 + 8.0 * math.cos(a), 12.0 + 8.0 * math.sin(a)) for a in angles]
    onward = situation.onward(field, start)
    routes = EdgeRoutes(situation, field, [onward], None, _stop())
    nodes = routes.drive(places)
    assert len(nodes) == len(places)
    before, ratios = routes.ratios()
    node = nodes[0]
    spot = (field.x0 + node[1] * field.dx, field.y0 + node[0] * field.dy)
    path = grid_path(field, situation.lattice("energy", field), onward, spot)
    single = driven_leg(situation, field, path, stop=_stop())
    expected = single.dissipated(routes.weight) / float(onward.values[node])
    assert routes.ratio(node) == pytest.approx(expected, rel=0.01)
    astray = np.array([start, (14.0, 4.0), spot])
    motion = polish.drive_roughly(field, situation.around, (astray,), FREE).motion
    routes.legs[node] = (Leg(price(field, situation.around, motion), astray),)
    assert routes.ratio(node) > 1.2 * ratios.max()
    routes.drive([])
    after, found = routes.ratios()
    np.testing.assert_array_equal(after, before)
    np.testing.assert_allclose(found, ratios, rtol=0.02)


def _stop() -> Stop:
    return Stop()
