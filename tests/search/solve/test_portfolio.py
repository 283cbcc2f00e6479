"""The best route for the time given: what contributes, and what a caller who stops gets."""

from __future__ import annotations

import math
import threading
from types import SimpleNamespace

import numpy as np
import pytest

from planner import plan_route
from planner.errors import Cancelled
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import polyline_cost
from planner.search.requests import SituationRequest
from planner.search.results import Route, drive
from planner.search.situation import situation_of
from planner.search.solve.anytime import further_candidates
from planner.search.solve.pipeline import Candidate
from planner.search.solve.pipeline import priced as price
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.trajectory.speed_profile import speed_profile
from planner.search.trajectory.yaw import YawSearch
from planner.search.turns import turning
from planner.terrain.heightmap import Terrain
from tests.search.grid.test_least_cost import hills

ENDS = {"start": {"x": 3.0, "y": 3.0}, "goal": {"x": 16.0, "y": 15.0}}


@pytest.fixture(scope="module")
def relief() -> Terrain:
    """Hills of 20 m by 20 m."""
    return Terrain.from_arrays(hills(), cell=(0.5, 0.5))


def test_without_a_time_given_the_grid_answers(relief):
    answer = plan_route(terrain=relief, **ENDS)
    assert answer.planner.name == "least-energy"
    assert answer.planner.status == "Exact solution"
    assert answer.routes[0].energy_j <= answer.planner.grid_energy_j


def test_more_time_is_never_worse(relief):
    quick = plan_route(terrain=relief, **ENDS)
    longer = plan_route(terrain=relief, **ENDS, time_budget_s=1.5)
    assert longer.routes[0].energy_j <= quick.routes[0].energy_j * (1.0 + 1e-9)
    assert longer.planner.chosen


def test_when_the_budget_ends_with_the_first_route_it_is_the_answer(relief):
    said: list[str] = []
    answer = plan_route(
        terrain=relief,
        **ENDS,
        time_budget_s=1e-3,
        progress=lambda _share, what: said.append(what),
    )
    assert answer.status == "ok"
    assert "other homotopy classes" not in said
    # Nobody stopped it: the time was up, which the user knows.
    assert not any("stopped early" in note for note in answer.notes)
    assert set(answer.baselines) == {"shortest", "fastest"}
    situation = situation_of(SituationRequest(map="hills"), terrain=relief)
    motion = answer.routes[0].motion
    assert not broken_limits(situation.field("energy"), situation.conditions, motion)
    unhurried = plan_route(terrain=relief, **ENDS).routes[0].energy_j
    assert unhurried <= answer.routes[0].energy_j < 1.1 * unhurried


@pytest.mark.parametrize("objective", ["energy", "time"])
@pytest.mark.parametrize("profiles", [0, 4, 12])
def test_once_there_is_a_route_nothing_begins_after_the_budget(
    relief, monkeypatch, objective, profiles
):
    """The budget ends so many profiles of yaw and speed after the first route."""
    clock = SimpleNamespace(now=0.0)
    left, late = [math.inf], []
    counting = threading.Lock()

    def found(*given):
        # Baselines may be there before, from the other core.
        if threading.current_thread() is threading.main_thread():
            with counting:
                left[0] = min(left[0], profiles)
                clock.now = 0.0 if left[0] > 0 else 99.0
        return price(*given)

    def counted(profile):
        def begin(*given, **named):
            with counting:
                late.extend([profile] if clock.now else [])
                left[0] -= 1
                clock.now = 0.0 if left[0] > 0 else 99.0
            return profile(*given, **named)

        return begin

    monkeypatch.setattr("planner.search.run.time", SimpleNamespace(perf_counter=lambda: clock.now))
    monkeypatch.setattr("planner.search.plan.time", SimpleNamespace(perf_counter=lambda: 0.0))
    monkeypatch.setattr("planner.search.solve.pipeline.priced", found)
    for name, profile in (
        ("drive.YawSearch", YawSearch),
        ("speed_search.speed_profile", speed_profile),
    ):
        monkeypatch.setattr(f"planner.search.trajectory.{name}", counted(profile))
    answer = plan_route(terrain=relief, **ENDS, objective=objective, time_budget_s=9.0)
    assert answer.status == "ok"
    assert clock.now == 99.0
    # A motion on either core may just have looked at the clock; a rough one does so once.
    assert late.count(YawSearch) <= 2
    assert late.count(speed_profile) <= 2


def test_who_stops_once_there_is_a_route_gets_it(relief):
    said: list[str] = []
    answer = plan_route(
        terrain=relief,
        **ENDS,
        time_budget_s=30.0,
        progress=lambda _share, what: said.append(what),
        cancelled=lambda: "other homotopy classes" in said,
    )
    assert answer.status == "ok"
    assert any("stopped early" in note for note in answer.notes)


def test_who_stops_before_gets_nothing(relief):
    with pytest.raises(Cancelled):
        plan_route(terrain=relief, **ENDS, cancelled=lambda: True)


def test_no_straight_path_dissipates_less_than_its_metres(relief):
    """Another aim's way whose metres alone cost more than the best route is not driven."""
    situation = situation_of(SituationRequest(map="hills"), terrain=relief)
    field, conditions = situation.field("energy"), situation.conditions
    rng = np.random.default_rng(3)
    compared = 0
    for _ in range(12):
        way = rng.uniform(3.0, 17.0, (2, 2))
        metres = polyline_cost(field, way, field.step)
        route = drive(field, conditions, [way], (None, None))
        if isinstance(route, Route) and np.isfinite(metres):
            dissipated = route.energy_j - conditions.mass * STANDARD_GRAVITY * route.rise_m
            assert metres < dissipated < 1.5 * metres + turning(conditions, 0).stop
            compared += 1
    assert compared >= 8


def test_a_second_request_is_answered_alike(relief):
    """What is kept of the first request changes nothing."""
    first, second = (plan_route(terrain=relief, **ENDS) for _ in range(2))
    assert first.routes[0].energy_j == second.routes[0].energy_j
    assert np.array_equal(first.routes[0].arrays["x"], second.routes[0].arrays["x"])


def test_whatever_may_be_chosen_keeps_to_all_limits(relief, monkeypatch):
    """Nothing looks at the limits of a candidate again, so each keeps to them where it is made."""
    made: list[Candidate] = []

    def noted(run, attempt):
        for candidate in further_candidates(run, attempt):
            made.append(candidate)
            yield candidate

    monkeypatch.setattr("planner.search.solve.portfolio.further_candidates", noted)
    answer = plan_route(terrain=relief, **ENDS, time_budget_s=1.5)
    assert made
    situation = situation_of(SituationRequest(map="hills"), terrain=relief)
    field, conditions = situation.field("energy"), situation.conditions
    motions = [candidate.route.motion for candidate in made]
    for motion in [*motions, answer.routes[0].motion]:
        assert not broken_limits(field, conditions, motion, finely=True)
