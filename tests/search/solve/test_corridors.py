"""On coarse maps, ways beside the grid's best one that cost less once they are smoothed."""

from __future__ import annotations

import numpy as np
import pytest

from planner import plan_route
from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.field import polyline_cost
from planner.search.requests import PlanRequest
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve import grid_planner
from planner.search.solve.corridors import CELLS_BESIDE, MOST_MORE, corridors, worth_looking
from planner.terrain.heightmap import Terrain
from tests.search.maps import hills

ENDS = {"start": {"x": 60.0, "y": 80.0}, "goal": {"x": 500.0, "y": 470.0}}


def coarse(seed: int, cell: float = 10.0) -> Terrain:
    heights = 4.0 * cell * hills(60, rms_degrees=12.0, seed=seed)
    return Terrain.from_arrays(heights, cell=(cell, cell), name="coarse")


def run_on(terrain: Terrain, token: CancellationToken) -> Run:
    scale = terrain.cell[0] / 10.0
    ends = {name: {axis: scale * m for axis, m in place.items()} for name, place in ENDS.items()}
    request = PlanRequest.from_json({"map": "coarse", **ends})
    return Run(request, situation_of(request, terrain=terrain), silent, token)


@pytest.mark.parametrize("seed", [1, 4, 9])
def test_they_lie_beside_the_best_way_and_cost_hardly_more_on_the_grid(seed: int) -> None:
    with CancellationToken() as token:
        run = run_on(coarse(seed), token)
        field = run.field("energy")
        best = run.situation.path("energy", field, *run.places)
        assert best is not None
        least = polyline_cost(field, best, field.step)
        found = list(corridors(run, field, best, np.inf))
    assert found
    for path in found:
        np.testing.assert_allclose(path[[0, -1]], best[[0, -1]])
        away = np.hypot(*(path[:, None] - best[None]).T).min(axis=0).max()
        assert away > (CELLS_BESIDE - 1.0) * field.dx
        # The lattice prices moves by tables, the polyline point by point.
        assert polyline_cost(field, path, field.step) < (1.02 + MOST_MORE) * least


def test_one_may_be_the_cheapest_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    with_them = plan_route(terrain=coarse(13), **ENDS).routes[0].energy_j
    monkeypatch.setattr(grid_planner, "corridors", lambda *_: iter(()))
    assert with_them < 0.999 * plan_route(terrain=coarse(13), **ENDS).routes[0].energy_j


@pytest.mark.parametrize(("cell", "worth"), [(10.0, True), (0.25, False)])
def test_they_are_looked_for_where_cells_are_larger_than_the_body(cell: float, worth: bool) -> None:
    with CancellationToken() as token:
        run = run_on(coarse(1, cell), token)
        assert worth_looking(run, run.field("energy")) == worth
