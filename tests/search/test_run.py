"""What the steps of a request share: its places, its yaw angles, and how it stops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.errors import Cancelled
from planner.progress import Progress, silent
from planner.search.requests import PlanRequest
from planner.search.run import Run
from planner.search.situation import Situation, situation_of
from planner.terrain.heightmap import Terrain

A, B = {"x": 2.0, "y": 2.0}, {"x": 6.0, "y": 5.0}


@pytest.fixture(scope="module")
def level() -> Situation:
    """10 m by 10 m of level ground."""
    terrain = Terrain.from_arrays(np.zeros((20, 20)), cell=(0.5, 0.5))
    request = PlanRequest.from_json({"map": "here", "start": A, "goal": B})
    return situation_of(request, terrain=terrain)


def run_of(
    situation: Situation,
    *poses: dict[str, float],
    progress: Progress = silent,
    token: CancellationToken | None = None,
) -> Run:
    """A request from the first of these poses to the last."""
    start, *via, goal = poses
    asked: dict[str, Any] = {"map": "here", "start": start, "via": via, "goal": goal}
    token = CancellationToken() if token is None else token
    return Run(PlanRequest.from_json(asked), situation, progress, token)


def test_places_that_coincide_count_once(level):
    near_a = {"x": 2.0 + 1e-7, "y": 2.0}
    assert run_of(level, A, B).places == [(2.0, 2.0), (6.0, 5.0)]
    assert run_of(level, A, near_a, B, B).places == [(2.0, 2.0), (6.0, 5.0)]
    # To go and come back is to be at a place twice.
    assert run_of(level, A, B, A).places == [(2.0, 2.0), (6.0, 5.0), (2.0, 2.0)]
    assert run_of(level, A, near_a).places == [(2.0, 2.0), (2.0, 2.0)]


def test_there_is_a_yaw_for_every_place(level):
    turned = {**B, "yaw": 1.0}
    run = run_of(level, A, turned)
    assert run.yaws == [None, 1.0]
    for poses in ((A, B, turned), (A, A), (A, turned, A, {**A, "yaw": 0.5})):
        run = run_of(level, *poses)
        assert len(run.yaws) == len(run.places)
        assert run.yaws[0] is None


def test_steps_are_told_until_the_caller_stops(level):
    told: list[tuple[float, str]] = []
    wishes: list[bool] = []
    token = CancellationToken(lambda: bool(wishes))
    run = run_of(level, A, B, progress=lambda *step: told.append(step), token=token)
    run.step(0.25, "grid")
    wishes.append(True)
    assert run.cancelled()
    with pytest.raises(Cancelled):
        run.step(0.5, "motion")
    assert told == [(0.25, "grid")]
