"""Every job has a process of its own, and takes nothing with it when it is ended."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from planner.errors import MapError
from service.jobs.pool import WorkerPool
from service.problems import Busy, TookTooLong, WorkerLost

WORKER = "tests.service.obedient_worker"


@asynccontextmanager
async def pool(**changes: Any) -> AsyncIterator[WorkerPool]:
    """Two workers, one place in the queue, 20 s, 4 GiB."""
    settings = {"workers": 2, "queue": 1, "time_limit_s": 20.0, "memory_limit_mb": 4096}
    made = WorkerPool(**{**settings, **changes}, module=WORKER)
    await made.start()
    try:
        yield made
    finally:
        await made.stop()


def run(talk: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(asyncio.wait_for(talk(), timeout=60))


async def until(condition: Callable[[], bool]) -> None:
    while not condition():
        await asyncio.sleep(0.01)


def process_exists(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    # A child that ended and was not collected yet is still listed.
    return "Z (zombie)" not in Path(f"/proc/{pid}/status").read_text()


def test_each_job_gets_a_fresh_process() -> None:
    async def talk() -> None:
        async with pool(workers=1) as workers:
            assert [await workers.run("add_one") for _ in range(3)] == [1, 1, 1]

    run(talk)


def test_a_refusal_is_raised_as_itself() -> None:
    async def talk() -> None:
        async with pool() as workers:
            with pytest.raises(MapError) as caught:
                await workers.run("refuse")
            assert (caught.value.field, caught.value.accepted) == ("map", "a map")
            with pytest.raises(ZeroDivisionError):
                await workers.run("fail")

    run(talk)


def test_a_killed_worker_fails_its_own_job_only() -> None:
    async def talk() -> None:
        async with pool() as workers:
            lost, kept = await asyncio.gather(
                workers.run("die"), workers.run("add_one"), return_exceptions=True
            )
            assert isinstance(lost, WorkerLost)
            assert kept == 1
            assert await workers.run("add_one") == 1

    run(talk)


def test_the_time_limit_ends_the_process(tmp_path: Path) -> None:
    async def talk() -> None:
        note = tmp_path / "pid"
        async with pool(time_limit_s=2.0) as workers:
            with pytest.raises(TookTooLong):
                await workers.run("hang", str(note))
            pid = int(note.read_text())
            await until(lambda: not process_exists(pid))
            assert workers.state()["busy"] == 0

    run(talk)


def test_cancelling_ends_the_process_and_frees_its_place(tmp_path: Path) -> None:
    async def talk() -> None:
        note = tmp_path / "pid"
        async with pool(workers=1, queue=0) as workers:
            job = asyncio.ensure_future(workers.run("hang", str(note)))
            await until(lambda: note.exists() and note.read_text() != "")
            job.cancel()
            with pytest.raises(asyncio.CancelledError):
                await job
            pid = int(note.read_text())
            await until(lambda: not process_exists(pid))
            assert await workers.run("add_one") == 1

    run(talk)


def test_more_than_the_queue_holds_is_refused(tmp_path: Path) -> None:
    async def talk() -> None:
        async with pool(workers=1, queue=1) as workers:
            jobs = [
                asyncio.ensure_future(workers.run("hang", str(tmp_path / str(k)))) for k in range(2)
            ]
            await until(lambda: workers.state()["waiting"] == 1)
            with pytest.raises(Busy) as caught:
                await workers.run("add_one")
            assert caught.value.retry_after_s >= 1
            for job in jobs:
                job.cancel()
            await asyncio.gather(*jobs, return_exceptions=True)
            assert await workers.run("add_one") == 1

    run(talk)


def test_memory_is_bounded() -> None:
    async def talk() -> None:
        async with pool(memory_limit_mb=1024) as workers:
            with pytest.raises(WorkerLost):
                await workers.run("take_memory", 2000)
            assert await workers.run("take_memory", 100) == 100 * 1024 * 1024

    run(talk)
