"""A workbench whose workers answer in this process, and conversations with it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import httpx

from service.http import create_app
from service.jobs.outcomes import Adopted
from service.jobs.tasks import Task
from service.settings import Settings
from tests.service import telemetry_documents as documents
from tests.service.conftest import ScriptedWorkers, talking
from tests.service.route_documents import answer

CSV = b"run,time,vx,vy,wz,power\n1,1,0.5,0,0,12\n"
FOUND = {
    "rows": 1,
    "runs": 1,
    "duration_s": 1.0,
    "present": ["power", "vx"],
    "report": [{"kind": "gap", "column": "time", "rows": 1, "sentence": "a gap"}],
    "derived": [],
    "assumed": ["flat"],
}
SAVED = json.dumps(documents.model_document(2), indent=2) + "\n"


class Workbench:
    """Does in this process what a worker would, and remembers each task."""

    def __init__(self) -> None:
        self.tasks: list[tuple[str, Any]] = []
        self.read: list[bytes] = []
        self.refusal: Exception | None = None
        self.hang = False
        self.saved = SAVED

    def __call__(self, job: str, arguments: tuple[Any, ...]) -> Any:
        if job == "plan_route":
            return json.dumps(answer())
        if job == "ground":
            return json.dumps({"report": ""})
        if job == "demo_log":
            return CSV
        self.tasks.append((job, arguments[0]))
        if self.refusal is not None:
            raise self.refusal
        if self.hang:
            return asyncio.Event().wait()
        if job == "check":
            task: Task = arguments[0]
            self.read.append((Path(task.folder) / task.log).read_bytes())
            return FOUND
        return {
            "compare": {**documents.comparison(), "pictures": {"curves": {}, "cloud": {}}},
            "diagnose": documents.diagnosis(),
            "adopt": Adopted(documents.adoption(), SAVED),
            "revert": json.dumps(documents.model_document(3)),
            "check_model": self.saved,
        }[job]


def talk(
    settings: Settings,
    workers: ScriptedWorkers,
    conversation: Callable[[httpx.AsyncClient], Coroutine[Any, Any, None]],
) -> None:
    """Several requests to one service."""

    async def all_of_it() -> None:
        async with talking(create_app(settings, workers)) as client:
            await conversation(client)

    asyncio.run(asyncio.wait_for(all_of_it(), timeout=60))


async def upload(client: httpx.AsyncClient, content: bytes = CSV, **named: Any) -> httpx.Response:
    return await client.post("/v1/logs", files={"log": ("drive.csv", content)}, **named)


async def finished(client: httpx.AsyncClient, job: str) -> dict[str, Any]:
    while (found := (await client.get(f"/v1/jobs/{job}")).json())["state"] in ("queued", "running"):
        await asyncio.sleep(0.01)
    return dict(found)
