"""Energies between many places, against single requests."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import energy_matrix, plan_route
from planner.errors import Cancelled, RequestError
from planner.search.legs import LegPlanner
from planner.search.requests import MatrixRequest
from planner.terrain.heightmap import Terrain
from tests.search.grid.test_least_cost import hills

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
            single = plan_route(terrain=relief, start=start, goal=goal)
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
        single = plan_route(terrain=relief, start=places[i], goal=places[j])
        allowed = max(3.0 * matrix.error_share, 0.02)
        assert matrix.energy_j[i, j] == pytest.approx(single.routes[0].energy_j, rel=allowed)


def test_keywords_lie_over_a_request_that_is_ready(relief):
    ready = MatrixRequest.from_json({"map": "here", "starts": PLACES})
    matrix = energy_matrix(ready, terrain=relief, goals=PLACES[:1])
    assert matrix.energy_j.shape == (3, 1)
    loaded = energy_matrix(ready, terrain=relief, goals=PLACES[:1], payload={"mass": 5.0})
    assert loaded.energy_j[1, 0] > 1.1 * matrix.energy_j[1, 0]


def test_a_matrix_reports_a_missing_path():
    obstacles = np.zeros((40, 40), bool)
    obstacles[20, :] = True
    terrain = Terrain.from_arrays(np.zeros((40, 40)), cell=(0.5, 0.5), obstacles=obstacles)
    ends = [{"x": 5.0, "y": 4.0}, {"x": 5.0, "y": 16.0}]
    matrix = energy_matrix(terrain=terrain, starts=ends)
    assert math.isinf(matrix.energy_j[0, 1])
    assert matrix.to_json()["energy_j"][0] == [0.0, None]


def test_a_pair_with_a_path_but_no_route_has_no_energy(relief, monkeypatch):
    """Where even the whole search finds no motion, an energy by the path's metres would mislead."""
    drive = LegPlanner.near

    def refused(self, path, yaws=(None, None)):
        return None if path[-1][0] == PLACES[1]["x"] else drive(self, path, yaws)

    monkeypatch.setattr(LegPlanner, "near", refused)
    matrix = energy_matrix(terrain=relief, starts=PLACES)
    assert np.isinf(matrix.energy_j[[0, 2], 1]).all()
    assert np.isfinite(matrix.energy_j[:, [0, 2]]).all()
    assert not any("no route within all limits" in note for note in matrix.notes)
    rng = np.random.default_rng(3)
    places = [*PLACES, *({"x": x, "y": y} for x, y in rng.uniform(2.0, 18.0, (5, 2)).tolist())]
    matrix = energy_matrix(terrain=relief, starts=places)
    assert np.isinf(matrix.energy_j[:, 1]).any()
    assert any("no route within all limits" in note for note in matrix.notes)


def test_what_cannot_be_answered_is_refused(relief):
    with pytest.raises(RequestError, match="starts"):
        energy_matrix(terrain=relief, starts=[])
    with pytest.raises(RequestError, match=r"starts\[1\]"):
        energy_matrix(terrain=relief, starts=[PLACES[0], {"x": 500.0, "y": 1.0}])
    with pytest.raises(Cancelled):
        energy_matrix(terrain=relief, starts=PLACES, cancelled=lambda: True)
