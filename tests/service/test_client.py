"""The client says what the service says, and loads nothing of the planner."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.client import JoulepathClient, ServiceProblem
from tests.service.route_documents import answer


def client(handler: httpx.MockTransport) -> JoulepathClient:
    return JoulepathClient("http://service", transport=handler)


def test_a_route_is_returned_as_a_document() -> None:
    def respond(request: httpx.Request) -> httpx.Response:
        assert (request.method, request.url.path) == ("POST", "/v1/routes")
        assert json.loads(request.content) == {"map": "m", "seed": 2}
        return httpx.Response(200, json=answer())

    with client(httpx.MockTransport(respond)) as service:
        assert service.plan({"map": "m", "seed": 1}, seed=2) == answer()


def test_a_key_is_sent_with_every_request() -> None:
    def respond(request: httpx.Request) -> httpx.Response:
        return httpx.Response(200, json=[request.headers["Authorization"]])

    handler = httpx.MockTransport(respond)
    with JoulepathClient("http://service", api_key="k", transport=handler) as service:
        assert service.logs() == ["Bearer k"]


def test_a_front_is_asked_for() -> None:
    def respond(request: httpx.Request) -> httpx.Response:
        assert (request.method, request.url.path) == ("POST", "/v1/fronts")
        return httpx.Response(200, json={"asked": json.loads(request.content)})

    with client(httpx.MockTransport(respond)) as service:
        assert service.front({"map": "m"}, points=3) == {"asked": {"map": "m", "points": 3}}


def test_a_problem_is_raised_with_its_document() -> None:
    document = {
        "title": "Unprocessable",
        "status": 422,
        "detail": "start.x: bad",
        "field": "start.x",
    }
    handler = httpx.MockTransport(lambda _: httpx.Response(422, json=document))
    with client(handler) as service, pytest.raises(ServiceProblem, match="bad") as caught:
        service.maps()
    assert (caught.value.status, caught.value.field) == (422, "start.x")
    assert caught.value.problem == document


def test_a_failure_without_a_document_is_raised_too() -> None:
    handler = httpx.MockTransport(lambda _: httpx.Response(502, text="<html>"))
    with client(handler) as service, pytest.raises(ServiceProblem) as caught:
        service.health()
    assert caught.value.status == 502


def test_it_needs_neither_planner_nor_compiler() -> None:
    script = (
        "import sys, service.client; "
        "sys.exit(any(m in {'planner', 'numba', 'numpy', 'ompl'} for m in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", script]).returncode == 0


JOB = {"id": "7", "progress": {"share": 0.5, "sentence": "half way"}, "error": None}


class Service:
    """Answers one verb with a job that is done when it is asked for the third time."""

    def __init__(self, **end: Any) -> None:
        self.end = {"state": "done", "result": {"verdict": "complete"}, **end}
        self.asked: list[tuple[str, str, Any]] = []
        self.waited: list[float] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        path = request.url.path
        body = json.loads(request.content) if request.method == "POST" else None
        self.asked.append((request.method, path, body))
        if request.method == "POST":
            return httpx.Response(202, json={**JOB, "state": "queued"})
        count = sum(asked[0] == "GET" for asked in self.asked)
        return httpx.Response(
            200, json={**JOB, **(self.end if count > 2 else {"state": "running"})}
        )


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time does not pass between two questions."""
    monkeypatch.setattr("time.sleep", lambda _: None)


def test_a_verb_waits_for_its_job_and_tells_its_progress(patient: None) -> None:
    service = Service()
    told: list[tuple[float, str]] = []
    with client(httpx.MockTransport(service)) as made:
        found = made.diagnose("5", vehicle="minibalance", progress=lambda *now: told.append(now))
    assert found == {"verdict": "complete"}
    assert service.asked[0] == ("POST", "/v1/diagnose", {"log": "5", "vehicle": "minibalance"})
    assert service.asked[1:] == [("GET", "/v1/jobs/7", None)] * 3
    # Said once, though it was asked three times.
    assert told == [(0.5, "half way")]


@pytest.mark.parametrize(
    ("end", "status"),
    [
        ({"state": "failed", "error": {"status": 422, "detail": "bad", "field": "log"}}, 422),
        ({"state": "cancelled"}, 409),
    ],
)
def test_a_job_that_fails_is_raised(patient: None, end: dict[str, Any], status: int) -> None:
    with (
        client(httpx.MockTransport(Service(**end))) as made,
        pytest.raises(ServiceProblem) as caught,
    ):
        made.compare("5", model="m")
    assert caught.value.status == status


def test_an_interrupt_cancels_the_job(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(_: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("time.sleep", interrupt)
    service = Service()
    with client(httpx.MockTransport(service)) as made, pytest.raises(KeyboardInterrupt):
        made.adopt("diagnosed", "5", vehicle="minibalance", formula={"name": "tow"})
    assert service.asked[0][2] == {
        "log": "5",
        "vehicle": "minibalance",
        "effects": ["diagnosed"],
        "formula": {"name": "tow"},
    }
    assert service.asked[-1][:2] == ("DELETE", "/v1/jobs/7")


def test_a_log_is_sent_as_a_form(tmp_path: Path) -> None:
    seen: list[bytes] = []

    def respond(request: httpx.Request) -> httpx.Response:
        seen.append(request.read())
        return httpx.Response(201, json={"id": "5"})

    (tmp_path / "drive.csv").write_bytes(b"run,time")
    with client(httpx.MockTransport(respond)) as made:
        assert made.upload_log(tmp_path / "drive.csv", mapping=b"[columns]")["id"] == "5"
    assert b'name="log"; filename="drive.csv"' in seen[0]
    assert b"run,time" in seen[0]
    assert b'name="mapping"; filename="mapping.toml"' in seen[0]
