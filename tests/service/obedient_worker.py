"""Jobs for tests of the pool: small, and wicked on demand."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

from planner.errors import LogError, MapError
from service.jobs import progress
from service.jobs.tasks import Task

count = 0


def add_one() -> int:
    """How often this process was asked."""
    global count
    count += 1
    return count


def refuse() -> MapError:
    """An answer that is a refusal."""
    return MapError("map", "is no map", value="x", accepted="a map")


def fail() -> None:
    """An error that nobody expected."""
    raise ZeroDivisionError("by the test")


def hang(pid_file: str) -> None:
    """Say which process this is and never end."""
    with open(pid_file, "w", encoding="utf-8") as file:
        file.write(str(os.getpid()))
    while True:
        signal.pause()


def die() -> None:
    """End this process at once, as the system does with one that takes all memory."""
    os.kill(os.getpid(), signal.SIGKILL)


def take_memory(megabytes: int) -> int:
    """Ask for memory."""
    return len(bytearray(megabytes * 1024 * 1024))


def compare_log(task: Task) -> dict[str, Any] | LogError:
    """What it was asked; with the vehicle "broken" a refusal, with "dead" no answer at all."""
    if task.vehicle == "broken":
        return LogError(task.log, "has no column 'power'", accepted="columns")
    if task.vehicle == "dead":
        die()
    return {"vehicle": task.vehicle, "model": task.model, "folder": task.folder}


def diagnose_log(task: Task) -> None:
    """Report half of the work, say which process this is, and never end."""
    progress.reporter(Path(task.progress))(0.5, "half way")
    hang(str(Path(task.folder) / "pid"))
