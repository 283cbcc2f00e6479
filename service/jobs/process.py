"""What every worker process does before and around its job.

The pool sends ``perform`` to a worker by name. This module is light, and the fork server has it
loaded, so that a fresh worker imports nothing before it begins.
"""

from __future__ import annotations

import builtins
import importlib
import resource
import signal
import time
from typing import Any

from planner.errors import InputError, JoulepathError
from service.lifetime import end_with_parent

_arrived: float | None = None


def settle_in() -> None:
    """Prepare a new process: SIGTERM and the end of its service end it at once.

    Pebble sets a handler in Python for SIGTERM. Such a handler waits until compiled code returns
    to the interpreter, which takes seconds in a kernel or in OMPL, and pebble stops nothing else
    and starts nothing new until then.
    """
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent()


def perform(
    module: str, job: str, arrived: float, memory_limit_mb: int, arguments: tuple[Any, ...]
) -> Any:
    """Carry out one job in this process.

    Args:
        module: of the job's function; the service's own process never loads it.
        job: the function's name.
        arrived: time.monotonic() when the job was asked for; the clock is the whole system's.
        memory_limit_mb: address space that it may use, in MiB.
        arguments: of the function.

    Returns:
        its result, or the InputError that it raised.

    Raises:
        RuntimeError: the function failed with an error of a class that the service's own process
            would have to load a package for, or could not rebuild.
    """
    global _arrived
    _arrived = arrived
    _bound_memory(memory_limit_mb)
    try:
        return getattr(importlib.import_module(module), job)(*arguments)
    except InputError as error:
        # Returned, so that it arrives without a traceback.
        return error
    except JoulepathError:
        raise
    except Exception as error:
        if type(error) is getattr(builtins, type(error).__name__, None):
            raise
        raise RuntimeError(f"{type(error).__name__}: {error}") from error


def waited_s() -> float:
    """Seconds since this process's job was asked for; 0 outside of a job."""
    return 0.0 if _arrived is None else time.monotonic() - _arrived


def _bound_memory(megabytes: int) -> None:
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = megabytes * 1024 * 1024
    soft = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
    resource.setrlimit(resource.RLIMIT_AS, (soft, most))
