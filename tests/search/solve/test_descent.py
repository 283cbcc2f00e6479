"""What a route dissipates, which descent is judged by."""

from __future__ import annotations

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.quantities import STANDARD_GRAVITY
from planner.search.requests import PlanRequest
from planner.search.results import Route
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve.descent import dissipated
from planner.search.solve.pipeline import drive_legs
from planner.search.solve.sketch import with_costs
from planner.terrain.heightmap import Terrain

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


def test_what_climbing_stores_is_not_dissipated():
    run = asked(0.1 * 0.25 * np.tile(np.arange(96.0), (96, 1)))
    _, up = driven(run, np.array([[2.0, 2.0], [21.0, 19.0]]))
    stored = run.conditions.mass * STANDARD_GRAVITY * 0.1 * 19.0
    assert dissipated(run, up) == pytest.approx(up.energy_j - stored, rel=1e-3)
