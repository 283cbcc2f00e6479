"""Refusals of what stands in an address."""

from __future__ import annotations

import pytest

from tests.service.conftest import Http
from tests.service.http.exchanges import GOOD, expect_problem


@pytest.mark.parametrize(
    ("most", "sentence"),
    [
        ("5", "query.most: is too small (got '5'); accepted: greater than or equal to 16"),
        ("x", "query.most: is not a whole number (got 'x'); accepted: a whole number"),
    ],
)
def test_a_wrong_parameter_is_named_with_its_value(http: Http, most: str, sentence: str) -> None:
    response = http.get("/v1/maps/warehouse/relief", params={"most": most})
    assert expect_problem(response, 422)["detail"] == sentence


def test_a_parameter_that_the_endpoint_does_not_have_is_refused(http: Http) -> None:
    """A misspelt one would else be an answer to another question."""
    problem = expect_problem(http.post("/v1/routes?reports=true", json=GOOD), 422)
    assert problem["field"] == "query.reports"
    assert problem["accepted"] == "report, files, baseline_poses, progress"
    assert expect_problem(http.get("/v1/effects?a=1"), 422)["accepted"] == "no parameters"
    assert http.post("/v1/routes?report=false", json=GOOD).status_code == 200
    assert http.get("/?from=mail").status_code == 200


def test_a_wrong_address_or_method_is_said_with_what_would_do(http: Http) -> None:
    """Each method of an address is a route of its own; ``Allow`` names them all."""
    refused = http.request("PUT", "/v1/logs")
    problem = expect_problem(refused, 405)
    assert problem["detail"] == "/v1/logs takes no PUT; accepted: GET, POST"
    assert refused.headers["Allow"] == "GET, POST"
    for path in ("/static/page.js", "/openapi.json", "/"):
        said = expect_problem(http.request("PUT", path), 405)["detail"]
        assert said.startswith(f"{path} takes no PUT; accepted: GET")
    nothing = expect_problem(http.get("/v1/route"), 404)["detail"]
    assert nothing == "there is nothing at /v1/route; accepted: the addresses in /openapi.json"
    said = expect_problem(http.get("/v1/logs/none"), 404)["detail"]
    assert said == "there is no log 'none'"


def test_a_compressed_body_is_refused_for_what_it_is(http: Http) -> None:
    headers = {"Content-Type": "application/json", "Content-Encoding": "gzip"}
    refused = http.post("/v1/routes", content=b"\x1f\x8b", headers=headers)
    assert "is compressed (Content-Encoding: gzip)" in expect_problem(refused, 415)["detail"]
