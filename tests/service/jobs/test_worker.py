"""What a worker does with a request before it plans."""

from __future__ import annotations

from typing import Any

import pytest

import planner
from planner.search.requests import PlanRequest
from service.jobs import worker

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

    def plan(request: PlanRequest) -> Answer:
        planned.append(request)
        return Answer()

    monkeypatch.setitem(vars(planner), "plan_route", plan)
    monkeypatch.setattr(worker, "waited_s", lambda: 1.5)
    worker.plan_route(PlanRequest.from_json({**WAY, "time_budget_s": 4.0}))
    assert planned[0].time_budget_s == pytest.approx(2.5)
