"""What holds for every response of the application."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
import pytest

import planner
from service.settings import Settings
from service.store import Store
from tests.service.conftest import Http, ScriptedWorkers
from tests.service.http.exchanges import GOOD, expect_problem
from tests.service.route_documents import answer


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/v1/routes", 405),
        ("DELETE", "/v1/maps", 405),
        ("GET", "/v1/nothing", 404),
        ("GET", "/static/nothing.js", 404),
        ("GET", "/static/../settings.py", 404),
        ("GET", "/v1/maps/atlantis/relief", 404),
        ("GET", "/v1/maps/..%2Fsecret.tif/relief", 404),
        ("GET", "/v1/maps/warehouse/relief?most=1e9", 422),
        ("GET", "/v1/maps/warehouse/relief?most=NaN", 422),
        ("GET", "/v1/logs/nothing", 404),
        ("DELETE", "/v1/logs/nothing", 404),
        ("GET", "/v1/logs/..%2F..%2Fjoulepath.db", 404),
        ("GET", "/v1/jobs/nothing", 404),
        ("DELETE", "/v1/jobs/nothing", 404),
        ("GET", "/v1/jobs?most=0", 422),
        ("GET", "/v1/models/nothing", 404),
        ("GET", "/v1/models/%00%ff", 404),
        ("GET", "/v1/models/nothing/history", 404),
        ("POST", "/v1/compare?wait=1e9", 422),
        ("GET", "/v1/compare", 405),
        ("POST", "/v1/compare", 415),
        ("POST", "/v1/models", 415),
    ],
)
def test_other_errors_are_problems_too(http: Http, method: str, path: str, status: int) -> None:
    expect_problem(http.request(method, path), status)


def test_an_unexpected_failure_has_a_number_and_no_details(
    http: Http, workers: ScriptedWorkers, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: Any) -> Any:
        raise ZeroDivisionError("secret detail")

    workers.work = fail
    document = expect_problem(http.post("/v1/routes", json=GOOD), 500)
    assert "secret" not in json.dumps(document)
    assert document["id"] in document["detail"]
    captured = capsys.readouterr()
    assert document["id"] in captured.out + captured.err


def test_every_response_forbids_foreign_scripts(http: Http) -> None:
    for path in ("/", "/v1/maps", "/v1/nothing"):
        policy = http.get(path).headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy


def test_openapi_describes_request_answer_and_problem(http: Http) -> None:
    document = http.get("/openapi.json").json()
    plan = document["paths"]["/v1/routes"]["post"]
    request = plan["requestBody"]["content"]["application/json"]
    schemas = document["components"]["schemas"]

    def check(instance: Any, name: str) -> None:
        schema = {"$ref": f"#/components/schemas/{name}", "components": {"schemas": schemas}}
        jsonschema.validate(instance, schema)

    check(request["example"], "PlanRequest")
    check(answer(), "RouteAnswer")
    with pytest.raises(jsonschema.ValidationError):
        check({**GOOD, "strat": 1}, "PlanRequest")
    assert {"200", "413", "415", "422", "500", "503", "504"} <= set(plan["responses"])


def test_a_question_has_the_name_of_the_planners_function(http: Http) -> None:
    paths = http.get("/openapi.json").json()["paths"]
    asked = {
        "/v1/routes": "plan_route",
        "/v1/fronts": "energy_time_front",
        "/v1/graphs": "energy_graph",
        "/v1/matrices": "energy_matrix",
        "/v1/reachable-areas": "reachable_area",
        "/v1/compare": "compare",
        "/v1/diagnose": "diagnose",
        "/v1/adopt": "adopt",
        "/v1/models/{model}/revert": "revert",
    }
    assert {path: paths[path]["post"]["operationId"] for path in asked} == asked
    assert set(asked.values()) <= set(planner.__all__)
    every = [how["operationId"] for path in paths.values() for how in path.values()]
    assert len(every) == len(set(every))


def test_the_store_is_closed_with_the_service(http: Http, settings: Settings) -> None:
    http.get("/v1/logs")
    Store.open(settings).close()
