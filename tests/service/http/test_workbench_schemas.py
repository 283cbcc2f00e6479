"""The workbench's answers and examples are as the OpenAPI document describes them."""

from __future__ import annotations

from typing import Any

import httpx
import jsonschema

from service.settings import Settings
from tests.service.conftest import ScriptedWorkers
from tests.service.workbench import Workbench, finished, talk, upload


def test_answers_and_examples_fit_the_openapi_document(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        openapi = (await client.get("/openapi.json")).json()
        parts = {"components": openapi["components"]}

        def fits(document: Any, path: str, method: str, status: str) -> None:
            described = openapi["paths"][path][method]["responses"][status]
            schema = described["content"]["application/json"]["schema"]
            jsonschema.validate(document, {**schema, **parts})

        log = (await upload(client)).json()
        fits(log, "/v1/logs", "post", "201")
        fits((await client.get("/v1/logs")).json(), "/v1/logs", "get", "200")
        for verb in ("compare", "diagnose", "adopt"):
            path = f"/v1/{verb}"
            body = openapi["paths"][path]["post"]["requestBody"]["content"]["application/json"]
            jsonschema.validate(body["example"], {**body["schema"], **parts})
            asked = {**body["example"], "log": log["id"]}
            job = (await client.post(path, json=asked)).json()
            fits(job, path, "post", "202")
            done = await finished(client, job["id"])
            fits(done, "/v1/jobs/{job}", "get", "200")
            fits(done["result"], path, "post", "200")
        fits((await client.get("/v1/jobs")).json(), "/v1/jobs", "get", "200")
        models = (await client.get("/v1/models")).json()
        fits(models, "/v1/models", "get", "200")
        history = (await client.get(f"/v1/models/{models[0]['id']}/history")).json()
        fits(history, "/v1/models/{model}/history", "get", "200")

    talk(settings, workers, conversation)
