"""The service says whether it can plan."""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path

import pytest

from service.http import create_app
from service.settings import Settings
from tests.service.conftest import Http, ScriptedWorkers, talking


def test_health_answers_without_a_worker(http: Http, workers: ScriptedWorkers) -> None:
    assert http.get("/healthz").json()["status"] == "ok"
    assert workers.asked == []
    workers.alive = False
    response = http.get("/healthz")
    assert (response.status_code, response.json()["status"]) == (503, "failing")


@pytest.mark.parametrize(
    ("gone", "said"),
    [
        (".", "folder incoming was removed"),
        ("logs", "folder logs was removed"),
        ("joulepath.db", "database's file was removed"),
    ],
)
def test_a_store_that_is_deleted_meanwhile_shows(
    workers: ScriptedWorkers, settings: Settings, gone: str, said: str
) -> None:
    async def talk() -> None:
        async with talking(create_app(settings, workers)) as client:
            assert (await client.get("/healthz")).json()["store"] == "ok"
            path = (settings.store_dir or Path()) / gone
            shutil.rmtree(path) if path.is_dir() else path.unlink()
            answer = await client.get("/healthz")
            assert (answer.status_code, answer.json()["status"]) == (503, "failing")
            assert said in answer.json()["store"]
            # Anybody may ask: where the store is stays unsaid.
            assert str(settings.store_dir) not in answer.text

    asyncio.run(talk())
