"""Refusals of what stands in an address."""

from __future__ import annotations

import pytest

from tests.service.conftest import Http
from tests.service.http.exchanges import GOOD, expect_problem


@pytest.mark.parametrize(
    ("most", "sentence"),
    [
        ("5", "query.most: is too small (got '5'); accepted: greater than or equal to 16"),
        ("x", "query.most: is not a whole number (got 'x'); accepted: a valid integer"),
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
