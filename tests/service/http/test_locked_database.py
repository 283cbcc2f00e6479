"""A database that another program holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.settings import Settings
from service.store import database as databases
from tests.service.conftest import ScriptedWorkers, locked
from tests.service.http.exchanges import JSON, expect_problem
from tests.service.workbench import CSV, SAVED, Workbench, talk, upload


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("POST", "/v1/compare", {"json": {"log": "LOG", "vehicle": "minibalance"}}),
        ("POST", "/v1/logs", {"files": {"log": ("other.csv", CSV + b"1,2,0.5,0,0,12\n")}}),
        ("POST", "/v1/models", {"content": SAVED, "headers": JSON}),
        ("DELETE", "/v1/logs/LOG", {}),
    ],
)
def test_a_locked_database_is_said_with_when_to_try_again(
    settings: Settings,
    workers: ScriptedWorkers,
    bench: Workbench,
    monkeypatch: pytest.MonkeyPatch,
    method: str,
    path: str,
    body: dict[str, Any],
) -> None:
    monkeypatch.setattr(databases, "LOCK_PATIENCE_S", 0)

    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        asked = json.loads(json.dumps(body).replace("LOG", log)) if "json" in body else body
        where = path.replace("LOG", log)
        with locked(settings.store_dir or Path()):
            refused = await client.request(method, where, **asked)
            problem = expect_problem(refused, 503)
            assert problem["type"] == "urn:joulepath:problem:database-locked"
            assert "try again" in problem["detail"]
            # What only reads is answered.
            assert [entry["id"] for entry in (await client.get("/v1/logs")).json()] == [log]
        assert int(refused.headers["Retry-After"]) >= 1
        # Nothing was left behind, and the same request is good afterwards.
        folders = (settings.store_dir or Path()) / "logs"
        assert [folder.name for folder in folders.iterdir()] == [log]
        assert (await client.request(method, where, **asked)).status_code < 300

    talk(settings, workers, conversation)
