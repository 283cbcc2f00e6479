"""Smaller promises of the planner: it stops when it is told to, stays the same, and keeps its size.

python -m tests.benchmarks.peers.checks                     all three, some four minutes

cancelling     how long an answer on a map of 1024² goes on after it was told to stop, at ten
               moments
determinism    two fresh processes, the same seed and a limit of iterations: the same digest
memory         resident memory after 100 and after 1,100 small requests, each to a new goal
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import time
from typing import Any

from planner import plan_route
from planner.errors import Cancelled
from tests.benchmarks.questions import fractal

SIZE = 1024
STOPS = tuple(0.05 + 0.1 * k for k in range(10))
"""Shares of an answer's time after which it is told to stop."""


def cancelling() -> dict[str, Any]:
    """How long an answer goes on after it was told to stop."""
    terrain, width = fractal(SIZE, 3), 0.25 * SIZE
    start, goal = {"x": 0.1 * width, "y": 0.15 * width}, {"x": 0.9 * width, "y": 0.9 * width}
    plan_route(terrain=terrain, start=start, goal=goal)
    goal = {"x": 0.8 * width, "y": 0.8 * width}
    begun = time.perf_counter()
    plan_route(terrain=terrain, start=start, goal=goal)
    taken = time.perf_counter() - begun
    late = []
    for number, part in enumerate(STOPS):
        goal = {"x": 0.8 * width + 0.1 * (number + 1), "y": 0.8 * width}
        late.append(_told_to_stop(terrain, start, goal, part * taken))
    return {
        "answer_s": round(taken, 3),
        "stopped_after_s": [None if s is None else round(s, 3) for s in late],
        "bar": "≤ 0.1 s",
        "holds": max(s for s in late if s is not None) <= 0.1,
    }


def _told_to_stop(terrain: Any, start: Any, goal: Any, after: float) -> float | None:
    """Seconds from the word to the end; None where the answer was there before."""
    begun = time.perf_counter()
    try:
        plan_route(
            terrain=terrain,
            start=start,
            goal=goal,
            cancelled=lambda: time.perf_counter() - begun > after,
        )
    except Cancelled:
        return time.perf_counter() - begun - after
    # Who stops once there is a route gets it instead of an error.
    ended = time.perf_counter() - begun - after
    return ended if ended > 0.0 else None


_ANSWER = """
import json, sys
from planner import plan_route
answer = plan_route(json.loads(sys.argv[1]))
sys.stdout.write(json.dumps(answer.to_json()["routes"][0]["poses"]))
sys.stdout.flush()
import os
os._exit(0)
"""


def determinism() -> dict[str, Any]:
    """Whether two fresh processes give the same poses, bit for bit."""
    request = {
        "map": "fractal-512",
        "start": {"x": 20, "y": 30},
        "goal": {"x": 100, "y": 95},
        "seed": 5,
        "iterations": 1000,
    }
    digests = set()
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", _ANSWER, json.dumps(request)], capture_output=True, check=True
        )
        digests.add(hashlib.sha256(done.stdout).hexdigest())
    return {"digests": len(digests), "bar": "1 digest", "holds": len(digests) == 1}


_MANY = """
import json, os, random, sys
from planner import plan_route
from planner.cache import CACHE
from planner.errors import InputError
from planner.terrain.catalogue import open_map
terrain = open_map("tilted-plane")
west, south, east, north = terrain.extent
draw = random.Random(1)
def resident():
    pages = int(open("/proc/self/statm").read().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
def place():
    return {"x": draw.uniform(west + 3, east - 3), "y": draw.uniform(south + 3, north - 3)}
done, found = 0, []
while done < 1100:
    try:
        plan_route(terrain=terrain, start=place(), goal=place())
    except InputError:
        continue
    done += 1
    if done in (100, 1100):
        found.append((resident(), CACHE.nbytes / 2**20))
print(json.dumps(found))
"""


def memory() -> dict[str, Any]:
    """MiB that a process grows by in 1,000 requests, beside what it keeps on purpose."""
    done = subprocess.run([sys.executable, "-c", _MANY], capture_output=True, text=True, check=True)
    (before, kept_before), (after, kept_after) = json.loads(done.stdout)
    kept = kept_after - kept_before
    return {
        "after_100_mib": round(before, 1),
        "after_1100_mib": round(after, 1),
        "of_it_kept_mib": round(kept, 1),
        "grown_mib": round(after - before - kept, 1),
        "bar": "≤ 10 MiB beside the fields that are kept, which have a limit",
        "holds": after - before - kept <= 10.0,
    }


def whole() -> dict[str, Any]:
    """All three."""
    return {"cancelling": cancelling(), "determinism": determinism(), "memory": memory()}


if __name__ == "__main__":
    print(json.dumps(whole(), indent=2, ensure_ascii=False))
