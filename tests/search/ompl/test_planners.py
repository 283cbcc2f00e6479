"""Requests that name a planner: a route above the bound, or a reason; the same one again."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.errors import Cancelled, RequestError
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.search.ompl.sampling import SAMPLERS
from tests.search.maps import terrain
from tests.search.ompl.problems import ENDS, RELIEF


@pytest.mark.parametrize("space", ["plane", "poses"])
@pytest.mark.parametrize("name", SAMPLERS)
def test_every_sampler_answers_with_a_route_above_the_bound(name, space):
    answer = plan_route(terrain=RELIEF, **ENDS, planner=name, space=space, iterations=150)
    assert answer.status == "ok"
    assert (answer.planner.name, answer.planner.space) == (name, space)
    assert answer.planner.status == "Exact solution"
    assert answer.planner.iterations >= 150
    least = plan_route(terrain=RELIEF, **ENDS).routes[0]
    assert answer.routes[0].energy_j >= least.lower_bound_j
    assert set(answer.baselines) == {"shortest", "fastest"}


def test_without_a_time_budget_a_sampler_gives_the_same_answer_again():
    first, second = (
        json.dumps(plan_route(terrain=RELIEF, **ENDS, planner="bit*", seed=3).to_json())
        for _ in range(2)
    )
    assert first == second
    other = plan_route(terrain=RELIEF, **ENDS, planner="bit*", seed=4).to_json()
    assert json.dumps(other) != first


def test_via_places_are_passed_by_samplers_too():
    via = [{"x": 15.0, "y": 5.0}]
    route = plan_route(terrain=RELIEF, **ENDS, via=via, planner="bit*", iterations=300).routes[0]
    away = np.hypot(route.arrays["x"] - 15.0, route.arrays["y"] - 5.0)
    assert away.min() < 1e-3


def test_a_sampler_that_finds_nothing_says_so():
    heights = np.zeros((48, 48))
    blocked = np.zeros(heights.shape, bool)
    blocked[:, 22:26] = True
    answer = plan_route(
        terrain=terrain(heights, obstacles=blocked),
        start={"x": 2.0, "y": 6.0},
        goal={"x": 10.0, "y": 6.0},
        planner="rrt*",
        time_budget_s=0.3,
    )
    assert answer.status == "no_route"
    assert "found nothing in 0.3 s" in answer.reason
    assert answer.planner.status in ("Timeout", "Approximate solution")


def test_a_path_that_cannot_be_driven_counts_as_nothing_found():
    """A climb of 6 m at 19° is within the peak torque, and too long for motors that warm in 1 s."""
    x = 0.25 * np.arange(96)
    climb = np.repeat(np.tan(np.radians(19.0)) * np.clip(x - 9.0, 0.0, 6.0)[None, :], 40, axis=0)
    vehicle = load_vehicle("minibalance")
    warming = replace(vehicle, limits=replace(vehicle.limits, thermal_time=1.0))
    answer = plan_route(
        terrain=terrain(climb),
        model=PowerModel.from_vehicle(warming),
        start={"x": 6.0, "y": 5.0},
        goal={"x": 18.0, "y": 5.0},
        planner="bit*",
        iterations=300,
    )
    assert answer.status == "no_route"
    assert answer.reason.startswith("bit* found nothing in")
    assert "that can be driven: " in answer.reason
    assert answer.cause["limit"] == "torque rms"


def test_who_cancels_ends_the_process_that_samples():
    asked: list[float] = []
    with pytest.raises(Cancelled):
        plan_route(
            terrain=RELIEF,
            **ENDS,
            planner="rrt*",
            time_budget_s=600.0,
            progress=lambda share, _: asked.append(share),
            cancelled=lambda: bool(asked) and asked[-1] >= 0.1,
        )


def test_names_of_before_are_refused_with_those_of_today():
    with pytest.raises(RequestError, match="least-energy"):
        plan_route(terrain=RELIEF, **ENDS, planner="tube")
