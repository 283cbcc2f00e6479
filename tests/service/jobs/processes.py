"""Worker processes that follow a script, and how tests wait for them."""

from __future__ import annotations

import asyncio
import os
import select
from collections.abc import Callable, Coroutine, Iterable
from pathlib import Path
from typing import Any

WORKER = "tests.service.jobs.obedient_worker"


def run(talk: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(asyncio.wait_for(talk(), timeout=60))


async def until(condition: Callable[[], bool]) -> None:
    while not condition():
        await asyncio.sleep(0.01)


def process_exists(pid: int) -> bool:
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    # A child that ended and was not collected yet is still listed.
    return "Z (zombie)" not in status


class Ends:
    """Waits for the ends of processes, which the kernel tells; made while they run."""

    def __init__(self, pids: Iterable[int]) -> None:
        self._waiting = {os.pidfd_open(pid): pid for pid in pids}

    def within(self, seconds: float) -> set[int]:
        """Wait until all ended, each for so long at most; returns those that did not."""
        late = set()
        for watched, pid in self._waiting.items():
            poll = select.poll()
            poll.register(watched, select.POLLIN)
            if not poll.poll(1000.0 * seconds):
                late.add(pid)
            os.close(watched)
        self._waiting.clear()
        return late
