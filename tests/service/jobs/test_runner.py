"""Jobs in real processes: progress, cancelling, failures, restarts."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from planner.errors import RequestError
from service.jobs import Names, Runner, WorkerPool
from service.jobs import runner as runners
from service.problems import Busy, DatabaseLocked, NoSuch
from service.settings import Settings
from service.store import Store, now
from service.store import database as databases
from service.store.jobs import Jobs
from tests.service.conftest import locked
from tests.service.jobs.processes import WORKER, process_exists, run, until

UPLOAD = {"log": "l", "name": "drive.csv", "sha256": "ab", "mapped": False, "bytes": 1}
READ = {"rows": 1, "runs": 1, "report": [], "derived": [], "assumed": []}
VEHICLES = ["minibalance", "broken", "dead", "patient"]


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """A store in a folder of its own."""
    return Settings(store_dir=tmp_path / "store")


@asynccontextmanager
async def running(settings: Settings, **changes: Any) -> AsyncIterator[tuple[Runner, Store]]:
    """A runner with one slot over two real processes, and a store with the log "l".

    With ``start=False`` the test starts the runner.
    """
    store = Store.open(settings)
    if store.logs.get("l") is None:
        with store.database.session() as session:
            store.logs.add(session, UPLOAD, READ, now())
        store.files.log_folder("l").mkdir()
    pool = WorkerPool(workers=2, queue=2, time_limit_s=20.0, memory_limit_mb=4096, module=WORKER)
    await pool.start()
    names = Names({"map": [], "vehicle": VEHICLES, "model": ["sound"]}, None, store.model_file)
    start = changes.pop("start", True)
    runner = Runner(store, pool, names, **{"slots": 1, "queue": 2, **changes})
    if start:
        await runner.start()
    try:
        yield runner, store
    finally:
        await runner.stop()
        await pool.stop()
        store.close()


async def state_of(runner: Runner, job: str, state: str) -> dict[str, Any]:
    while (found := await runner.get(job))["state"] != state:
        await asyncio.sleep(0.01)
    return found


def test_a_job_is_done_and_its_result_kept(settings: Settings) -> None:
    async def talk() -> None:
        async with running(settings) as (runner, store):
            job = await runner.submit("compare", {"log": "l", "vehicle": "minibalance"})
            assert job["state"] == "queued"
            done = await runner.wait(job["id"], 20)
            assert (done["state"], done["progress"]["share"]) == ("done", 1.0)
            assert done["result"]["folder"] == str(store.files.log_folder("l"))
        async with running(settings) as (runner, _):
            assert (await runner.get(job["id"]))["result"] == done["result"]

    run(talk)


def test_progress_is_told_and_cancelling_kills_the_process_at_once(settings: Settings) -> None:
    async def talk() -> None:
        async with running(settings) as (runner, store):
            job = await runner.submit("diagnose", {"log": "l", "vehicle": "minibalance"})
            while (await runner.get(job["id"]))["progress"]["sentence"] != "half way":
                await asyncio.sleep(0.01)
            note = store.files.log_folder("l") / "pid"
            await until(lambda: note.exists() and note.read_text() != "")
            begun = time.monotonic()
            cancelled = await runner.cancel(job["id"])
            assert cancelled["state"] == "cancelled"
            assert cancelled["progress"]["share"] == 0.5
            await until(lambda: not process_exists(int(note.read_text())))
            assert time.monotonic() - begun < 1.0
            # Its slot is free again.
            after = await runner.submit("compare", {"log": "l", "vehicle": "minibalance"})
            assert (await runner.wait(after["id"], 20))["state"] == "done"
            # To cancel what is finished changes nothing.
            assert (await runner.cancel(after["id"]))["state"] == "done"

    run(talk)


def test_a_job_that_is_cancelled_in_the_database_ends(settings: Settings) -> None:
    """Another service, or a hand, changes the row; the renewal finds out."""

    async def talk() -> None:
        async with running(settings) as (runner, store):
            job = await runner.submit("diagnose", {"log": "l", "vehicle": "minibalance"})
            note = store.files.log_folder("l") / "pid"
            await until(lambda: note.exists() and note.read_text() != "")
            assert store.jobs.cancel(job["id"])
            await until(lambda: not process_exists(int(note.read_text())))
            assert (await runner.get(job["id"]))["state"] == "cancelled"

    run(talk)


def test_a_waiting_job_is_cancelled_without_ever_running(settings: Settings) -> None:
    async def talk() -> None:
        async with running(settings) as (runner, _):
            first = await runner.submit("diagnose", {"log": "l", "vehicle": "minibalance"})
            second = await runner.submit("compare", {"log": "l", "vehicle": "minibalance"})
            await state_of(runner, first["id"], "running")
            cancelled = await runner.cancel(second["id"])
            assert (cancelled["state"], cancelled["started_at"]) == ("cancelled", None)
            await runner.cancel(first["id"])

    run(talk)


def test_refusals_and_lost_workers_are_problems(settings: Settings) -> None:
    async def talk() -> None:
        async with running(settings) as (runner, _):
            refused = await runner.submit("compare", {"log": "l", "vehicle": "broken"})
            found = await runner.wait(refused["id"], 20)
            assert (found["state"], found["error"]["status"]) == ("failed", 422)
            assert found["error"]["field"] == "drive.csv"
            lost = await runner.submit("compare", {"log": "l", "vehicle": "dead"})
            found = await runner.wait(lost["id"], 20)
            assert (found["state"], found["error"]["status"]) == ("failed", 500)
            assert "ended" in found["error"]["detail"]

    run(talk)


def test_what_is_not_there_is_refused_at_once(settings: Settings) -> None:
    async def talk() -> None:
        async with running(settings) as (runner, store):
            for request, field in [
                ({"log": "x", "vehicle": "minibalance"}, "log"),
                ({"log": "l", "vehicle": "hovercraft"}, "vehicle"),
                ({"log": "l", "model": "x"}, "model"),
                ({"log": "l", "model": "sound"}, "model"),
            ]:
                with pytest.raises(RequestError) as caught:
                    await runner.submit("compare", request)
                assert caught.value.field == field
            with pytest.raises(NoSuch):
                await runner.get("nothing")
            assert store.jobs.newest(10) == []

    run(talk)


def test_more_jobs_than_may_wait_are_refused(settings: Settings) -> None:
    async def talk() -> None:
        async with running(settings, queue=1) as (runner, _):
            request = {"log": "l", "vehicle": "minibalance"}
            jobs = [await runner.submit("diagnose", request) for _ in range(2)]
            with pytest.raises(Busy):
                await runner.submit("diagnose", request)
            for job in jobs:
                await runner.cancel(job["id"])

    run(talk)


def test_stopping_fails_what_runs_and_keeps_what_waits(settings: Settings) -> None:
    async def talk() -> None:
        async with running(settings) as (runner, store):
            first = await runner.submit("diagnose", {"log": "l", "vehicle": "minibalance"})
            second = await runner.submit("compare", {"log": "l", "vehicle": "minibalance"})
            note = store.files.log_folder("l") / "pid"
            await until(lambda: note.exists() and note.read_text() != "")
        async with running(settings) as (runner, _):
            failed = await runner.get(first["id"])
            assert failed["state"] == "failed"
            assert "the service was stopped" in failed["error"]["detail"]
            assert (await runner.wait(second["id"], 20))["state"] == "done"
            # The worker in which the diagnosis hung is gone with its service.
            assert not process_exists(int(note.read_text()))

    run(talk)


def test_a_job_that_ran_when_the_service_was_killed_is_failed_on_start(settings: Settings) -> None:
    async def talk() -> None:
        store = Store.open(settings)
        job = store.jobs.create("compare", {"log": "l", "vehicle": "minibalance"})
        # Killed between two renewals: the row still says running, under a lease.
        assert store.jobs.begin(job["id"], until=time.time() + 10)
        store.close()
        async with running(settings) as (runner, _):
            found = await runner.get(job["id"])
            assert found["state"] == "failed"
            assert "start it again" in found["error"]["detail"]

    run(talk)


async def meets_the_lock(monkeypatch: pytest.MonkeyPatch, name: str) -> asyncio.Event:
    """Set when a change of a job's row was refused because the database was locked."""
    met, loop = asyncio.Event(), asyncio.get_running_loop()
    change = getattr(Jobs, name)

    def watched(jobs: Jobs, *arguments: Any, **named: Any) -> Any:
        try:
            return change(jobs, *arguments, **named)
        except DatabaseLocked:
            loop.call_soon_threadsafe(met.set)
            raise

    monkeypatch.setattr(Jobs, name, watched)
    return met


def test_a_finished_job_waits_for_a_locked_database(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(databases, "LOCK_PATIENCE_S", 0)
    monkeypatch.setattr(runners, "RENEWAL_S", 0.05)

    async def talk() -> None:
        async with running(settings) as (runner, store):
            job = await runner.submit("compare", {"log": "l", "vehicle": "patient"})
            while (await runner.get(job["id"]))["progress"]["sentence"] != "half way":
                await asyncio.sleep(0.01)
            renewing = await meets_the_lock(monkeypatch, "renew")
            finishing = await meets_the_lock(monkeypatch, "finish")
            with locked(store.files.folder):
                # It goes on although nobody can renew its lease, and comes to its end.
                await renewing.wait()
                (store.files.log_folder("l") / "go").touch()
                await finishing.wait()
                assert (await runner.get(job["id"]))["state"] == "running"
            done = await runner.wait(job["id"], 20)
            assert (done["state"], done["result"]["vehicle"]) == ("done", "patient")

    run(talk)


def locked_once(monkeypatch: pytest.MonkeyPatch, name: str, folder: Path) -> None:
    """Let the database be locked while a service for the first time changes a job's row so."""
    change, before = getattr(Jobs, name), [folder]

    def interrupted(jobs: Jobs, *arguments: Any, **named: Any) -> Any:
        if before:
            with locked(before.pop()):
                return change(jobs, *arguments, **named)
        return change(jobs, *arguments, **named)

    monkeypatch.setattr(Jobs, name, interrupted)


def test_a_job_begins_when_a_locked_database_is_free(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(databases, "LOCK_PATIENCE_S", 0)
    monkeypatch.setattr(runners, "RENEWAL_S", 0.05)
    monkeypatch.setattr(runners, "SWEEP_S", 0.01)

    async def talk() -> None:
        store = Store.open(settings)
        job = store.jobs.create("compare", {"log": "l", "vehicle": "minibalance"})
        async with running(settings, start=False) as (runner, _):
            locked_once(monkeypatch, "begin", store.files.folder)
            beginning = await meets_the_lock(monkeypatch, "begin")
            sweeping = await meets_the_lock(monkeypatch, "give_up_dead")
            with locked(store.files.folder):
                await runner.start()
                assert sweeping.is_set()
                submitted = asyncio.ensure_future(
                    runner.submit("compare", {"log": "l", "vehicle": "minibalance"})
                )
                with pytest.raises(DatabaseLocked):
                    await submitted
            # A later sweep finds the job, and the database is locked again when it begins.
            await beginning.wait()
            assert (await runner.wait(job["id"], 20))["state"] == "done"
        store.close()

    run(talk)


def test_leases_that_nobody_could_renew_count_from_anew(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another service must not take a lock that lasted longer than a lease for its owner's end."""
    # The other service waits for this one's sweeps; this one is refused while the lock lasts.
    elsewhere = Store.open(settings, "elsewhere/77/abcd")
    monkeypatch.setattr(databases, "LOCK_PATIENCE_S", 0)
    monkeypatch.setattr(runners, "RENEWAL_S", 0.05)
    monkeypatch.setattr(runners, "SWEEP_S", 0.01)
    clock = [1000.0]

    async def talk() -> None:
        async with running(settings, clock=lambda: clock[0]) as (runner, store):
            owner = elsewhere.jobs
            job = owner.create("compare", {"log": "l", "vehicle": "minibalance"})
            assert owner.begin(job["id"], until=clock[0] + runners.LEASE_S)
            sweeping = await meets_the_lock(monkeypatch, "give_up_dead")
            with locked(store.files.folder):
                clock[0] += 4 * runners.LEASE_S
                await sweeping.wait()
            swept = await counts(monkeypatch, "queued")
            await until(lambda: len(swept) >= 3)
            assert (await runner.get(job["id"]))["state"] == "running"
            assert owner.renew(job["id"], 0.5, "half way", until=clock[0] + runners.LEASE_S)
            # A sweep that this renewal refused counts from before the clock goes on.
            known = len(swept)
            await until(lambda: len(swept) >= known + 3)
            # Whose lease ends while the database is free is gone.
            clock[0] += 2 * runners.LEASE_S
            await state_of(runner, job["id"], "failed")
        elsewhere.close()

    run(talk)


async def counts(monkeypatch: pytest.MonkeyPatch, name: str) -> list[None]:
    """One entry for each time that a service asked for something of its jobs."""
    asked: list[None] = []
    ask = getattr(Jobs, name)

    def watched(jobs: Jobs) -> Any:
        asked.append(None)
        return ask(jobs)

    monkeypatch.setattr(Jobs, name, watched)
    return asked
