"""A worker lives for many jobs, works on one at a time, and takes no other with it when it ends."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from planner.errors import MapError
from planner.progress import silent
from service.jobs import WorkerPool
from service.jobs.worker_process import WorkerProcess
from service.problems import Busy, TookTooLong, WorkerLost
from tests.service.jobs.processes import WORKER, process_exists, run, until


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


def test_a_process_killed_before_its_first_job_is_lost_at_once() -> None:
    """Its job waited for ever where nobody was left at the other end of the connection."""
    context = multiprocessing.get_context("forkserver")
    worker = WorkerProcess(context, WORKER, memory_limit_mb=4096, cache_mb=64)
    worker.kill()
    lost: list[type[BaseException]] = []

    def carry_out() -> None:
        try:
            worker.carry_out("add_one", time.monotonic(), (), silent)
        except WorkerLost as error:
            lost.append(type(error))

    thread = threading.Thread(target=carry_out, daemon=True)
    thread.start()
    thread.join(20.0)
    assert lost == [WorkerLost]
    worker.end()


def test_a_process_serves_many_jobs() -> None:
    async def talk() -> None:
        async with pool(workers=1) as workers:
            assert [await workers.run("add_one") for _ in range(3)] == [1, 2, 3]

    run(talk)


@pytest.mark.parametrize("worn", [{"keep_s": 0.0}, {"keep_mb": 1}])
def test_a_process_that_is_too_old_or_too_large_is_replaced(worn: dict[str, Any]) -> None:
    async def talk() -> None:
        async with pool(workers=1, **worn) as workers:
            assert [await workers.run("add_one") for _ in range(3)] == [1, 1, 1]

    run(talk)


def test_half_of_the_memory_it_may_keep_is_cache() -> None:
    async def talk() -> None:
        async with pool(keep_mb=500) as workers:
            assert await workers.run("cache_bytes") == 250 * 2**20

    run(talk)


def test_a_job_that_meets_a_dead_or_dying_process_gets_a_fresh_one(tmp_path: Path) -> None:
    """Killed while idle, and in the middle of a job; both are carried out all the same."""

    async def talk() -> None:
        async with pool(workers=1) as workers:
            os.kill(await workers.run("pid"), signal.SIGKILL)
            assert await workers.run("add_one") == 1
            note = tmp_path / "pid"
            job = asyncio.ensure_future(workers.run("hang_once", str(note)))
            await until(lambda: note.exists() and note.read_text() != "")
            os.kill(int(note.read_text()), signal.SIGKILL)
            assert await job == "done by another"

    run(talk)


def test_what_a_job_started_ends_with_its_process(tmp_path: Path) -> None:
    async def talk() -> None:
        note = tmp_path / "pid"
        async with pool(workers=1) as workers:
            job = asyncio.ensure_future(workers.run("start_another", str(note)))
            await until(lambda: note.exists() and note.read_text() != "")
            job.cancel()
            pid = int(note.read_text())
            await until(lambda: not process_exists(pid))

    run(talk)


def test_progress_is_told_while_a_job_runs(tmp_path: Path) -> None:
    async def talk() -> None:
        told: list[tuple[float, str]] = []
        async with pool(workers=1) as workers:
            job = asyncio.ensure_future(
                workers.run(
                    "report_half",
                    str(tmp_path / "go"),
                    progress=lambda share, sentence: told.append((share, sentence)),
                )
            )
            await until(lambda: told == [(0.5, "half way")])
            assert not job.done()
            (tmp_path / "go").touch()
            await job

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


def test_a_refusal_does_not_tell_where_the_service_keeps_its_files() -> None:
    async def talk() -> None:
        async with pool(folders=(Path("/srv/maps"),)) as workers:
            with pytest.raises(MapError) as caught:
                await workers.run("refuse_file", "/srv/maps/halls/a.tif")
            assert "/srv" not in str(caught.value)
            assert caught.value.field == "halls/a.tif [grid]"
            assert caught.value.value == "halls/a.tif"

    run(talk)


def test_a_killed_worker_fails_its_own_job_only() -> None:
    async def talk() -> None:
        async with pool() as workers:
            lost, kept = await asyncio.gather(
                workers.run("die"), workers.run("add_one"), return_exceptions=True
            )
            assert isinstance(lost, WorkerLost)
            assert kept == 1
            assert await workers.run("add_one") == 2  # in the process that was spared

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


def test_what_no_client_asks_for_has_no_time_limit() -> None:
    async def talk() -> None:
        async with pool(time_limit_s=1e-3) as workers:
            with pytest.raises(TookTooLong):
                await workers.run("add_one")
            assert await workers.run("add_one", limited=False) == 1

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
            # Two are present and none was measured: one after the other, 1 s each.
            assert caught.value.retry_after_s == 2
            for job in jobs:
                job.cancel()
            await asyncio.gather(*jobs, return_exceptions=True)
            assert await workers.run("add_one") == 1

    run(talk)


def test_an_hour_in_the_queue_is_never_announced_where_the_time_limit_ends_it() -> None:
    async def talk() -> None:
        async with pool(workers=1, queue=0, time_limit_s=3.0) as workers:
            workers._pace.add(3600.0)
            job = asyncio.ensure_future(workers.run("wait_for", "never"))
            await until(lambda: workers.state()["busy"] == 1)
            with pytest.raises(Busy) as caught:
                await workers.run("add_one")
            assert caught.value.retry_after_s == 3
            job.cancel()

    run(talk)


def test_memory_is_bounded() -> None:
    async def talk() -> None:
        async with pool(memory_limit_mb=1024) as workers:
            with pytest.raises(WorkerLost):
                await workers.run("take_memory", 2000)
            assert await workers.run("take_memory", 100) == 100 * 1024 * 1024

    run(talk)


async def in_compiled_code(workers: WorkerPool, note: Path) -> tuple[asyncio.Future[Any], int]:
    """A job whose process does not return to the interpreter, and that process."""
    job = asyncio.ensure_future(workers.run("burn", str(note)))
    await until(note.exists)
    return job, int(note.read_text().split()[0])


def test_a_hundred_that_hang_up_free_their_cores_at_once(tmp_path: Path) -> None:
    """In compiled code nothing of Python runs, a handler of a signal neither."""
    taken: list[float] = []

    async def hang_up(workers: WorkerPool, name: str) -> None:
        for number in range(50):
            job, pid = await in_compiled_code(workers, tmp_path / f"{name}{number}")
            begun = time.monotonic()
            job.cancel()
            await until(lambda pid=pid: not process_exists(pid))  # type: ignore[misc]
            taken.append(time.monotonic() - begun)

    async def talk() -> None:
        async with pool() as workers:
            await asyncio.gather(hang_up(workers, "a"), hang_up(workers, "b"))

    run(talk)
    assert len(taken) == 100
    assert statistics.median(taken) <= 0.5
    # On a machine that others load, a single one may be late, but not by seconds.
    assert max(taken) <= 2.0


def test_one_that_is_cancelled_in_the_queue_never_gets_a_process(tmp_path: Path) -> None:
    async def talk() -> None:
        async with pool(workers=1, queue=8) as workers:
            first = asyncio.ensure_future(workers.run("wait_for", str(tmp_path / "go")))
            waiting = [
                asyncio.ensure_future(workers.run("burn", str(tmp_path / str(k)))) for k in range(5)
            ]
            last = asyncio.ensure_future(workers.run("add_one"))
            await until(lambda: workers.state()["waiting"] == 6)
            for job in waiting:
                job.cancel()
            await asyncio.gather(*waiting, return_exceptions=True)
            (tmp_path / "go").touch()
            assert await last == 1
            await first
            assert [path.name for path in tmp_path.iterdir()] == ["go"]

    run(talk)


def test_the_time_limit_counts_in_the_queue_too(tmp_path: Path) -> None:
    """The first job has no limit: were it ended by its own, its place would go to the second."""

    async def talk() -> None:
        async with pool(workers=1, queue=2, time_limit_s=1.0) as workers:
            go = str(tmp_path / "go")
            first = asyncio.ensure_future(workers.run("wait_for", go, limited=False))
            await until(lambda: workers.state()["busy"] == 1)
            begun = time.monotonic()
            with pytest.raises(TookTooLong, match="limit of 1 s"):
                await workers.run("burn", str(tmp_path / "started"))
            assert time.monotonic() - begun >= 1.0
            assert not first.done()
            Path(go).touch()
            await first
            assert await workers.run("add_one") == 1
            assert not (tmp_path / "started").exists()

    run(talk)


def test_a_job_knows_how_long_ago_it_was_asked_for(tmp_path: Path) -> None:
    async def talk() -> None:
        async with pool(workers=1) as workers:
            first = asyncio.ensure_future(workers.run("wait_for", str(tmp_path / "go")))
            await until(lambda: workers.state()["busy"] == 1)
            begun = time.monotonic()
            second = asyncio.ensure_future(workers.run("waited_s"))
            await until(lambda: time.monotonic() - begun > 0.5)
            (tmp_path / "go").touch()
            assert 0.5 < await second < time.monotonic() - begun
            await first

    run(talk)


def test_an_error_of_another_package_is_told_and_breaks_nothing() -> None:
    async def talk() -> None:
        async with pool(workers=1) as workers:
            with pytest.raises(RuntimeError, match="Foreign: this and that"):
                await workers.run("fail_abroad")
            assert workers.state()["alive"]
            assert await workers.run("add_one") == 1

    run(talk)


def test_a_fresh_process_has_everything_loaded() -> None:
    async def talk() -> None:
        async with pool(workers=1, keep_s=0.0) as workers:
            await workers.run("add_one")
            taken = [await workers.run("cpu_s") for _ in range(5)]
            # To import the pool's module takes 0.25 s.
            assert min(taken) < 0.1

    run(talk)


SERVICE = """
import asyncio, sys
from service.jobs import WorkerPool

async def serve(*notes):
    workers = WorkerPool(
        workers=2, queue=1, time_limit_s=60, memory_limit_mb=4096,
        module="tests.service.jobs.obedient_worker",
    )
    await workers.start()
    await asyncio.gather(*(workers.run("burn", note) for note in notes))

asyncio.run(serve(*sys.argv[1:]))
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_processes_end_with_their_service(tmp_path: Path, end: signal.Signals) -> None:
    notes = [tmp_path / "one", tmp_path / "other"]
    service = subprocess.Popen([sys.executable, "-c", SERVICE, *map(str, notes)])

    async def talk() -> None:
        await until(lambda: all(note.exists() for note in notes))
        # Both workers, and the fork server that started them.
        processes = {int(pid) for note in notes for pid in note.read_text().split()}
        assert len(processes) == 3
        begun = time.monotonic()
        service.send_signal(end)
        service.wait()
        await until(lambda: not any(map(process_exists, processes)))
        assert time.monotonic() - begun < 5.0

    try:
        run(talk)
    finally:
        service.kill()
