"""A body that is no request of the workbench is one problem."""

from __future__ import annotations

import pytest

from tests.service.conftest import Http
from tests.service.http.exchanges import JSON, expect_problem
from tests.service.workbench import Workbench


@pytest.mark.parametrize(
    ("verb", "body", "field"),
    [
        ("compare", "{", "request"),
        ("compare", "null", "request"),
        ("compare", "[" * 2000, "request"),
        ("compare", '{"vehicle": "minibalance"}', "log"),
        ("compare", '{"log": "x"}', "request"),
        ("compare", '{"log": "x", "vehicle": "v", "model": "m"}', "request"),
        ("compare", '{"log": "x", "vehicel": "v"}', "vehicel"),
        ("compare", '{"log": "\\ud800", "vehicle": "v"}', "request"),
        ("compare", '{"log": 3, "vehicle": "v"}', "log"),
        ("compare", '{"log": "../../etc", "vehicle": "minibalance"}', "log"),
        ("diagnose", '{"log": "' + "x" * 1500 + '", "vehicle": "minibalance"}', "log"),
        ("adopt", '{"log": "x", "vehicle": "minibalance"}', "request"),
        ("adopt", '{"log": "x", "vehicle": "minibalance", "effects": [1]}', "effects.0"),
        ("adopt", '{"log": "x", "vehicle": "minibalance", "formula": {"k": NaN}}', "formula"),
        ("adopt", '{"log": "x", "vehicle": "minibalance", "formula": "x"}', "formula"),
        ("models/x/revert", '{"version": 0}', "version"),
        ("models/x/revert", '{"version": "two"}', "version"),
    ],
)
def test_a_hostile_body_is_one_problem_and_reaches_no_worker(
    http: Http, bench: Workbench, verb: str, body: str, field: str
) -> None:
    document = expect_problem(http.post(f"/v1/{verb}", content=body, headers=JSON), 422)
    assert document["field"] == field
    assert document["accepted"]
    assert bench.tasks == []
