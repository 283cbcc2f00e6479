"""The service under many requests: what HTTP adds, workers that are killed, memory that stays.

python -m tests.benchmarks.serving_many            1,000 requests each; takes about ten minutes
python -m tests.benchmarks.serving_many 0.2        a fifth of them
"""

from __future__ import annotations

import json
import os
import random
import signal
import statistics
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import httpx

from planner import plan_route
from tests.benchmarks.serving import SHORT, served, workers_of

REQUESTS, LASTS_S, KILL_EVERY_S = 1000, 60.0, 5.0
KNOWN = {"map": "warehouse", "start": {"x": 1.5, "y": 2.0}, "goal": {"x": 27.0, "y": 17.0}}
ROUNDS, TIMES = 6, 3
GOALS = 50
"""Different places on the way of the requests whose memory is measured."""


def cpu_s(pids: set[int]) -> float:
    """CPU seconds of processes up to now."""
    ticks = 0
    for pid in pids:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def over_http() -> dict[str, Any]:
    """A known goal asked for again, over HTTP and in this process, in turns."""
    there: list[float] = []
    here: list[float] = []
    cpu_there = cpu_here = 0.0
    with served() as (process, address), httpx.Client(timeout=120.0) as client:
        ask(client, address, KNOWN)
        plan_route(KNOWN)
        # A second request of its kind compiles nothing and finds the first one's results.
        ask(client, address, KNOWN)
        plan_route(KNOWN)
        pids = {process.pid, *workers_of(process.pid)}
        for _ in range(ROUNDS):
            before, begun = cpu_s(pids), time.perf_counter()
            for _ in range(TIMES):
                ask(client, address, KNOWN)
            there.append((time.perf_counter() - begun) / TIMES)
            cpu_there += cpu_s(pids) - before
            before, begun = time.process_time(), time.perf_counter()
            for _ in range(TIMES):
                plan_route(KNOWN)
            here.append((time.perf_counter() - begun) / TIMES)
            cpu_here += time.process_time() - before
    asked = ROUNDS * TIMES
    cpu_there, cpu_here = cpu_there / asked, cpu_here / asked
    return {
        "cpu_s": {"over_http": round(cpu_there, 4), "in_process": round(cpu_here, 4)},
        "median_s": {
            "over_http": round(statistics.median(there), 4),
            "in_process": round(statistics.median(here), 4),
        },
        "requests": asked,
        "bar": "CPU over HTTP ≤ 1.3 times that in process + 0.01 s",
        "holds": cpu_there <= 1.3 * cpu_here + 0.01,
    }


def ask(client: httpx.Client, address: str, request: dict[str, Any]) -> int:
    """Status of an answer; 0 where there is none."""
    try:
        return client.post(f"{address}/v1/routes", json=request).status_code
    except httpx.HTTPError:
        return 0


@contextmanager
def _killing(pid: int, chance: random.Random, killed: list[int]) -> Iterator[None]:
    """Meanwhile one of a service's workers is killed again and again."""
    over = threading.Event()

    def loop() -> None:
        while not over.wait(KILL_EVERY_S):
            if workers := sorted(workers_of(pid)):
                killed.append(chance.choice(workers))
                os.kill(killed[-1], signal.SIGKILL)

    killer = threading.Thread(target=loop)
    killer.start()
    try:
        yield
    finally:
        over.set()
        killer.join()


def killed_workers(share: float = 1.0) -> dict[str, Any]:
    """Answers while workers are killed, for a minute and as many requests."""
    killed: list[int] = []
    statuses: list[int] = []
    numbers = count()
    with served() as (process, address), _killing(process.pid, random.Random(1), killed):
        until = time.monotonic() + share * LASTS_S

        def loop(_: int) -> None:
            with httpx.Client(timeout=120.0) as client:
                while next(numbers) < share * REQUESTS or time.monotonic() < until:
                    statuses.append(ask(client, address, SHORT))

        with ThreadPoolExecutor(2) as clients:
            list(clients.map(loop, range(2)))
    failed = sum(status != 200 for status in statuses)
    return {
        "requests": len(statuses),
        "killed": len(killed),
        "failed": failed,
        "bar": "none fails, those of killed workers included",
        "holds": failed == 0,
    }


def memory(share: float = 1.0) -> dict[str, Any]:
    """Resident memory of the service's process and of its workers, every hundred requests."""
    chance = random.Random(1)
    goals = [(chance.uniform(3.0, 14.0), chance.uniform(0.8, 2.2)) for _ in range(GOALS)]
    main: list[int] = []
    workers: list[int] = []
    with served() as (process, address), httpx.Client(timeout=120.0) as client:
        for number in range(1, round(share * REQUESTS) + 1):
            x, y = goals[number % GOALS]
            ask(client, address, {**SHORT, "goal": {"x": x, "y": y}})
            if number % 100 == 0:
                main.append(_resident_kb(process.pid))
                workers.append(max(map(_resident_kb, workers_of(process.pid))))
    growth = max(max(seen) / seen[0] - 1.0 for seen in (main, workers))
    return {
        "main_mb": [kb >> 10 for kb in main],
        "worker_mb": [kb >> 10 for kb in workers],
        "growth": round(growth, 3),
        "bar": "≤ 5 % after the first 100 requests",
        "holds": growth <= 0.05,
    }


def _resident_kb(pid: int) -> int:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    return 0


if __name__ == "__main__":
    part = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    for name, found in (
        ("over_http", over_http()),
        ("killed_workers", killed_workers(part)),
        ("memory", memory(part)),
    ):
        print(f"{name}: {json.dumps(found, ensure_ascii=False)}", flush=True)
