"""One worker process as the service sees it: started when first needed, ended with all it started.

    worker = WorkerProcess(context, "service.jobs.worker", memory_limit_mb=8192, cache_mb=1024)
    text = worker.carry_out("plan_route", time.monotonic(), (request,), report)     # in a thread
    worker.kill()                                                                   # in another

Each process has a connection of its own, so that one that is killed disturbs no other.
"""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress
from multiprocessing.context import ForkServerContext
from threading import Lock
from typing import Any

from planner.progress import Progress
from service.jobs.process import Outcome, Report, work
from service.problems import WorkerLost

_LOST = "the worker process of this request ended, perhaps for lack of memory"


class WorkerProcess:
    """A process that carries out one job after the other.

    Args:
        context: starts the process.
        module: of the jobs' functions.
        memory_limit_mb: address space of the process, MiB.
        cache_mb: results that it may keep, MiB.

    Attributes:
        began: time.monotonic() when it was made.
        resident_mb: memory that it took after its last job, MiB.
    """

    def __init__(
        self, context: ForkServerContext, module: str, *, memory_limit_mb: int, cache_mb: int
    ) -> None:
        self.began = time.monotonic()
        self.resident_mb = 0.0
        self._connection, theirs = context.Pipe()
        self._theirs = theirs
        self._process = context.Process(
            target=work, args=(theirs, module, memory_limit_mb, cache_mb), daemon=True
        )
        self._lock = Lock()
        self._killed = False

    def carry_out(
        self, job: str, arrived: float, arguments: tuple[Any, ...], report: Progress
    ) -> Outcome:
        """How a job ended; blocks until then.

        Args:
            job: name of a function.
            arrived: time.monotonic() when the job was asked for.
            arguments: what it takes; must pickle.
            report: called in this thread with the job's progress.

        Raises:
            WorkerLost: the process ended by itself, was killed, or had not enough memory.
            OSError: the process could not be started.
        """
        self._start()
        try:
            self._connection.send((job, arrived, arguments))
            while isinstance(message := self._connection.recv(), Report):
                report(*message)
        except (EOFError, OSError):
            raise WorkerLost(_LOST) from None
        outcome: Outcome = message
        if isinstance(outcome.error, MemoryError):
            raise WorkerLost(_LOST)
        self.resident_mb = outcome.resident_mb
        return outcome

    def alive(self) -> bool:
        """Whether the process could take a job."""
        return not self._killed and self._process.is_alive()

    def kill(self) -> None:
        """End the process and what it started, whatever they do; returns at once."""
        with self._lock:
            self._killed = True
            if self._process.pid is None:
                return
        # What it started may outlive it for a moment, as the rest of its group.
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()

    def end(self) -> None:
        """Kill the process and wait until it is gone."""
        self.kill()
        if self._process.pid is not None:
            self._process.join()
        self._theirs.close()
        self._connection.close()

    def _start(self) -> None:
        if self._process.pid is not None:
            return
        with self._lock:
            if not self._killed:
                self._process.start()
            # So that the connection ends with the process, or at once where it was killed before.
            self._theirs.close()
