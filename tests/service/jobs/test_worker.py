"""What a worker does with a request before it plans."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

import planner
from planner.progress import Progress
from planner.search.requests import PlanRequest
from service.http.schemas import RouteAnswer
from service.jobs import worker
from service.jobs.telemetry import DEMO_HIDDEN, DEMO_VEHICLE

WAY: dict[str, Any] = {"map": "test-bench", "start": {"x": 1, "y": 1}, "goal": {"x": 5, "y": 1}}


def test_what_a_request_waited_comes_off_its_time_budget() -> None:
    asked = PlanRequest.from_json({**WAY, "time_budget_s": 5.0})
    left = worker.less_waiting(asked, 2.0)
    assert left.time_budget_s == pytest.approx(3.0)
    assert left.model_dump(exclude={"time_budget_s"}) == asked.model_dump(exclude={"time_budget_s"})


def test_one_that_waited_longer_is_still_a_request() -> None:
    left = worker.less_waiting(PlanRequest.from_json({**WAY, "time_budget_s": 0.5}), 60.0)
    assert 0.0 < left.time_budget_s < 0.01
    assert PlanRequest.model_validate(left.model_dump(exclude_unset=True)) == left


@pytest.mark.parametrize("fields", [{}, {"iterations": 200}])
def test_one_that_came_without_a_time_budget_stays_as_it_is(fields: dict[str, Any]) -> None:
    """A budget that is given starts a search; iterations make an answer reproducible."""
    asked = PlanRequest.from_json({**WAY, **fields})
    assert worker.less_waiting(asked, 60.0) is asked


def test_planning_gets_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    planned: list[PlanRequest] = []

    class Answer:
        def to_json(self) -> dict[str, Any]:
            return {"planner": {}}

    def plan(request: PlanRequest, *, progress: Progress) -> Answer:
        planned.append(request)
        return Answer()

    monkeypatch.setitem(vars(planner), "plan_route", plan)
    monkeypatch.setattr(worker, "waited_s", lambda: 1.5)
    worker.plan_route(PlanRequest.from_json({**WAY, "time_budget_s": 4.0}))
    assert planned[0].time_budget_s == pytest.approx(2.5)


def test_a_route_comes_with_what_was_asked_for() -> None:
    """The files are of the very route that is shown; baselines have poses on request."""
    asked = PlanRequest.from_json({**WAY, "map": "tilted-plane", "goal": {"x": 6, "y": 6}})
    plain = json.loads(worker.plan_route(asked))
    assert "files" not in plain
    assert all("poses" not in baseline for baseline in plain["baselines"].values())
    full = json.loads(worker.plan_route(asked, True, True, True))
    answer = RouteAnswer.model_validate(full)
    assert sorted(answer.files or {}) == ["csv", "geojson", "nav-path"]
    last = full["routes"][0]["poses"][-1]
    row = answer.files["csv"].splitlines()[-1].split(",") if answer.files else []
    assert [float(row[1]), float(row[-1])] == [last["x"], last["energy_j"]]
    for baseline in full["baselines"].values():
        assert baseline["poses"][-1]["energy_j"] == pytest.approx(baseline["energy_j"])
    assert "svg" in full["report"]


def test_ground_has_a_layer_of_the_size_of_the_maps_picture() -> None:
    layer = json.loads(worker.ground("warehouse", "minibalance", None))["report"]
    assert 'class="drivable"' in layer
    assert "no room for the body" in layer
    size = re.findall(r'<image[^>]* width="([^"]+)" height="([^"]+)"', layer)
    assert size == re.findall(
        r'<image[^>]* width="([^"]+)" height="([^"]+)"',
        json.loads(worker.relief("warehouse", 16, True))["report"],
    )


def test_the_demo_log_hides_what_a_diagnosis_finds(tmp_path: Path) -> None:
    log = tmp_path / "demo.csv"
    log.write_bytes(worker.demo_log())
    found = planner.diagnose(log, DEMO_VEHICLE)
    assert (found.verdict, found.selected) == ("missing_effect", tuple(DEMO_HIDDEN))
