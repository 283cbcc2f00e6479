"""Worker processes behind a bounded queue.

    workers = WorkerPool(workers=2, queue=16, time_limit_s=120, memory_limit_mb=8192)
    await workers.start()
    text = await workers.run("solve", request)      # runs service.jobs.worker.solve(request)

A job that is cancelled or overdue takes its process with it and nothing else. One that ends
because its process was killed fails alone.
"""

from __future__ import annotations

import asyncio
import importlib
import multiprocessing
import resource
import signal
from concurrent.futures import TimeoutError as DeadlineError
from typing import Any, Protocol

from pebble import ProcessExpired, ProcessPool

from planner.errors import InputError
from service.problems import Busy, TookTooLong, WorkerLost

WORKER_MODULE = "service.jobs.worker"


class Workers(Protocol):
    """What the service needs of its workers; tests bring their own."""

    async def start(self) -> None:
        """Be ready for work."""

    async def stop(self) -> None:
        """End all work."""

    async def run(self, job: str, *arguments: Any) -> Any:
        """Result of a function of service.jobs.worker."""

    def state(self) -> dict[str, Any]:
        """How busy the workers are."""


def _perform(module: str, job: str, memory_limit_mb: int, arguments: tuple[Any, ...]) -> Any:
    _settle_in(memory_limit_mb)
    # Imported by name: the service's own process never loads the planner.
    return getattr(importlib.import_module(module), job)(*arguments)


def _settle_in(memory_limit_mb: int) -> None:
    """Prepare a new process: bounded memory, and Ctrl-C is for the service to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = memory_limit_mb * 1024 * 1024
    soft = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
    resource.setrlimit(resource.RLIMIT_AS, (soft, most))


class WorkerPool:
    """Fresh processes from a fork server that has everything loaded."""

    def __init__(
        self,
        *,
        workers: int,
        queue: int,
        time_limit_s: float,
        memory_limit_mb: int,
        advice: str = "ask for a smaller time_budget_s or fewer iterations",
        module: str = WORKER_MODULE,
    ) -> None:
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload([module])
        self._module = module
        self._pool = ProcessPool(max_workers=workers, max_tasks=1, context=context)
        self._workers = workers
        self._queue = queue
        self._time_limit_s = time_limit_s
        self._memory_limit_mb = memory_limit_mb
        self._advice = advice
        self._taken = 0

    async def start(self) -> None:
        """Start the processes; returns at once, the first job waits for them."""
        await asyncio.to_thread(lambda: self._pool.active)

    async def stop(self) -> None:
        """End all processes, working or not."""
        self._pool.stop()  # type: ignore[no-untyped-call]
        await asyncio.to_thread(self._pool.join)

    async def run(self, job: str, *arguments: Any) -> Any:
        """Carry out a job in a process of its own.

        Args:
            job: name of a function of service.jobs.worker.
            arguments: what it takes; must pickle.

        Raises:
            InputError: the job returned one.
            Busy: the queue is full.
            TookTooLong: the time limit was reached; its process was ended.
            WorkerLost: its process ended by itself.
        """
        if self._taken >= self._workers + self._queue:
            raise Busy(retry_after_s=max(1, round(self._queue / self._workers)))
        self._taken += 1
        try:
            future = self._pool.schedule(
                _perform,
                (self._module, job, self._memory_limit_mb, arguments),
                timeout=self._time_limit_s,
            )
            result = await asyncio.wrap_future(future)
        except DeadlineError:
            raise TookTooLong(
                f"no answer within the service's limit of {self._time_limit_s:g} s; {self._advice}"
            ) from None
        except (ProcessExpired, MemoryError):
            raise WorkerLost(
                "the process that worked on this request was ended, perhaps for lack of memory"
            ) from None
        finally:
            self._taken -= 1
        if isinstance(result, InputError):
            raise result
        return result

    def state(self) -> dict[str, Any]:
        """Number of workers, how many plan and how many requests wait."""
        return {
            "alive": bool(self._pool.active),
            "workers": self._workers,
            "busy": min(self._taken, self._workers),
            "waiting": max(0, self._taken - self._workers),
        }
