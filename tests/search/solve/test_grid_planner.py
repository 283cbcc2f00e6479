"""Answers of the grid: waypoints moved, and paths beside one whose bends cost much."""

from __future__ import annotations

import math

import pytest

from planner import plan_route
from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.requests import PlanRequest
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve import grid_planner
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.waypoints import waypoint_descent as optimise_waypoints
from planner.terrain.heightmap import Terrain
from tests.benchmarks.hard_maps import made, places, rolling
from tests.search.maps import hills


@pytest.mark.parametrize(("name", "seed", "number"), [("maze", 53, 4), ("shelves", 54, 3)])
def test_answers_at_once_are_cheaper_for_it_and_keep_all_limits(monkeypatch, name, seed, number):
    """Corners cost what the search does not count, so that moved waypoints save much."""
    terrain = made(name, seed)
    asked = list(places(terrain, number + 1, seed))[number]
    request = PlanRequest.from_json({"map": terrain.name, **asked})
    with CancellationToken() as token:
        run = Run(request, situation_of(request, terrain=terrain), silent, token)
        found = grid_planner.on_grid(run, run.field("energy"), "energy")
        monkeypatch.setattr(grid_planner, "DETOURS", 0)
        monkeypatch.setattr(optimise_waypoints, "SURPLUS", math.inf)
        plain = grid_planner.on_grid(run, run.field("energy"), "energy")
    assert found.route.energy_j < 0.997 * plain.route.energy_j
    assert not broken_limits(found.field, run.conditions, found.route.motion)


def test_detours_from_expensive_bends_are_tried_but_never_taken_at_a_loss(monkeypatch):
    relief = Terrain.from_arrays(hills(128, rms_degrees=9.0, seed=11), cell=(0.25, 0.25))
    ends = {"start": {"x": 2.0, "y": 3.0}, "goal": {"x": 29.0, "y": 27.0}}
    sketched: list[float] = []
    tried = grid_planner.sketch

    def noted(run, field, paths, objective, *args, **options):
        found = tried(run, field, paths, objective, *args, **options)
        sketched.extend([found.energy] if objective == "energy" else [])
        return found

    monkeypatch.setattr(grid_planner, "sketch", noted)
    monkeypatch.setattr(optimise_waypoints, "DETOUR_EXCESS", -1.0)
    found = plan_route(terrain=relief, **ends).routes[0].energy_j
    assert 1 < len(sketched) <= 1 + grid_planner.DETOURS
    # One that is no cheaper is the last.
    assert all(one < min(sketched[:k]) for k, one in enumerate(sketched[:-1]) if k)
    assert found < 1.005 * min(sketched)
    monkeypatch.setattr(grid_planner, "DETOURS", 0)
    assert found <= plan_route(terrain=relief, **ends).routes[0].energy_j


def test_where_bends_cost_much_a_detour_can_be_cheaper(monkeypatch):
    steep = Terrain.from_arrays(rolling((160, 160), 0.25, 12.0, 30), cell=(0.25, 0.25))
    ends = {"start": {"x": 17.8, "y": 29.37}, "goal": {"x": 10.77, "y": 13.55}}
    found = plan_route(terrain=steep, **ends).routes[0].energy_j
    monkeypatch.setattr(grid_planner, "DETOURS", 0)
    # The search takes metres as even; here speed and heading change with every hill.
    assert found < 0.995 * plan_route(terrain=steep, **ends).routes[0].energy_j
