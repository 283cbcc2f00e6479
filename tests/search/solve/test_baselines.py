"""Routes to compare with: within the answer's limits, and never better than the answer of that aim.

The questions lie on steep relief, among obstacles and on open ground. The first is one whose
shortest line breaks the limits of traction and voltage between the stations.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import energy_time_front, plan_route
from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.report import write_report
from planner.search.limit_places import Infeasible
from planner.search.requests import PlanRequest
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve import portfolio as best_route
from planner.search.solve.sketch import ANSWER, BASELINE, PATIENT_BASELINE, sketch
from planner.search.trajectory.limit_checks import broken_limits
from planner.terrain.heightmap import Terrain
from service.cli import as_tables
from tests.service.cli.terminal import written

QUESTIONS = {
    "steep, all round": ("jacksboro-1to100", (90.5, 159.5), (211.1, 159.5)),
    "steep, across": ("jacksboro-1to100", (115.2, 226.0), (184.3, 297.6)),
    "steep, over a ridge": ("jacksboro-1to100", (167.5, 77.4), (222.7, 213.8)),
    "two hills": ("saddle", (8.9, 37.7), (28.9, 36.4)),
    "fractal": ("fractal-512", (61.5, 120.9), (41.3, 51.9)),
    "racks": ("warehouse", (22.4, 9.6), (14.3, 16.1)),
}


def asked(name: str, **fields):
    where, start, goal = QUESTIONS[name]
    ends = {end: dict(zip("xy", at, strict=True)) for end, at in (("start", start), ("goal", goal))}
    return {"map": where, **ends, **fields}


def test_one_place_that_breaks_a_limit_does_not_cost_the_shortest_route():
    """On steep relief its yaw is chosen again there, so that there is something to compare with."""
    ends = {"start": {"x": 93.0, "y": 225.0}, "goal": {"x": 212.0, "y": 73.0}}
    answer = plan_route({"map": "jacksboro-1to100", **ends})
    shortest = answer.baselines["shortest"]
    assert shortest.length_m < 0.98 * answer.routes[0].length_m
    assert shortest.energy_j > 1.1 * answer.routes[0].energy_j


@pytest.mark.parametrize("name", sorted(QUESTIONS.keys() - {"steep, over a ridge"}))
def test_baselines_keep_to_the_limits_and_no_answer_is_worse(name):
    situation = situation_of(PlanRequest.from_json(asked(name)))
    field = situation.field("energy")
    answers = {
        objective: plan_route(asked(name, objective=objective))
        for objective in ("energy", "length", "time")
    }
    for answer in answers.values():
        assert set(answer.baselines) == {"shortest", "fastest"}
        for route in (answer.routes[0], *(b.route for b in answer.baselines.values())):
            broken = broken_limits(field, situation.conditions, route.motion)
            assert not broken, broken.what
    best = {objective: answer.routes[0] for objective, answer in answers.items()}
    for answer in answers.values():
        compared = answer.baselines
        assert best["energy"].energy_j <= min(b.energy_j for b in compared.values()) + 1e-9
        assert best["length"].length_m <= compared["shortest"].length_m + 1e-9
        assert best["time"].duration_s <= compared["fastest"].duration_s + 1e-9


def test_patience_finds_a_shortest_route_no_longer_than_that_of_haste():
    """Not through the answer: among its other routes one may be nearly as short by chance."""
    request = PlanRequest.from_json(asked("steep, over a ridge"))
    run = Run(request, situation_of(request), silent, CancellationToken())
    field = run.field("length")
    at_once, patient = (
        best_route.on_grid(run, field, "length", effort) for effort in (BASELINE, PATIENT_BASELINE)
    )
    assert patient.route is not None
    assert at_once.route is None or patient.route.length_m <= at_once.route.length_m
    assert not broken_limits(run.field("energy"), run.conditions, patient.route.motion)


def test_the_fastest_route_over_lasting_slopes_spares_the_motors():
    """Every yaw is as fast there. One that is too warm for long would leave no fastest route."""
    ends = {"start": {"x": 1814.5, "y": 24480.5}, "goal": {"x": 23798.5, "y": 28323.2}}
    answer = plan_route(map="jacksboro", **ends)
    fastest = answer.baselines["fastest"].route
    assert fastest.duration_s < 0.97 * answer.routes[0].duration_s
    assert fastest.energy_j > 1.05 * answer.routes[0].energy_j
    torque = [use.share for use in fastest.limits if use.limit == "torque rms"]
    assert len(torque) == 1
    assert torque[0] <= 1.0


@pytest.mark.parametrize("ends", [((3.0, 3.0), (20.0, 14.0)), ((20.0, 4.0), (4.0, 15.0))])
def test_of_all_that_are_as_quick_the_fastest_route_takes_least_energy(ends):
    """Over gentle waves full speed is possible with every yaw, and costs next to nothing."""
    x, y = np.meshgrid(0.25 * np.arange(100), 0.25 * np.arange(80))
    waves = 0.5 * np.sin(x / 4.0) * np.cos(y / 5.0)
    asked = {
        "terrain": Terrain.from_arrays(waves, cell=(0.25, 0.25), name="waves"),
        **dict(zip(("start", "goal"), ends, strict=True)),
    }
    fastest = plan_route(**asked, objective="time").routes[0]
    quickest = energy_time_front(**asked, points=2).points[0].route
    assert fastest.duration_s <= (1.0 + 1e-4) * quickest.duration_s
    assert fastest.energy_j <= (1.0 + 1e-3) * quickest.energy_j
    compared = plan_route(**asked).baselines["fastest"]
    assert compared.duration_s <= (1.0 + 1e-3) * fastest.duration_s
    assert compared.extra_share <= 0.01


def test_where_nothing_keeps_to_the_limits_there_is_no_route(monkeypatch):
    """The limit that is in the way stands beside the reason."""
    search = best_route.on_grid

    def never(run, field, objective, effort=ANSWER):
        found = search(run, field, objective, effort)
        stuck = Infeasible(20.0, 30.0, "wheels slide", limit="traction", value=1.1, allowed=1.0)
        return replace(found, route=None, infeasible=stuck, reason="wheels slide")

    monkeypatch.setattr(best_route, "on_grid", never)
    monkeypatch.setattr(best_route, "drive_legs", lambda *_: None)
    monkeypatch.setattr(best_route, "further_candidates", lambda *_: iter(()))
    document = plan_route(asked("fractal")).to_json()
    assert document["status"] == "no_route"
    assert document["routes"] == []
    cause = {"limit": "traction", "value": 1.1, "allowed": 1.0, "x": 20.0, "y": 30.0}
    assert document["cause"] == cause
    assert "wheels slide" in written(as_tables("plan", document))


def test_what_is_compared_with_arrives_in_time_too():
    free = plan_route(asked("fractal"))
    most = 0.5 * (free.routes[0].duration_s + free.baselines["fastest"].duration_s)
    answer = plan_route(asked("fractal", max_duration_s=most))
    for baseline in answer.baselines.values():
        assert baseline.duration_s <= most
        assert baseline.energy_j >= answer.routes[0].energy_j - 1e-9
        assert baseline.extra_share >= -1e-12


@pytest.mark.parametrize("objective", ["energy", "time", "length"])
def test_an_answer_says_what_it_minimised(objective, tmp_path):
    answer = plan_route(asked("racks", objective=objective))
    document = answer.to_json()
    assert document["planner"]["objective"] == objective
    assert f"route (least {objective})" in written(as_tables("plan", document))
    write_report([answer], tmp_path / "page.html", "routes")
    assert f"route (least {objective})" in (tmp_path / "page.html").read_text()
    assert f"route (least {objective})" in answer._repr_html_()


def test_only_who_looks_for_another_path_asks_for_every_place_in_the_way():
    """On each ridge the shortest line is too steep; a hasty baseline stops at the first of them."""
    run = Run(
        request := PlanRequest.from_json(asked("steep, all round")),
        situation_of(request),
        silent,
        CancellationToken(),
    )
    field = run.field("length")
    path = run.situation.path("length", field, *run.places)
    refused = {
        effort: sketch(run, field, [path], "length", effort).infeasible
        for effort in (BASELINE, PATIENT_BASELINE)
    }
    hasty, patient = refused.values()
    assert len(hasty.places) == 1
    assert len(patient.places) > 1
    assert patient.places[0] == hasty.places[0]


def test_nobody_looks_for_baselines_where_nothing_leads_to_the_goal(monkeypatch):
    begun = []
    monkeypatch.setattr(best_route, "baselines", begun.append)
    blocked = np.zeros((40, 40), bool)
    blocked[:, 20] = True
    relief = Terrain.from_arrays(
        np.zeros((40, 40)), cell=(0.5, 0.5), obstacles=blocked, name="test"
    )
    ends = {"start": {"x": 5.0, "y": 10.0}, "goal": {"x": 15.0, "y": 10.0}}
    assert plan_route(terrain=relief, **ends).status == "no_route"
    assert not begun
