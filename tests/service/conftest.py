"""A service whose workers do what a test says, at once and in this process."""

from __future__ import annotations

import asyncio
import json
import sqlite3
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, closing, contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
import uvicorn
from fastapi import FastAPI

from planner.progress import Progress, silent
from service.http import create_app
from service.settings import Settings
from tests.service.jobs.processes import until
from tests.service.route_documents import answer


class ScriptedWorkers:
    """Answers every job with ``work`` and remembers what it was asked."""

    def __init__(self) -> None:
        self.work: Callable[[str, tuple[Any, ...]], Any] = lambda job, arguments: json.dumps(
            answer()
        )
        self.asked: list[tuple[str, tuple[Any, ...]]] = []
        self.alive = True
        self.tell: Progress = silent
        self.cancelled = 0

    async def start(self) -> None:
        """Nothing to start."""

    async def stop(self) -> None:
        """Nothing to stop."""

    async def run(
        self, job: str, *arguments: Any, progress: Progress = silent, limited: bool = True
    ) -> Any:
        """What the test's ``work`` gives; a coroutine is awaited."""
        if job == "catalogues":
            return SimpleNamespace(
                maps=[{"name": "warehouse", "title": "Warehouse"}],
                vehicles=[{"name": "minibalance", "battery_j": None}],
                effects=[{"name": "gravity"}],
                kinds=("sound",),
            )
        self.asked.append((job, arguments))
        self.tell = progress
        result = self.work(job, arguments)
        try:
            return await result if asyncio.iscoroutine(result) else result
        except asyncio.CancelledError:
            self.cancelled += 1
            raise

    def state(self) -> dict[str, Any]:
        """Idle."""
        return {"alive": self.alive, "workers": 1, "busy": 0, "waiting": 0}


@asynccontextmanager
async def talking(app: FastAPI) -> AsyncIterator[httpx.AsyncClient]:
    """A client of an application in this process, for as many requests as a test has."""
    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    async with (
        app.router.lifespan_context(app),
        httpx.AsyncClient(transport=transport, base_url="http://service") as client,
    ):
        yield client


@asynccontextmanager
async def listening(app: FastAPI, **options: Any) -> AsyncIterator[int]:
    """The port of a server in this process; options are those of uvicorn."""
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="error", **options))
    service = asyncio.ensure_future(server.serve())
    await until(lambda: server.started or service.done())
    try:
        yield server.servers[0].sockets[0].getsockname()[1]
    finally:
        server.should_exit = True
        await service


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """The database in a store's folder while another program changes something in it."""
    with closing(sqlite3.connect(folder / "joulepath.db", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        yield
        other.execute("ROLLBACK")


class Http:
    """Talks to an application in this process, without a server."""

    def __init__(self, app: FastAPI) -> None:
        self.app = app

    def request(self, method: str, path: str, **arguments: Any) -> httpx.Response:
        """One request, in a life of the application of its own."""

        async def talk() -> httpx.Response:
            async with talking(self.app) as client:
                return await client.request(method, path, **arguments)

        return asyncio.run(talk())

    def get(self, path: str, **arguments: Any) -> httpx.Response:
        """GET."""
        return self.request("GET", path, **arguments)

    def post(self, path: str, **arguments: Any) -> httpx.Response:
        """POST."""
        return self.request("POST", path, **arguments)


@pytest.fixture
def workers() -> ScriptedWorkers:
    """Workers that a test can give a script."""
    return ScriptedWorkers()


@pytest.fixture
def settings(tmp_path: Any) -> Settings:
    """Small limits, and a folder with one map and one vehicle."""
    folder = tmp_path / "data"
    (folder / "site").mkdir(parents=True)
    (folder / "site" / "yard.tif").write_bytes(b"")
    (folder / "cart.toml").write_text("")
    (tmp_path / "secret.tif").write_bytes(b"")
    (folder / "leak.tif").symlink_to(tmp_path / "secret.tif")
    return Settings(
        max_body_bytes=2048,
        max_time_budget_s=10,
        data_dir=folder,
        store_dir=tmp_path / "store",
        job_workers=1,
        job_queue=2,
        max_log_bytes=100_000,
    )


@pytest.fixture
def http(workers: ScriptedWorkers, settings: Settings) -> Http:
    """That service."""
    return Http(create_app(settings, workers))
