"""Jobs: long work in worker processes, with progress, cancelling, and results that are kept.

    runner = Runner(store, workers, names, slots=1, queue=100)
    await runner.start()
    job = await runner.submit("diagnose", {"log": "…", "vehicle": "minibalance"})
    await runner.wait(job["id"], seconds=10)
    await runner.cancel(job["id"])

The row in the database is the truth. The service that runs a job renews its lease every second and
stops when the row is no longer its own; jobs of services that are gone are marked as failed, and
queued ones are taken by whoever has a worker free. While the database is locked work goes on, and
results wait for it; afterwards leases, which nobody could renew, count from anew.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

from sqlalchemy.orm import Session

from service import problems
from service.jobs.names import Names
from service.jobs.pace import Pace
from service.jobs.pool import Workers
from service.jobs.tasks import Task, prepare
from service.problems import Busy, DatabaseLocked, found
from service.store import LEASE_S, UNFINISHED, Store, now

STOPPED = "the service was stopped while this job ran; start it again"
_TICK_S = 0.2
"""Between two looks at a job that another process runs."""
RENEWAL_S = 1.0
"""Seconds between two renewals of a lease, and before a locked database is asked again."""
SWEEP_S = LEASE_S / 3
"""Seconds between two looks at jobs of other services; a lock as long as a lease meets one."""

T = TypeVar("T")


class Runner:
    """Runs the jobs of a store.

    Args:
        store: where jobs, logs and models are.
        workers: where they are carried out.
        names: what requests may name.
        slots: how many run at the same time.
        queue: how many may wait.
        clock: s since 1970, for leases.
    """

    def __init__(
        self,
        store: Store,
        workers: Workers,
        names: Names,
        *,
        slots: int,
        queue: int,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._store = store
        self._workers = workers
        self._names = names
        self._most = slots + queue
        self._pace = Pace(slots)
        self._slots = asyncio.Semaphore(slots)
        self._clock = clock
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._stopping = False
        # Before that, the database may have been locked for the owner of a job.
        self._leases_count_from = clock() + LEASE_S
        self._sweeper: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Settle what an earlier service left, and take up what waits."""
        await self._sweep_if_it_can()
        self._sweeper = asyncio.ensure_future(self._keep_sweeping())

    async def stop(self) -> None:
        """End all work; running jobs fail with a sentence, queued ones wait for the next start."""
        self._stopping = True
        if self._sweeper is not None:
            self._sweeper.cancel()
        tasks = [*self._tasks.values()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def submit(self, kind: str, request: dict[str, Any]) -> dict[str, Any]:
        """Queue a job.

        Args:
            kind: name of a function of service.jobs.worker that takes a Task.
            request: what service.jobs.tasks.prepare reads.

        Returns:
            the job as the service answers it.

        Raises:
            InputError: the request names something that is not there.
            Busy: too many jobs wait.
        """
        if len(self._tasks) >= self._most:
            raise Busy(self._pace.retry_after_s(len(self._tasks)))
        await asyncio.to_thread(prepare, request, self._store, self._names)
        job = await asyncio.to_thread(self._store.jobs.create, kind, request)
        self._spawn(job["id"])
        return job

    async def cancel(self, job: str) -> dict[str, Any]:
        """Cancel a job; a finished job is unchanged.

        Raises:
            NoSuch: there is no such job.
        """
        if await asyncio.to_thread(self._store.jobs.cancel, job) and job in self._tasks:
            self._tasks[job].cancel()
        return await self.get(job)

    async def get(self, job: str) -> dict[str, Any]:
        """A job as the service answers it.

        Raises:
            NoSuch: there is no such job.
        """
        return found(await asyncio.to_thread(self._store.jobs.get, job), "job", job)

    async def wait(self, job: str, seconds: float) -> dict[str, Any]:
        """The job when it is finished, or as it is after so many seconds."""
        deadline = time.monotonic() + seconds
        while True:
            row = await self.get(job)
            left = deadline - time.monotonic()
            if row["state"] not in UNFINISHED or left <= 0:
                return row
            if task := self._tasks.get(job):
                await asyncio.wait({task}, timeout=left)
            else:
                await asyncio.sleep(min(_TICK_S, left))

    def _spawn(self, job: str) -> None:
        if job not in self._tasks:
            task = asyncio.ensure_future(self._run(job))
            self._tasks[job] = task
            task.add_done_callback(lambda _: self._tasks.pop(job, None))

    async def _run(self, job: str) -> None:
        async with self._slots:
            jobs = self._store.jobs
            if not await self._patiently(lambda: jobs.begin(job, self._until())):
                return
            row = await self._patiently(lambda: jobs.get(job))
            if row is None:
                return
            kind, request = row["kind"], row["request"]
            finish: Callable[[], Any] | None = None
            try:
                task = await self._patiently(partial(prepare, request, self._store, self._names))
                outcome = await self._work(job, kind, task)
                complete = partial(self._complete, kind, request, outcome)
                finish = partial(jobs.finish, job, complete)
                await self._patiently(finish)
            except asyncio.CancelledError:
                # Cancelled by a user or lost to another service: the row already says so.
                if self._stopping:
                    stopped = problems.document(500, "worker-lost", STOPPED)
                    # If the database is locked, the next service marks it as failed.
                    with suppress(DatabaseLocked):
                        (finish or partial(jobs.fail, job, stopped))()
                raise
            except Exception as error:
                await self._patiently(partial(jobs.fail, job, problems.describe(error)))
            finally:
                with suppress(DatabaseLocked):
                    self._tidy(kind, request)

    async def _patiently(self, change: Callable[[], T]) -> T:
        """Result of a change in the database, retried while the database is locked."""
        while True:
            try:
                return await asyncio.to_thread(change)
            except DatabaseLocked:
                await asyncio.sleep(RENEWAL_S)

    async def _work(self, job: str, kind: str, task: Task) -> Any:
        """The worker's outcome; meanwhile its progress is written to the row."""
        latest = [(0.0, "starting")]

        def report(share: float, sentence: str) -> None:
            latest[0] = min(max(share, 0.0), 1.0), sentence

        work = asyncio.ensure_future(self._workers.run(kind, task, progress=report))
        watch = asyncio.ensure_future(self._watch(job, work, latest))
        begun = time.monotonic()
        try:
            return await work
        finally:
            self._pace.add(time.monotonic() - begun)
            watch.cancel()
            work.cancel()

    async def _watch(
        self, job: str, work: asyncio.Future[Any], latest: list[tuple[float, str]]
    ) -> None:
        reported, renewed = latest[0], time.monotonic()
        while True:
            await asyncio.sleep(_TICK_S)
            if latest[0] == reported and time.monotonic() - renewed < RENEWAL_S:
                continue
            reported, renewed = latest[0], time.monotonic()
            try:
                ours = await asyncio.to_thread(
                    self._store.jobs.renew, job, *reported, self._until()
                )
            except DatabaseLocked:
                continue
            if not ours:
                work.cancel()
                return

    def _complete(self, kind: str, request: dict[str, Any], outcome: Any, session: Session) -> Any:
        """Add rows for a finished job; returns its result."""
        if kind == "check":
            return self._store.logs.add(session, request, outcome, now())
        if kind == "adopt":
            parent = request.get("model")
            known = parent is not None and self._store.models.get(parent) is not None
            made = self._store.models.add(session, outcome.model, parent if known else None, now())
            return {**outcome.document, "model_id": made["id"]}
        return outcome

    def _tidy(self, kind: str, request: dict[str, Any]) -> None:
        """Remove an upload that did not become a log."""
        if kind == "check" and self._store.logs.get(request["log"]) is None:
            self._store.files.drop_log(request["log"])

    async def _sweep(self) -> None:
        jobs = self._store.jobs
        at = self._clock()
        if at < self._leases_count_from:
            # Only those whose process is gone.
            at = 0.0
        for job in await asyncio.to_thread(jobs.give_up_dead, at):
            row = await self.get(job)
            self._tidy(row["kind"], row["request"])
        for job in await asyncio.to_thread(jobs.queued):
            self._spawn(job)

    async def _sweep_if_it_can(self) -> None:
        try:
            await self._sweep()
        except Exception as error:
            # A database that is unreachable for a moment must not end the sweeping.
            problems.describe(error)
            self._leases_count_from = self._clock() + LEASE_S

    async def _keep_sweeping(self) -> None:
        while True:
            await asyncio.sleep(SWEEP_S)
            await self._sweep_if_it_can()

    def _until(self) -> float:
        return self._clock() + LEASE_S
