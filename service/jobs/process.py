"""What a worker process does before and around its jobs.

    work(connection, "service.jobs.worker", memory_limit_mb=8192, cache_mb=1024)

This module is light, and the fork server has it loaded, so that a fresh worker imports nothing
before it begins.
"""

from __future__ import annotations

import builtins
import gc
import importlib
import os
import pickle
import resource
import signal
import sys
import time
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from planner.cache import CACHE
from planner.errors import InputError, JoulepathError
from service.lifetime import end_with_parent

_REPORT_EVERY_S = 0.1
"""Least time between two reports of a job."""
_arrived: float | None = None
_connection: Connection | None = None
_reported = 0.0


class Report(NamedTuple):
    """A job's progress: the share done, 0 to 1, and a sentence."""

    share: float
    sentence: str


class Outcome(NamedTuple):
    """How a job ended.

    Attributes:
        value: its result.
        error: what it raised, or None.
        resident_mb: memory that its process now takes; 0 where the system does not say.
    """

    value: Any
    error: Exception | None
    resident_mb: float


def work(connection: Connection, module: str, memory_limit_mb: int, cache_mb: int) -> None:
    """Carry out one job after the other until the service closes the connection.

    Args:
        connection: gives (job, arrived, arguments), takes Reports and one Outcome for each.
        module: of the jobs' functions; the service's own process never loads it.
        memory_limit_mb: address space that this process may use, in MiB.
        cache_mb: results that it may keep for later jobs, in MiB.
    """
    global _connection
    _settle_in()
    _bound_memory(memory_limit_mb)
    CACHE.most_bytes = min(CACHE.most_bytes, cache_mb << 20)
    _connection = connection
    while True:
        try:
            job, arrived, arguments = connection.recv()
        except (EOFError, OSError):
            return
        value, error = perform(module, job, arrived, arguments)
        try:
            connection.send(Outcome(value, error, _resident_mb()))
        except (pickle.PicklingError, TypeError, AttributeError) as problem:
            failure = RuntimeError(f"the result of {job} cannot be sent: {problem}")
            connection.send(Outcome(None, failure, _resident_mb()))
        # Nothing of a finished job stays while the process waits.
        del value, error, arguments


def perform(
    module: str, job: str, arrived: float, arguments: tuple[Any, ...]
) -> tuple[Any, Exception | None]:
    """The result of a job, or what it raised.

    An error of a class that the service's own process would have to load a package for, or could
    not rebuild, becomes a RuntimeError.

    Args:
        module: of the job's function.
        job: the function's name.
        arrived: time.monotonic() when the job was asked for; the clock is the whole system's.
        arguments: of the function.
    """
    global _arrived, _reported
    _arrived, _reported = arrived, 0.0
    try:
        value = getattr(importlib.import_module(module), job)(*arguments)
    except InputError as error:
        # Without a traceback: it is the user's mistake.
        return None, error.with_traceback(None)
    except Exception as error:
        return None, _portable(error)
    return (None, value) if isinstance(value, InputError) else (value, None)


def report(share: float, sentence: str) -> None:
    """Report to the service how far the job is; within 0.1 s of the last report it is skipped."""
    global _reported
    now = time.monotonic()
    if _connection is not None and now - _reported >= _REPORT_EVERY_S:
        _reported = now
        _connection.send(Report(float(share), str(sentence)))


def waited_s() -> float:
    """Seconds since this process's job was asked for; 0 outside of a job."""
    return 0.0 if _arrived is None else time.monotonic() - _arrived


def _settle_in() -> None:
    """Prepare a new process: it leads a group, so that what it starts can be ended with it.

    SIGTERM ends it at once, also in compiled code, where a handler in Python would have to wait.
    Ctrl-C is for the service, which ends its workers itself.
    """
    if sys.platform != "win32":
        os.setpgrp()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent()
    # What the fork server loaded stays for good; a collection need not look at it.
    gc.freeze()


def _portable(error: Exception) -> Exception:
    """The error, or one that pickle can put together again without another package."""
    known = isinstance(error, JoulepathError)
    if known or type(error) is getattr(builtins, type(error).__name__, None):
        error.add_note(traceback.format_exc())
        with suppress(Exception):
            pickle.loads(pickle.dumps(error))
            return error
    plain = RuntimeError(f"{type(error).__name__}: {error}")
    plain.add_note(traceback.format_exc())
    return plain


def _resident_mb() -> float:
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return 0.0
    return pages * resource.getpagesize() / 2**20


def _bound_memory(megabytes: int) -> None:
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = megabytes * 1024 * 1024
    soft = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
    resource.setrlimit(resource.RLIMIT_AS, (soft, most))
