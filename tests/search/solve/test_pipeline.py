"""Smooth, drive, check, keep the cheapest: what each effort promises."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.field import polyline_cost
from planner.search.requests import PlanRequest
from planner.search.results import Route
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve.pipeline import cheapest_near, drive_legs, finished
from planner.search.solve.sketch import (
    ANSWER,
    BASELINE,
    ONE_OF_MANY,
    Closely,
    Sketch,
    sketch,
    with_costs,
)
from planner.search.trajectory import Motion
from planner.search.trajectory.limit_checks import broken_limits
from tests.search.maps import drawn, hills, terrain

START, GOAL = (3.0, 3.0), (20.0, 18.0)


def asked(relief, start=START, goal=GOAL) -> Run:
    ends = {
        "start": dict(zip("xy", start, strict=True)),
        "goal": dict(zip("xy", goal, strict=True)),
    }
    request = PlanRequest.from_json({"map": "here", **ends})
    return Run(request, situation_of(request, terrain=relief), silent, CancellationToken())


@pytest.fixture(scope="module")
def run() -> Run:
    return asked(terrain(hills(96, rms_degrees=6.0)))


@pytest.fixture(scope="module")
def path(run):
    return run.situation.path("energy", run.field("energy"), START, GOAL, run.token)


@pytest.mark.parametrize("effort", [ANSWER, ONE_OF_MANY, BASELINE])
def test_every_effort_keeps_all_limits(run, path, effort):
    field = run.field("energy")
    attempt = cheapest_near(run, field, [path], "energy", effort)
    assert attempt.infeasible is None
    assert not broken_limits(field, run.conditions, attempt.route.motion)
    [(leg, cost)] = attempt.legs
    assert cost == pytest.approx(polyline_cost(field, leg, field.step))
    assert cost < polyline_cost(field, path, field.step)


def test_more_effort_is_no_worse_than_rough_motions_scatter(run, path):
    field = run.field("energy")
    answer, one = (
        cheapest_near(run, field, [path], "energy", effort).route.energy_j
        for effort in (ANSWER, ONE_OF_MANY)
    )
    # Waypoints are moved by rough motions, before the yaw is refined.
    assert answer <= 1.0005 * one


@pytest.mark.parametrize(("degrees", "passes"), [(4.0, True), (9.0, True), (14.0, False)])
def test_what_stops_a_path_is_known_before_it_is_driven_with_all_care(monkeypatch, degrees, passes):
    """On gentle hills nothing does, on steep ones a limit; nothing is driven twice."""
    run = asked(terrain(hills(96, rms_degrees=degrees)))
    field = run.field("energy")
    legs = with_costs(field, [np.array([START, (12.0, 8.0), GOAL])])
    of, closely = Sketch(field, [], ()), Closely("energy")
    stopped = closely.stopped(run, legs, of)
    found = closely.drive(run, legs, of)
    assert (stopped is None) == isinstance(found, Motion) == passes
    assert passes or stopped == Closely("energy").drive(run, legs, of)
    monkeypatch.setattr("planner.search.solve.sketch.move", None)
    assert closely.stopped(run, legs, of) == stopped
    assert closely.drive(run, legs, of) is found


def test_smoothing_beats_driving_the_grids_corners(run, path):
    field = run.field("energy")
    raw = drive_legs(run, field, with_costs(field, [path]), "energy")
    smooth = cheapest_near(run, field, [path], "energy", ONE_OF_MANY).route
    assert not isinstance(raw, Route) or smooth.energy_j < raw.energy_j


def test_of_several_sketches_only_the_cheapest_is_finished(run, path):
    field = run.field("energy")
    short = sketch(run, field, [path], "energy")
    aside = np.vstack([path[:1], [(4.0, 18.0)], path[-1:]])
    long = sketch(run, field, [aside], "energy")
    assert short.energy < long.energy
    found = finished(run, [long, short], "energy")
    assert found.paths is short.paths
    assert found.route.energy_j == finished(run, [short], "energy").route.energy_j
    assert found.route.energy_j < 1.001 * short.energy


def test_a_path_that_nothing_can_drive_says_where_and_why():
    rows = ["." * 24] * 8 + ["#" * 24] + ["." * 24] * 7
    run = asked(drawn("\n".join(rows), cell=0.5), (3.0, 1.5), (3.0, 6.5))
    through = np.array([(3.0, 1.5), (3.0, 6.5)])
    attempt = cheapest_near(run, run.field("energy"), [through], "energy")
    assert attempt.route is None
    assert attempt.candidate("grid") is None
    assert attempt.infeasible.for_want_of_room
    assert "at x 3.00" in attempt.reason
    assert math.isinf(with_costs(run.field("energy"), [through])[0][1])
