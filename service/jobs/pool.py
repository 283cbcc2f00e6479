"""Worker processes behind a bounded queue.

    workers = WorkerPool(workers=2, queue=16, time_limit_s=120, memory_limit_mb=8192)
    await workers.start()
    text = await workers.run("plan_route", request)  # runs service.jobs.worker.plan_route(request)

A cancelled or overdue job ends its own process only. If a process is killed, only its job fails.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import time
from concurrent.futures import Future, wait
from dataclasses import dataclass
from typing import Any, Protocol

from pebble import ProcessExpired, ProcessPool

from planner.errors import InputError
from service.jobs.process import perform, settle_in
from service.problems import Busy, TookTooLong, WorkerLost

WORKER_MODULE = "service.jobs.worker"
_PRELOADED = ("service.jobs.process", "pebble", "service.cli")
"""What a worker loads before it knows its job; the last one for the ``joulepath`` command, which
multiprocessing loads again in every process."""
_TICK_S = 0.02


class Workers(Protocol):
    """Interface of the workers; tests have their own."""

    async def start(self) -> None:
        """Be ready for work."""

    async def stop(self) -> None:
        """End all work."""

    async def run(self, job: str, *arguments: Any) -> Any:
        """Result of a function of service.jobs.worker."""

    def state(self) -> dict[str, Any]:
        """How busy the workers are."""


@dataclass(kw_only=True, eq=False)
class WorkerPool:
    """Fresh processes from a fork server that has everything loaded.

    Attributes:
        workers: number of processes.
        queue: number of further jobs that may wait.
        time_limit_s: s from a job's arrival to its end.
        memory_limit_mb: address space of a process, MiB.
        advice: what to do about a job that takes too long.
        module: module of the jobs' functions.
    """

    workers: int
    queue: int
    time_limit_s: float
    memory_limit_mb: int
    advice: str = "ask for a smaller time_budget_s or fewer iterations"
    module: str = WORKER_MODULE

    def __post_init__(self) -> None:
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload([self.module, *_PRELOADED])
        self._pool = ProcessPool(
            max_workers=self.workers, max_tasks=1, initializer=settle_in, context=context
        )
        self._taken = 0
        self._places = asyncio.Semaphore(self.workers)
        self._leaving: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Start the processes; returns at once, the first job waits for them."""
        await asyncio.to_thread(lambda: self._pool.active)

    async def stop(self) -> None:
        """End all processes, working or not."""
        self._pool.stop()  # type: ignore[no-untyped-call]
        await asyncio.to_thread(self._pool.join)
        await asyncio.gather(*self._leaving)

    async def run(self, job: str, *arguments: Any) -> Any:
        """Carry out a job in a process of its own.

        Args:
            job: name of a function of service.jobs.worker.
            arguments: what it takes; must pickle.

        Raises:
            InputError: the job returned one.
            Busy: the queue is full.
            TookTooLong: the time limit was reached, in the queue or in its process, which was
                ended.
            WorkerLost: its process ended by itself.
        """
        if self._taken >= self.workers + self.queue:
            raise Busy(retry_after_s=max(1, round(self.queue / self.workers)))
        self._taken += 1
        arrived = time.monotonic()
        try:
            async with asyncio.timeout(self.time_limit_s):
                result = await self._in_its_turn(job, arrived, arguments)
        except TimeoutError:
            raise TookTooLong(
                f"no answer within the service's limit of {self.time_limit_s:g} s; {self.advice}"
            ) from None
        except (ProcessExpired, MemoryError):
            raise WorkerLost(
                "the worker process of this request ended, perhaps for lack of memory"
            ) from None
        finally:
            self._taken -= 1
        if isinstance(result, InputError):
            raise result
        return result

    async def _in_its_turn(self, job: str, arrived: float, arguments: tuple[Any, ...]) -> Any:
        """Wait for a free worker, first come first served, and for its result.

        Only then is pebble asked, which starts and ends a process for a job that was cancelled in
        its queue.
        """
        await self._places.acquire()
        future = None
        try:
            future = self._pool.schedule(
                perform, (self.module, job, arrived, self.memory_limit_mb, arguments)
            )
            return await asyncio.wrap_future(future)
        finally:
            if future is not None and future.cancelled():
                leaving = asyncio.ensure_future(self._leave(future))
                self._leaving.add(leaving)
                leaving.add_done_callback(self._leaving.discard)
            else:
                self._places.release()

    async def _leave(self, future: Future[Any]) -> None:
        """Free the place of a cancelled job after pebble has ended its process."""
        while self._pool.active and not wait([future], timeout=0).done:
            await asyncio.sleep(_TICK_S)
        self._places.release()

    def state(self) -> dict[str, Any]:
        """Numbers of workers, of busy ones and of waiting requests."""
        return {
            "alive": bool(self._pool.active),
            "workers": self.workers,
            "busy": min(self._taken, self.workers),
            "waiting": max(0, self._taken - self.workers),
        }
