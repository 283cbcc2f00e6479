"""Clients that hang up, over real connections to a server with real processes."""

from __future__ import annotations

import asyncio
import json
import statistics
import time
from contextlib import AbstractAsyncContextManager, suppress
from pathlib import Path
from typing import Any

import pytest

from service.http import create_app
from service.jobs import WorkerPool
from service.settings import Settings
from tests.service.conftest import ScriptedWorkers, listening
from tests.service.jobs.processes import WORKER, process_exists, run, until

PLACES = {"start": {"x": 1, "y": 1}, "goal": {"x": 2, "y": 1}}


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """A folder with a vehicle, beside whose file a process leaves a note."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "cart.toml").write_text("")
    return Settings(data_dir=tmp_path / "data", store_dir=tmp_path / "store")


def serving(settings: Settings) -> AbstractAsyncContextManager[int]:
    """The port of a service with two workers; jobs have none that are real."""
    pool = WorkerPool(workers=2, queue=16, time_limit_s=50.0, memory_limit_mb=4096, module=WORKER)
    return listening(create_app(settings, pool, ScriptedWorkers()))


async def ask(port: int, path: str, body: dict[str, Any] | None) -> Any:
    """A connection on which a request was sent."""
    content = b"" if body is None else json.dumps(body).encode()
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(
        f"{'GET' if body is None else 'POST'} {path} HTTP/1.1\r\nHost: service\r\n"
        f"Content-Type: application/json\r\nContent-Length: {len(content)}\r\n"
        "Connection: close\r\n\r\n".encode()
        + content
    )
    await writer.drain()
    return reader, writer


async def seconds(port: int) -> float:
    """How long another client waits for its route."""
    begun = time.monotonic()
    reader, writer = await ask(port, "/v1/routes", {"map": "steady", **PLACES})
    answered = await reader.read()
    writer.close()
    assert answered.startswith(b"HTTP/1.1 200")
    return time.monotonic() - begun


async def hang_up(port: int, notes: Path, path: str, body: dict[str, Any] | None) -> int:
    """Ask for what never ends, and hang up once it is worked on.

    Returns:
        the process that worked on it.
    """
    known = set(notes.glob("*.pid"))
    _, writer = await ask(port, path, body)
    try:
        await until(lambda: set(notes.glob("*.pid")) > known)
    finally:
        writer.close()
        with suppress(ConnectionError):
            await writer.wait_closed()
    (note,) = set(notes.glob("*.pid")) - known
    return int(note.read_text().split()[0])


def test_a_loop_of_hang_ups_starves_nobody(settings: Settings) -> None:
    endless = {"map": "endless", "vehicle": "cart.toml", **PLACES}
    notes = settings.data_dir or Path()

    async def loop(port: int) -> None:
        while True:
            await hang_up(port, notes, "/v1/routes", endless)

    async def talk() -> None:
        async with serving(settings) as port:
            await seconds(port)
            alone = statistics.median([await seconds(port) for _ in range(5)])
            rude = asyncio.ensure_future(loop(port))
            await until(lambda: any(notes.glob("*.pid")))
            beside = statistics.median([await seconds(port) for _ in range(5)])
            assert not rude.done()
            rude.cancel()
            await asyncio.gather(rude, return_exceptions=True)
            # Places held by clients that left are lost until the time limit of 50 s.
            assert beside <= 2.0 * alone + 1.0
            # They did hang up meanwhile, again and again.
            assert len(list(notes.glob("*.pid"))) > 5

    run(talk)


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/v1/routes", {"map": "endless", "vehicle": "cart.toml", **PLACES}),
        ("/v1/maps/heights.npy/relief", None),
        ("/v1/models", {"note": "NOTE"}),
    ],
)
def test_whatever_was_asked_for_ends_with_its_client(
    settings: Settings, path: str, body: dict[str, Any] | None
) -> None:
    notes = settings.data_dir or Path()
    (notes / "heights.npy").write_bytes(b"")
    if body and "note" in body:
        body = {"note": str(notes / "model")}

    async def talk() -> None:
        async with serving(settings) as port:
            pid = await hang_up(port, notes, path, body)
            begun = time.monotonic()
            await until(lambda: not process_exists(pid))
            assert time.monotonic() - begun < 10.0, "the time limit of 50 s ended it"

    run(talk)
