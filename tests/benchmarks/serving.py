"""The service under clients that hang up, its first starts side by side, and what it takes.

python -m tests.benchmarks.serving        needs a compiled planner; takes about four minutes
"""

from __future__ import annotations

import json
import os
import random
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

JOULEPATH = Path(sys.executable).with_name("joulepath")
SHORT: dict[str, Any] = {
    "map": "test-bench",
    "start": {"x": 1.0, "y": 1.5},
    "goal": {"x": 13.0, "y": 1.5},
}
LONG: dict[str, Any] = {
    "map": "jacksboro-1to100",
    "start": {"x": 93.0, "y": 225.0},
    "goal": {"x": 212.0, "y": 73.0},
    "time_budget_s": 60,
}
HANG_UPS, ROUNDS, ASKED = 100, 4, 3
EMPTY = """
import asyncio, statistics
from service.jobs import WorkerPool

async def measure():
    workers = WorkerPool(
        workers=1, queue=1, time_limit_s=120, memory_limit_mb=8192, keep_s=0.0,
        module="tests.benchmarks.empty_job",
    )
    await workers.start()
    taken = [await workers.run("cpu_s") for _ in range(11)]
    await workers.stop()
    print(statistics.median(taken[1:]))

asyncio.run(measure())
"""


def start(store: Path, **settings: str) -> subprocess.Popen[str]:
    """A service on a free port."""
    return subprocess.Popen(
        [JOULEPATH, "serve", "--port", "0"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "JOULEPATH_STORE_DIR": str(store), **settings},
    )


def address_of(process: subprocess.Popen[str]) -> str | None:
    """Where a service answers; None when it ended before it did."""
    assert process.stderr is not None
    for line in process.stderr:
        if found := re.search(r"running on (http://[\d.:]+)", line):
            return found[1]
    return None


@contextmanager
def served() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A service with two workers and its address."""
    with tempfile.TemporaryDirectory() as folder:
        process = start(Path(folder), JOULEPATH_WORKERS="2")
        try:
            address = address_of(process)
            assert address is not None
            yield process, address
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate()


def workers_of(pid: int) -> set[int]:
    """Children of a service's children: the fork server's processes."""
    return {worker for child in _children(pid) for worker in _children(child)}


def _children(pid: int) -> set[int]:
    try:
        return {
            int(child)
            for task in Path(f"/proc/{pid}/task").iterdir()
            for child in (task / "children").read_text().split()
        }
    except OSError:
        return set()


def _cpu_s(pid: int) -> float:
    """CPU seconds of a process up to now; −1 when it is gone."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return -1.0
    gone = fields[0] == "Z"
    return -1.0 if gone else (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def hang_up(address: str, after_s: float, pid: int | None = None) -> float:
    """Ask for a long answer and hang up.

    Args:
        address: of the service.
        after_s: how long to wait for it.
        pid: of the service; None where nobody wants to know when its core is free.

    Returns:
        seconds from hanging up until the process that worked most was gone.
    """
    host, _, port = address.removeprefix("http://").partition(":")
    body = json.dumps(LONG).encode()
    head = f"POST /v1/routes HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n"
    before = {worker: _cpu_s(worker) for worker in (workers_of(pid) if pid is not None else ())}
    with socket.create_connection((host, int(port))) as client:
        client.sendall(f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body)
        time.sleep(after_s)
        worked = {
            worker: _cpu_s(worker) - before.get(worker, 0.0)
            for worker in (workers_of(pid) if pid is not None else ())
        }
        most = max(worked, key=worked.__getitem__, default=0)
    begun = time.monotonic()
    while most and _cpu_s(most) >= 0.0:
        time.sleep(0.002)
    return time.monotonic() - begun


@contextmanager
def _hanging_up_again_and_again(address: str, chance: random.Random) -> Iterator[None]:
    over = threading.Event()

    def loop() -> None:
        while not over.is_set():
            hang_up(address, chance.uniform(0.1, 1.0))

    rude = threading.Thread(target=loop)
    rude.start()
    try:
        yield
    finally:
        over.set()
        rude.join()


def _asked(address: str) -> list[float]:
    """Seconds that each of some requests takes; one that is refused or overdue counts 60."""
    taken = []
    for _ in range(ASKED):
        begun = time.monotonic()
        try:
            ok = httpx.post(f"{address}/v1/routes", json=SHORT, timeout=60.0).is_success
        except httpx.HTTPError:
            ok = False
        taken.append(time.monotonic() - begun if ok else 60.0)
    return taken


def hanging_up() -> dict[str, Any]:
    """What clients that hang up do to another one and to the cores."""
    chance = random.Random(1)
    with served() as (process, address):
        _asked(address)
        alone, beside = [], []
        # In turns, so that what else the machine does falls on both.
        for _ in range(ROUNDS):
            alone += _asked(address)
            with _hanging_up_again_and_again(address, chance):
                beside += _asked(address)
        freed = [hang_up(address, chance.uniform(0.2, 1.0), process.pid) for _ in range(HANG_UPS)]
        resident = _resident_mb(process.pid)
    ratio = statistics.median(beside) / statistics.median(alone)
    return {
        "alone_s": round(statistics.median(alone), 2),
        "with_hang_ups_s": round(statistics.median(beside), 2),
        "worst_with_hang_ups_s": round(max(beside), 2),
        "ratio": round(ratio, 2),
        "core_free_s": {
            "median": round(statistics.median(freed), 3),
            "worst": round(max(freed), 3),
            "of": HANG_UPS,
        },
        "main_process_mb": resident,
        "bar": "another's request ≤ 2 times its time alone; a core is free in ≤ 0.5 s",
        "holds": ratio <= 2.0 and max(freed) <= 0.5,
    }


def _resident_mb(pid: int) -> int:
    status = Path(f"/proc/{pid}/status").read_text()
    return round(int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024)  # type: ignore[index]


def empty_job() -> dict[str, Any]:
    """CPU seconds of a fresh process for a job in which nothing is done."""
    done = subprocess.run([sys.executable, "-c", EMPTY], capture_output=True, text=True, check=True)
    seconds = float(done.stdout)
    return {"cpu_s": round(seconds, 4), "bar": "≤ 0.02 s", "holds": seconds <= 0.02}


def first_starts(rounds: int = 5, services: int = 4) -> dict[str, Any]:
    """How many services survive their first start on one empty database."""
    survived = 0
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            started = [start(Path(folder), JOULEPATH_WORKERS="1") for _ in range(services)]
            for process in started:
                address = address_of(process)
                if address and httpx.get(f"{address}/v1/jobs", timeout=60.0).is_success:
                    survived += 1
            for process in started:
                process.send_signal(signal.SIGINT)
                process.communicate()
    most = rounds * services
    return {"survived": survived, "of": most, "bar": "all", "holds": survived == most}


if __name__ == "__main__":
    for measure in (empty_job, hanging_up, first_starts):
        print(f"{measure.__name__}: {json.dumps(measure(), ensure_ascii=False)}", flush=True)
