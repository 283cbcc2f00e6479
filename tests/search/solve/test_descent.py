"""The finished trajectory is moved where that saves energy, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.quantities import STANDARD_GRAVITY
from planner.search.requests import PlanRequest
from planner.search.results import Route, energy_of
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve.descent import descended_closely, dissipated
from planner.search.solve.pipeline import drive_legs, priced
from planner.search.solve.sketch import trajectory, with_costs
from planner.search.trajectory import Motion
from planner.search.trajectory.limit_checks import broken_limits
from planner.terrain.heightmap import Terrain
from tests.search.maps import hills

ENDS = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 21.0, "y": 19.0}}


def asked(heights) -> Run:
    relief = Terrain.from_arrays(heights, cell=(0.25, 0.25))
    request = PlanRequest.from_json({"map": "here", **ENDS})
    return Run(request, situation_of(request, terrain=relief), silent, CancellationToken())


def driven(run: Run, path) -> tuple[list, Route]:
    legs = with_costs(run.field("energy"), [path])
    route = drive_legs(run, run.field("energy"), legs, "energy")
    assert isinstance(route, Route)
    return legs, route


def test_bends_are_straightened_and_ends_and_all_limits_stay():
    run = asked(hills(96, rms_degrees=7.0, seed=8))
    field = run.field("energy")
    path = np.linspace((2.0, 2.0), (21.0, 19.0), 9)
    path[1:-1] += np.array([-0.6, 0.6]) * np.resize([1.0, -1.0], 7)[:, None]
    legs, route = driven(run, path)
    found = descended_closely(run, field, legs, route, route.motion)
    assert found is not None
    assert isinstance(found.motion, Motion)
    better = priced(run, field, found.motion)
    assert better.energy_j < 0.99 * route.energy_j
    assert better.energy_j == pytest.approx(found.energy, rel=1e-9)
    assert not broken_limits(field, run.conditions, found.motion, finely=True)
    # Who drives its legs again gets the same trajectory.
    again = trajectory(run, field, found.legs, "energy")
    assert energy_of(field, run.conditions, again) == pytest.approx(found.energy, rel=1e-9)
    for k in (0, -1):
        np.testing.assert_allclose(found.legs[0][0][k], path[k])


def test_a_straight_line_on_level_ground_is_left_alone(monkeypatch):
    """More waypoints on it lead to a little better speeds, which is no reason to move them."""
    run = asked(np.zeros((96, 96)))
    field = run.field("energy")
    legs, route = driven(run, np.array([[2.0, 2.0], [21.0, 19.0]]))
    assert descended_closely(run, field, legs, route, route.motion) is None
    monkeypatch.setattr("planner.search.solve.descent.LEAST_SAVED", -1.0)
    found = descended_closely(run, field, legs, route, route.motion)
    assert found is not None
    [(path, _)] = found.legs
    aside = (path - path[0]) @ np.array([-17.0, 19.0]) / np.hypot(17.0, 19.0)
    assert np.abs(aside).max() < 1e-9


def test_what_climbing_stores_is_not_dissipated():
    run = asked(0.1 * 0.25 * np.tile(np.arange(96.0), (96, 1)))
    _, up = driven(run, np.array([[2.0, 2.0], [21.0, 19.0]]))
    stored = run.conditions.mass * STANDARD_GRAVITY * 0.1 * 19.0
    assert dissipated(run, up) == pytest.approx(up.energy_j - stored, rel=1e-3)
