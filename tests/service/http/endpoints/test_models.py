"""Versions of models are uploaded, reverted and named by routes."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest

from planner.errors import ModelError
from planner.power.saved import SavedModel
from service.settings import Settings
from tests.service import telemetry_documents as documents
from tests.service.conftest import Http, ScriptedWorkers
from tests.service.http.exchanges import GOOD, JSON, expect_problem
from tests.service.workbench import SAVED, Workbench, talk


def test_a_saved_model_is_uploaded_and_reverted(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        response = await client.post("/v1/models", content=SAVED, headers=JSON)
        assert response.status_code == 201
        first = response.json()
        assert response.headers["location"] == f"/v1/models/{first['id']}"
        assert bench.tasks[-1] == ("check_model", SAVED.encode())
        reverted = await client.post(f"/v1/models/{first['id']}/revert", json={"version": 1})
        assert reverted.status_code == 201
        assert (reverted.json()["version"], reverted.json()["parent_id"]) == (3, first["id"])
        entries = (await client.get(f"/v1/models/{reverted.json()['id']}/history")).json()
        assert [entry["id"] for entry in entries] == [first["id"], reverted.json()["id"]]
        missing = await client.post("/v1/models/nothing/revert", json={"version": 1})
        expect_problem(missing, 404)

    talk(settings, workers, conversation)


def test_a_model_that_cannot_be_used_is_refused(http: Http, bench: Workbench) -> None:
    bench.refusal = ModelError("model.json", "not a joulepath model", accepted="a file")
    expect_problem(http.post("/v1/models", json={"format": "?"}), 422)
    assert http.get("/v1/models").json() == []
    large = b" " * ((1 << 20) + 1)
    expect_problem(http.post("/v1/models", content=large, headers=JSON), 413)


SAVED_BY_HAND: dict[str, Any] = json.loads(SAVED)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({}, None),
        ({"name": ["x"]}, "name"),
        ({"version": "two"}, "version"),
        ({"version": 0}, "version"),
        ({"history": "x"}, "history"),
        ({"history": [{"version": 1}]}, "history.0.action"),
        (
            {"history": [{**documents.entry(2), "after": {"rmse_w": "low"}}]},
            "history.0.after.rmse_w",
        ),
    ],
)
def test_what_the_service_reads_in_a_saved_model(
    changes: dict[str, Any], field: str | None
) -> None:
    document = {**SAVED_BY_HAND, **changes}
    if field is None:
        SavedModel.check(document)
        return
    with pytest.raises(ModelError) as caught:
        SavedModel.check(document)
    assert caught.value.field == field


def test_a_route_names_a_model_that_is_not_there(http: Http, bench: Workbench) -> None:
    route = {**GOOD, "vehicle": None, "model": "nothing"}
    document = expect_problem(http.post("/v1/routes", json=route), 422)
    assert document["field"] == "model"
    assert "GET /v1/models" in document["accepted"]
