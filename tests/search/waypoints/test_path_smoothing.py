"""Refinement only ever lowers the cost of a path, also where its coarse look deceives it."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from planner.search.field import polyline_cost, segment_cost
from planner.search.requests import SituationRequest
from planner.search.situation import situation_of
from planner.search.waypoints import path_smoothing as refinement
from planner.search.waypoints.path_smoothing import even_where_free, refine, shortcuts
from planner.terrain.heightmap import Terrain
from tests.search.maps import hills, terrain


def field_over(heights):
    """Costs of a metre of the least energy."""
    ground = terrain(heights)
    return situation_of(SituationRequest(map=ground.name), terrain=ground).field("energy")


@pytest.fixture(scope="module")
def rough():
    """Relief with slopes near what the robot can climb."""
    return field_over(hills(96, rms_degrees=9.0, seed=5))


def ways_across(field, count=40):
    """Bent polylines across the map that can be driven."""
    random = np.random.default_rng(2)
    found = []
    while len(found) < count:
        a, b = random.uniform(3.0, 20.0, (2, 2))
        if math.dist(a, b) < 6.0:
            continue
        along = np.linspace(0.0, 1.0, 12)[:, None]
        across = np.array([a[1] - b[1], b[0] - a[0]]) / math.dist(a, b)
        path = a + along * (b - a) + np.sin(np.pi * along) * random.uniform(-2.0, 2.0) * across
        if math.isfinite(polyline_cost(field, path, field.step)):
            found.append(path)
    return found


def test_no_band_makes_a_path_more_expensive(rough, monkeypatch):
    """A band prices pieces at fewer points, and once found the path itself impassable."""

    def deceived(field, path, *_):
        worse = path.copy()
        worse[1:-1:2] += 0.4
        return worse, 0.0

    for path in ways_across(rough, 6):
        start = polyline_cost(rough, path, rough.step)
        lower, _ = refinement.moved_in_bands(rough, path, rough.dx, lambda: None)
        assert lower < start
        with monkeypatch.context() as patched:
            patched.setattr(refinement, "band", deceived)
            kept, knots = refinement.moved_in_bands(rough, path, rough.dx, lambda: None)
        assert polyline_cost(rough, deceived(rough, path)[0], rough.step) > start
        assert kept == start
        np.testing.assert_array_equal(knots, path)


def test_a_refined_path_keeps_its_ends_and_costs_no_more(rough):
    for path in ways_across(rough, 12):
        before = polyline_cost(rough, path, rough.step)
        for (found, cost), corner_penalty in zip(
            refine(rough, path, penalties=(0.0, 5.0)), (0.0, 5.0), strict=True
        ):
            np.testing.assert_array_equal(found[[0, -1]], path[[0, -1]])
            assert cost == pytest.approx(polyline_cost(rough, found, rough.step))
            assert cost + corner_penalty * len(found) <= before + corner_penalty * len(path)


def test_on_even_ground_a_detour_becomes_a_straight_line():
    field = field_over(np.zeros((96, 96)))
    path = np.array([[3.0, 3.0], [8.0, 11.0], [14.0, 9.0], [20.0, 12.0]])
    ((found, cost),) = refine(field, path, penalties=(1.0,))
    straight = polyline_cost(field, path[[0, -1]], field.step)
    assert cost == pytest.approx(straight, rel=2e-3)
    assert len(found) <= 3


def by_single_pieces(field, path, delta, side, step):
    """What ``band`` looks for, every piece priced on its own."""
    change = refinement.MOST_CHANGE
    ahead = np.gradient(path, axis=0)
    across = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.hypot(*ahead.T)[:, None]
    offsets = delta * np.arange(-side, side + 1)
    places = path[:, None] + offsets[:, None] * across[:, None]
    places[[0, -1]] = path[[0, -1], None]
    cost = np.where(np.arange(len(offsets)) == side, 0.0, np.inf)
    for before, after in zip(places[:-1], places[1:], strict=True):
        pieces = np.array(
            [
                [
                    segment_cost(field, *a, *b, step) if abs(m - q) <= change else math.inf
                    for q, a in enumerate(before)
                ]
                for m, b in enumerate(after)
            ]
        )
        cost = (cost + pieces).min(axis=1)
    return float(cost[side])


@pytest.mark.parametrize(("degrees", "within"), [(3.0, 0.002), (9.0, 0.01)])
def test_a_band_finds_what_single_pieces_find(degrees, within) -> None:
    """Between its samples a band takes slopes to be linear; near limits it looks at the ground."""
    field = field_over(hills(96, rms_degrees=degrees, seed=5))
    for path in ways_across(field, 5):
        # Offsets of a quarter of a cell, as in the last band.
        asked = (path, 0.25 * field.dx, 4, field.step)
        moved, _ = refinement.band(field, *asked)
        best = by_single_pieces(field, *asked)
        assert polyline_cost(field, moved, field.step) <= (1.0 + within) * best
        assert best <= polyline_cost(field, path, field.step)


@pytest.mark.parametrize("height", [0.0, 0.02])
def test_a_band_over_ground_without_a_gentle_slope_looks_at_all_of_it(height) -> None:
    """Where some ground cannot be driven at all, no slope counts as gentle, not even level."""
    ground = terrain(height * hills(96, rms_degrees=9.0, seed=5))
    situation = situation_of(SituationRequest(map=ground.name), terrain=ground)
    costs = situation.costs("energy")
    nowhere = replace(costs, limit=np.full_like(costs.limit, -1.0), reach=1e-9)
    forbidden = situation.ground.field(nowhere)
    assert forbidden.safe == 0.0
    field = situation.field("energy")._replace(safe=forbidden.safe, reach=forbidden.reach)
    path = ways_across(field, 1)[0]
    asked = (path, 0.25 * field.dx, 4, field.step)
    moved, _ = refinement.band(field, *asked)
    best = by_single_pieces(field, *asked)
    assert math.isfinite(best)
    assert polyline_cost(field, moved, field.step) <= 1.002 * best


def test_corners_stand_only_where_an_even_spacing_meets_something_solid():
    """Round a wall's end a path keeps its corners; its many nodes in the open are left out."""
    solid = np.zeros((60, 80), bool)
    solid[:40, 40:43] = True
    relief = terrain(np.zeros(solid.shape), cell=0.1, obstacles=solid)
    field = situation_of(SituationRequest(map="wall"), terrain=relief).field("energy")
    x = np.concatenate([np.full(30, 3.4), 3.4 + 0.1 * np.arange(16), np.full(30, 4.9)])
    y = np.concatenate([1.6 + 0.1 * np.arange(30), np.full(16, 4.6), 4.5 - 0.1 * np.arange(30)])
    path = np.column_stack([x, y])
    assert math.isfinite(polyline_cost(field, path, field.step))
    assert math.isinf(polyline_cost(field, refinement.even(path, 2.4), field.step))
    start = refinement.even_where_free(field, path, 2.4)
    assert math.isfinite(polyline_cost(field, start, field.step))
    assert len(start) <= 6
    ((found, cost),) = refine(field, path, waypoint_cells=24.0)
    assert cost <= polyline_cost(field, path, field.step)
    np.testing.assert_array_equal(found[[0, -1]], path[[0, -1]])


def cluttered():
    """Gentle hills with some solid squares, and a driven way round them."""
    solid = np.zeros((96, 96), bool)
    for j, i in ((30, 40), (48, 20), (60, 62), (22, 70)):
        solid[j : j + 9, i : i + 9] = True
    heights = hills(96, rms_degrees=3.0, seed=4)
    ground = Terrain.from_arrays(heights, cell=(0.25, 0.25), obstacles=solid, name="cluttered")
    ends = (2.0, 2.0), (22.0, 22.0)
    situation = situation_of(SituationRequest(map=ground.name), terrain=ground)
    field = situation.field("energy")
    return field, even_where_free(field, situation.path("energy", field, *ends), 0.75)


def with_all_lines(field, path, corner_penalty):
    """The least cost over all subsets of waypoints, every line between two of them priced."""
    step = refinement.COARSE_STEP * field.step
    cost = [0.0]
    for k in range(1, len(path)):
        totals = []
        for back in range(min(refinement.MOST_SKIPPED, k)):
            q = k - 1 - back
            apart = step * (refinement.FAR_STEP if back >= refinement.MANY_SKIPPED else 1.0)
            totals.append(cost[q] + corner_penalty + segment_cost(field, *path[q], *path[k], apart))
        cost.append(min(totals))
    return cost[-1]


@pytest.mark.parametrize("corner_penalties", [(4.0, 0.4), (0.4, 4.0), (0.05,)])
def test_shortcuts_find_what_pricing_every_line_finds(rough, corner_penalties):
    for field, path in (cluttered(), (rough, ways_across(rough, 1)[0])):
        assert len(path) > 10
        found = shortcuts(field, path, corner_penalties)
        for corner_penalty, shorter in zip(corner_penalties, found, strict=True):
            whole = corner_penalty * (len(shorter) - 1)
            number = [int(np.flatnonzero((path == at).all(axis=1))[0]) for at in shorter]
            step = refinement.COARSE_STEP * field.step
            for a, b in itertools.pairwise(number):
                far = b - a > refinement.MANY_SKIPPED
                apart = step * (refinement.FAR_STEP if far else 1.0)
                whole += segment_cost(field, *path[a], *path[b], apart)
            least = with_all_lines(field, path, corner_penalty)
            assert whole == pytest.approx(least, rel=1e-9)


def test_no_metre_costs_less_than_the_least(rough):
    random = np.random.default_rng(8)
    for field in (rough, cluttered()[0]):
        least, costs = field.least_cost(), []
        for a, b in random.uniform(1.0, 22.0, (400, 2, 2)):
            costs.append(segment_cost(field, *a, *b, field.step) / math.dist(a, b))
        assert least > 0.0
        assert min(costs) >= least
        assert np.isfinite(costs).sum() > 20
