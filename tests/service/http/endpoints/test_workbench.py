"""The workbench's verbs are jobs."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import httpx
import pytest

from planner.errors import LogError
from service.settings import Settings
from tests.service import telemetry_documents as documents
from tests.service.conftest import ScriptedWorkers
from tests.service.http.exchanges import GOOD, expect_problem
from tests.service.workbench import SAVED, Workbench, finished, talk, upload


@pytest.mark.parametrize(
    ("verb", "document"), [("compare", documents.comparison()), ("diagnose", documents.diagnosis())]
)
def test_a_verb_is_a_job_and_waits_when_asked(
    bench: Workbench,
    workers: ScriptedWorkers,
    settings: Settings,
    verb: str,
    document: dict[str, Any],
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        asked = {"log": log, "vehicle": "minibalance"}
        response = await client.post(f"/v1/{verb}", json=asked)
        assert response.status_code == 202
        job = response.json()
        assert response.headers["location"] == f"/v1/jobs/{job['id']}"
        assert (job["kind"], job["request"]) == (verb, asked)
        done = await finished(client, job["id"])
        assert {**done["result"], "pictures": 0} == {**document, "pictures": 0}
        assert done["error"] is None
        waited = await client.post(f"/v1/{verb}", params={"wait": 20}, json=asked)
        assert (waited.status_code, waited.json()) == (200, done["result"])
        name, task = bench.tasks[-1]
        assert name == verb
        assert (task.vehicle, task.model, task.log) == ("minibalance", None, "drive.csv")
        listed = (await client.get("/v1/jobs")).json()
        assert [entry["kind"] for entry in listed] == [verb, verb, "check"]
        assert "result" not in listed[0]

    talk(settings, workers, conversation)


def test_adopting_keeps_a_version_that_plans(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        asked = {"log": log, "vehicle": "minibalance", "effects": "air_drag, viscous_drag"}
        adopted = (await client.post("/v1/adopt?wait=20", json=asked)).json()
        assert adopted["after"] == documents.adoption()["after"]
        assert bench.tasks[-1][1].effects == ("air_drag", "viscous_drag")
        model = adopted["model_id"]
        # The saved model, letter by letter.
        assert (await client.get(f"/v1/models/{model}")).text == SAVED
        (listed,) = (await client.get("/v1/models")).json()
        assert (listed["id"], listed["version"], listed["parent_id"]) == (model, 2, None)
        assert (await client.get(f"/v1/models/{model}/history")).json()[0]["id"] == model
        # A route with it: the worker gets the path of a file that holds it.
        route = {**GOOD, "vehicle": None, "model": model}
        assert (await client.post("/v1/routes", json=route)).status_code == 200
        request = workers.asked[-1][1][0]
        assert Path(request.model).read_text() == SAVED
        # The next adoption starts from it, and knows its parent.
        further = {"log": log, "model": model, "effects": ["diagnosed"]}
        second = (await client.post("/v1/adopt?wait=20", json=further)).json()["model_id"]
        assert Path(bench.tasks[-1][1].model).read_text() == SAVED
        parents = {m["id"]: m["parent_id"] for m in (await client.get("/v1/models")).json()}
        assert parents == {model: None, second: model}

    talk(settings, workers, conversation)


def test_a_formula_goes_to_the_worker_as_it_came(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    tow = {"name": "tow", "formula": "k * vx", "unit": "W", "parameters": {"k": {"unit": "N"}}}

    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        asked = {"log": log, "vehicle": "minibalance", "formula": tow}
        assert (await client.post("/v1/adopt?wait=20", json=asked)).status_code == 200
        assert bench.tasks[-1][1].definition == tow

    talk(settings, workers, conversation)


def test_a_refusal_of_the_planner_is_its_problem(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        bench.refusal = LogError("drive.csv", "has one run", accepted="two runs")
        asked = {"log": log, "vehicle": "minibalance"}
        response = await client.post("/v1/diagnose?wait=20", json=asked)
        assert expect_problem(response, 422)["accepted"] == "two runs"
        bench.refusal = ZeroDivisionError("secret detail")
        document = expect_problem(await client.post("/v1/diagnose?wait=20", json=asked), 500)
        assert "secret" not in json.dumps(document)

    talk(settings, workers, conversation)


def test_waiting_ends_when_the_job_is_cancelled(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        bench.hang = True
        asked = {"log": log, "vehicle": "minibalance"}
        waiting = asyncio.ensure_future(client.post("/v1/compare?wait=60", json=asked))
        while not (jobs := [j for j in await running(client) if j["kind"] == "compare"]):
            await asyncio.sleep(0.01)
        await client.delete(f"/v1/jobs/{jobs[0]['id']}")
        assert expect_problem(await waiting, 409)["detail"] == "the job was cancelled"

    async def running(client: httpx.AsyncClient) -> list[dict[str, Any]]:
        listed: list[dict[str, Any]] = (await client.get("/v1/jobs")).json()
        return [job for job in listed if job["state"] == "running"]

    talk(settings, workers, conversation)


def test_a_full_queue_says_when_to_come_back(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        bench.hang = True
        asked = {"log": log, "vehicle": "minibalance"}
        # One runs, two wait.
        for _ in range(3):
            assert (await client.post("/v1/compare", json=asked)).status_code == 202
        response = await client.post("/v1/compare", json=asked)
        expect_problem(response, 503)
        assert int(response.headers["retry-after"]) >= 1

    talk(settings, workers, conversation)
