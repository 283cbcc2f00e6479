"""The client says what the service says, and loads nothing of the planner."""

from __future__ import annotations

import json
import subprocess
import sys

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
