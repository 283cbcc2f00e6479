"""The service says whether it can plan."""

from __future__ import annotations

from tests.service.conftest import Http, ScriptedWorkers


def test_health_answers_without_a_worker(http: Http, workers: ScriptedWorkers) -> None:
    assert http.get("/healthz").json()["status"] == "ok"
    assert workers.asked == []
    workers.alive = False
    response = http.get("/healthz")
    assert (response.status_code, response.json()["status"]) == (503, "failing")
