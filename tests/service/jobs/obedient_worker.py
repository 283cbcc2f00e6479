"""Jobs for tests of the pool: small, and wicked on demand."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from planner.cache import CACHE
from planner.errors import LogError, MapError
from planner.search.requests import PlanRequest
from service.jobs import process
from service.jobs.outcomes import Catalogues
from service.jobs.tasks import Task
from tests.service.route_documents import answer

count = 0


def add_one() -> int:
    """How often this process was asked."""
    global count
    count += 1
    return count


def pid() -> int:
    """Which process this is."""
    return os.getpid()


def cache_bytes() -> int:
    """How much this process keeps for later jobs."""
    return CACHE.most_bytes


def hang_once(pid_file: str) -> str:
    """Never end, but where another process tried before."""
    if os.path.exists(pid_file):
        return "done by another"
    hang(pid_file)
    return ""


def start_another(pid_file: str) -> None:
    """Wait for a process that ignores SIGTERM, and say which."""
    program = (
        "import os, signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); "
        f"open({pid_file!r}, 'w').write(str(os.getpid())); signal.pause()"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def report_half(path: str) -> None:
    """Report half of the work, and end when there is a file."""
    process.report(0.5, "half way")
    wait_for(path)


def refuse() -> MapError:
    """An answer that is a refusal."""
    return MapError("map", "is no map", value="x", accepted="a map")


def refuse_file(path: str) -> MapError:
    """A refusal that names a file everywhere."""
    return MapError(f"{path} [grid]", f"not in {path}", value=path, accepted=f"a map like {path}")


def fail() -> None:
    """An error that nobody expected."""
    raise ZeroDivisionError("by the test")


class Foreign(Exception):
    """An error that pickle takes apart and cannot put together again."""

    def __init__(self, one: str, other: str) -> None:
        super().__init__(f"{one} and {other}")


def fail_abroad() -> None:
    """An error of a package that the service's own process does not load."""
    raise Foreign("this", "that")


def cpu_s() -> float:
    """What this process took up to now, s."""
    return time.process_time()


def waited_s() -> float:
    """How long ago this was asked for, s."""
    return process.waited_s()


def wait_for(path: str) -> None:
    """End when there is a file."""
    while not os.path.exists(path):
        time.sleep(0.01)


def burn(pid_file: str) -> None:
    """Say which process this is and which started it, and never return to the interpreter."""
    unfinished = Path(pid_file + ".unfinished")
    unfinished.write_text(f"{os.getpid()} {os.getppid()}", encoding="utf-8")
    unfinished.replace(pid_file)
    sum(itertools.repeat(0))


def catalogues() -> Catalogues:
    """One map on which planning never ends, and one on which it takes as long on any machine."""
    maps = [{"name": name, "title": name} for name in ("endless", "steady")]
    return Catalogues(maps, [{"name": "minibalance"}], [], ("sound",))


STEADY_S = 0.5
"""How long planning takes on the map "steady", s. It takes no CPU, which others may use."""


def plan_route(request: PlanRequest, *options: bool | str) -> str:
    """A route; on the map "endless" a note beside the vehicle's file, and none."""
    if request.map == "endless":
        burn(f"{request.vehicle}.{os.getpid()}.pid")
    time.sleep(STEADY_S)
    return json.dumps(answer())


def relief(name: str, most: int, report: bool = False) -> None:
    """A note beside the map's file, and no picture."""
    burn(f"{name}.{os.getpid()}.pid")


def check_model(content: bytes) -> None:
    """A note where the model says, and no version."""
    burn(f"{json.loads(content)['note']}.{os.getpid()}.pid")


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


def compare(task: Task) -> dict[str, Any] | LogError:
    """What it was asked; with the vehicle "broken" a refusal, with "dead" no answer at all.

    With "patient" it is answered when the log's folder has a file "go".
    """
    if task.vehicle == "broken":
        return LogError(task.log, "has no column 'power'", accepted="columns")
    if task.vehicle == "dead":
        die()
    if task.vehicle == "patient":
        process.report(0.5, "half way")
        wait_for(str(Path(task.folder) / "go"))
    return {"vehicle": task.vehicle, "model": task.model, "folder": task.folder}


def diagnose(task: Task) -> None:
    """Report half of the work, say which process this is, and never end."""
    process.report(0.5, "half way")
    hang(str(Path(task.folder) / "pid"))
