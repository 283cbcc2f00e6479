"""The field of least costs against an independent shortest path, symmetries and limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from planner.power.model import PowerModel
from planner.search.field import CostField, polyline_cost
from planner.search.grid.close_moves import close_cost
from planner.search.grid.lattice import PRICED_CLOSELY, Lattice, build_lattice
from planner.search.grid.least_cost import cost_from, cost_to_go, grid_path
from planner.search.requests import PlanRequest
from planner.search.resolution import MOVES
from planner.search.situation import Situation, situation_of
from planner.terrain.heightmap import Terrain

CELL = 0.5


def situation_on(
    heights: np.ndarray,
    obstacles: np.ndarray | None = None,
    model: PowerModel | None = None,
    **conditions,
) -> Situation:
    """Heights (ny, nx) in m, seen by a robot: the standard one, where no model is given."""
    terrain = Terrain.from_arrays(heights, cell=(CELL, CELL), obstacles=obstacles)
    asked = {"map": "here", "start": {"x": 0, "y": 0}, "goal": {"x": 1, "y": 1}}
    request = PlanRequest.from_json({**asked, "conditions": conditions})
    return situation_of(request, terrain=terrain, model=model)


def field_of(heights: np.ndarray, obstacles: np.ndarray | None = None, **conditions) -> CostField:
    """Map and energy costs for heights (ny, nx) in m."""
    return situation_on(heights, obstacles, **conditions).field("energy")


def hills(count: int = 40, seed: int = 1) -> np.ndarray:
    """Smooth relief with slopes of up to some 10°."""
    rng = np.random.default_rng(seed)
    x = np.arange(count) * CELL
    z = np.zeros((count, count))
    for _ in range(6):
        k, phase = rng.uniform(0.15, 0.5, 2), rng.uniform(0, 6.3, 2)
        z += 0.15 * np.sin(k[0] * x[None, :] + phase[0]) * np.sin(k[1] * x[:, None] + phase[1])
    return z


@pytest.fixture(scope="module")
def relief() -> tuple[CostField, Lattice]:
    """Hills with a wall that leaves a gap."""
    obstacles = np.zeros((40, 40), bool)
    obstacles[20, :30] = True
    field = field_of(hills(), obstacles)
    return field, build_lattice(field)


def move_cost(field: CostField, lattice: Lattice, j: int, i: int, m: int) -> float:
    """What the head of planner.search.grid.lattice says that a move costs, written anew."""
    di, dj = (int(k) for k in MOVES[m])
    if lattice.slopes[j, i] == PRICED_CLOSELY:
        return float(close_cost(field, j, i, di, dj))
    beside = {(0, 0), (dj, di)}
    if max(abs(di), abs(dj)) == 2:
        beside |= {(f(dj / 2), f(di / 2)) for f in (math.floor, math.ceil)}
    along = 0.0
    for b, a in beside:
        number = lattice.slopes[j + b, i + a]
        number = lattice.slopes[j, i] if number == PRICED_CLOSELY else number
        along += float(lattice.table[field.ground[j, i], number, m])
    return along  # the table's costs are over each node's share of the length


def test_least_costs_are_those_of_an_independent_search(relief):
    """scipy's Dijkstra on the same moves, edge by edge."""
    field, lattice = relief
    ny, nx = field.heights.shape
    rows, columns, costs = [], [], []
    for j in range(ny):
        for i in range(nx):
            for m, (di, dj) in enumerate(MOVES):
                if 0 <= i + di < nx and 0 <= j + dj < ny:
                    cost = move_cost(field, lattice, j, i, m)
                    if math.isfinite(cost):
                        rows.append((j + dj) * nx + i + di)  # backwards from the goal
                        columns.append(j * nx + i)
                        costs.append(cost)
    graph = coo_array((costs, (rows, columns)), shape=(ny * nx, ny * nx)).tocsr()
    at = (31, 12)
    goal = (field.x0 + at[1] * field.dx, field.y0 + at[0] * field.dy)
    expected = dijkstra(graph, indices=at[0] * nx + at[1]).reshape(ny, nx)
    found = cost_to_go(field, lattice, goal).values
    reached = np.isfinite(expected)
    assert reached.sum() > 500
    # The goal's own nodes are reached by straight lines, which may undercut the first moves.
    apart = reached & (expected > 40.0)
    assert np.isfinite(found[reached]).all()
    assert np.all(found[apart] <= expected[apart] * (1.0 + 1e-5))
    assert found[apart] == pytest.approx(expected[apart], rel=0.02)


def test_there_is_no_path_through_a_wall(relief):
    field, lattice = relief
    goal = (3.0, 15.0)
    to_go = cost_to_go(field, lattice, goal)
    path = grid_path(field, lattice, to_go, (3.0, 4.0))
    assert path is not None
    # The gap is at the wall's eastern end.
    assert path[:, 0].max() > 14.5
    assert math.isfinite(polyline_cost(field, path, field.step))


def test_forwards_and_backwards_cost_the_same(relief):
    field, lattice = relief
    start, goal = (4.25, 4.25), (16.25, 15.75)
    there = cost_from(field, cost_to_go(field, lattice, goal), start)
    from_start = cost_from(field, cost_to_go(field, lattice, start, from_start=True), goal)
    assert from_start == pytest.approx(there, rel=1e-4)


def test_a_search_that_stops_at_its_start_knows_the_same_cost(relief):
    field, lattice = relief
    start, goal = (12.0, 12.5), (16.25, 15.75)
    whole, part = (cost_to_go(field, lattice, goal, start=s) for s in (None, start))
    assert cost_from(field, part, start) == pytest.approx(cost_from(field, whole, start), rel=1e-6)
    assert np.isfinite(part.values).sum() < np.isfinite(whole.values).sum()


def test_detours_through_a_node_may_cost_so_much_more_for_its_cost_to_be_final(relief):
    field, lattice = relief
    start, goal = (3.0, 3.0), (8.0, 5.0)
    whole, back = (
        cost_to_go(field, lattice, end, from_start=away).values
        for end, away in ((goal, False), (start, True))
    )
    least = cost_from(field, cost_to_go(field, lattice, goal), start)
    near = whole + back < 1.29 * least
    part = cost_to_go(field, lattice, goal, start=start, beyond=1.3).values
    np.testing.assert_array_equal(part[near], whole[near])
    assert np.isfinite(part).sum() < np.isfinite(whole).sum()
    alone = cost_to_go(field, lattice, goal, start=start).values
    assert (alone[near] > whole[near]).any()


def test_moves_that_cannot_be_better_are_not_priced():
    """Half of all moves lead from a node that costs more; others are no better at any price."""
    field = field_of(4.0 * hills())
    lattice = build_lattice(field)
    cost_to_go(field, lattice, (10.0, 10.0))
    assert 0.1 < (~np.isnan(lattice.close)).mean() < 0.35


def test_cost_of_level_ground_is_that_of_its_metres():
    """Along a direction of the grid nothing is lost; between two of them 2.7 % at most."""
    field = field_of(np.zeros((60, 60)))
    goal = (field.x0 + 30 * field.dx, field.y0 + 30 * field.dy)
    values = cost_to_go(field, build_lattice(field), goal).values
    per_metre = float(field.best[0, 0, 0])
    for i, j, least, most in (
        (20, 0, -1e-6, 1e-6),
        (18, 18, -1e-6, 1e-6),
        (20, 10, -1e-6, 1e-6),
        (24, 6, 0.005, 0.0275),
        (20, 14, 0.005, 0.0275),
    ):
        lost = values[30 + j, 30 + i] / (math.hypot(i, j) * CELL * per_metre) - 1.0
        assert least < lost < most


def test_ground_at_twice_the_cost_costs_twice(relief):
    field, lattice = relief
    start, goal = (4.0, 4.0), (16.0, 6.0)
    dear = field._replace(factor=np.full(field.heights.shape, 2.0))
    once = cost_from(field, cost_to_go(field, lattice, goal), start)
    twice = cost_from(dear, cost_to_go(dear, lattice, goal), start)
    assert twice == pytest.approx(2.0 * once, rel=1e-3)
