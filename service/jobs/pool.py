"""Worker processes behind a bounded queue.

    workers = WorkerPool(workers=2, queue=16, time_limit_s=120, memory_limit_mb=8192)
    await workers.start()
    text = await workers.run("plan_route", request)  # runs service.jobs.worker.plan_route(request)

A cancelled or overdue job ends its own process only. If a process is killed, only its job is
affected, which a fresh process then carries out.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from planner.progress import Progress, silent
from service.jobs.pace import Pace
from service.jobs.worker_process import WorkerProcess
from service.problems import Busy, TookTooLong, WorkerLost, without_folders

WORKER_MODULE = "service.jobs.worker"
_PRELOADED = ("service.jobs.process", "service.cli")
"""What a worker loads before it knows its job; the last one for the ``joulepath`` command, which
multiprocessing loads again in every process."""


class Workers(Protocol):
    """Interface of the workers; tests have their own."""

    async def start(self) -> None:
        """Be ready for work."""

    async def stop(self) -> None:
        """End all work."""

    async def run(
        self, job: str, *arguments: Any, progress: Progress = silent, limited: bool = True
    ) -> Any:
        """Result of a function of service.jobs.worker."""

    def state(self) -> dict[str, Any]:
        """How busy the workers are."""


@dataclass(kw_only=True, eq=False)
class WorkerPool:
    """Processes from a fork server that has everything loaded.

    Attributes:
        workers: number of processes.
        queue: number of further jobs that may wait.
        time_limit_s: s from a job's arrival to its end.
        memory_limit_mb: address space of a process, MiB.
        keep_mb: a process that takes more memory after a job is replaced, MiB; half of it is for
            results that later jobs may use.
        keep_s: a process that is older after a job is replaced, s; 0 gives every job a fresh one.
        advice: what to do about a job that takes too long.
        folders: whose place in the machine errors keep to themselves.
        module: module of the jobs' functions.
    """

    workers: int
    queue: int
    time_limit_s: float
    memory_limit_mb: int
    keep_mb: int = 2048
    keep_s: float = 3600.0
    advice: str = "ask for a smaller time_budget_s or fewer iterations"
    folders: tuple[Path, ...] = ()
    module: str = WORKER_MODULE

    def __post_init__(self) -> None:
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload([self.module, *_PRELOADED])
        # Each waits for a process; one more for each that sees to the end of another.
        self._threads = ThreadPoolExecutor(2 * self.workers, "worker")
        self._idle: list[WorkerProcess] = []
        self._tasks: set[_Task] = set()
        self._taken = 0
        self._places = asyncio.Semaphore(self.workers)
        self._pace = Pace(self.workers)
        self._alive = False

    async def start(self) -> None:
        """Take jobs; a process starts with the first one that needs it."""
        self._alive = True

    async def stop(self) -> None:
        """End all processes, working or not."""
        self._alive = False
        for task in self._tasks:
            task.cancel()
        while self._idle:
            await asyncio.to_thread(self._idle.pop().end)
        await asyncio.to_thread(self._threads.shutdown)

    async def run(
        self, job: str, *arguments: Any, progress: Progress = silent, limited: bool = True
    ) -> Any:
        """Carry out a job in a process that does nothing else meanwhile.

        Args:
            job: name of a function of service.jobs.worker.
            arguments: what it takes; must pickle.
            progress: called with the share done, 0 to 1, and a sentence.
            limited: whether the time limit holds; it is for what clients ask.

        Raises:
            InputError: the job raised one.
            Busy: the queue is full.
            TookTooLong: the time limit was reached, in the queue or in its process, which was
                ended.
            WorkerLost: its process ended by itself, and so did a fresh one.
        """
        if self._taken >= self.workers + self.queue:
            # Whatever is here now is gone after the time limit.
            longest = max(1, round(self.time_limit_s))
            raise Busy(min(self._pace.retry_after_s(self._taken), longest))
        self._taken += 1
        loop = asyncio.get_running_loop()

        def report(share: float, sentence: str) -> None:
            loop.call_soon_threadsafe(progress, share, sentence)

        task = _Task(job, time.monotonic(), arguments, report)
        try:
            async with asyncio.timeout(self.time_limit_s if limited else None):
                return await self._in_its_turn(task)
        except TimeoutError:
            raise TookTooLong(
                f"no answer within the service's limit of {self.time_limit_s:g} s; {self.advice}"
            ) from None
        finally:
            self._taken -= 1

    async def _in_its_turn(self, task: _Task) -> Any:
        """Wait for a place, first come first served, and for the result.

        The place of a cancelled job is free after its process has ended.
        """
        await self._places.acquire()
        begun = time.monotonic()
        self._tasks.add(task)

        def leave(_: asyncio.Future[Any]) -> None:
            self._pace.add(time.monotonic() - begun)
            self._tasks.discard(task)
            self._places.release()

        loop = asyncio.get_running_loop()
        work = asyncio.ensure_future(loop.run_in_executor(self._threads, self._carry_out, task))
        work.add_done_callback(leave)
        try:
            return await asyncio.shield(work)
        except asyncio.CancelledError:
            task.cancel()
            work.add_done_callback(lambda work: work.exception())  # nobody else asks for it
            raise

    def _carry_out(self, task: _Task) -> Any:
        """The result of a job; in a thread.

        A job whose process was lost gets a fresh one, once: who killed it, or what earlier jobs
        left there, is none of the job's business.
        """
        try:
            return self._attempt(task, self._free_worker())
        except WorkerLost:
            if task.cancelled or not self._alive:
                raise
        return self._attempt(task, self._new_worker())

    def _attempt(self, task: _Task, worker: WorkerProcess) -> Any:
        task.worker = worker
        if task.cancelled:
            worker.kill()
        try:
            outcome = worker.carry_out(task.job, task.arrived, task.arguments, task.report)
        except BaseException:
            worker.end()
            raise
        task.worker = None
        self._put_back(worker)
        if outcome.error is not None:
            raise without_folders(outcome.error, self.folders)
        return outcome.value

    def _free_worker(self) -> WorkerProcess:
        """The process that worked last, as it knows most of what is asked for now."""
        while self._idle:
            worker = self._idle.pop()
            if worker.alive():
                return worker
            worker.end()
        return self._new_worker()

    def _new_worker(self) -> WorkerProcess:
        return WorkerProcess(
            self._context,
            self.module,
            memory_limit_mb=self.memory_limit_mb,
            cache_mb=self.keep_mb // 2,
        )

    def _put_back(self, worker: WorkerProcess) -> None:
        old = time.monotonic() - worker.began >= self.keep_s
        if old or worker.resident_mb > self.keep_mb or not self._alive:
            worker.end()
        else:
            self._idle.append(worker)

    def state(self) -> dict[str, Any]:
        """Numbers of workers, of busy ones and of waiting requests."""
        return {
            "alive": self._alive,
            "workers": self.workers,
            "busy": min(self._taken, self.workers),
            "waiting": max(0, self._taken - self.workers),
        }


@dataclass(eq=False)
class _Task:
    """A job in the pool.

    Attributes:
        job, arrived, arguments, report: see WorkerProcess.carry_out.
        worker: the process that works on it.
        cancelled: whether nobody wants the result any more.
    """

    job: str
    arrived: float
    arguments: tuple[Any, ...]
    report: Progress
    worker: WorkerProcess | None = None
    cancelled: bool = False

    def cancel(self) -> None:
        """End the process that works on it; whichever comes next is ended at once."""
        self.cancelled = True
        if (worker := self.worker) is not None:
            worker.kill()
