"""How fast answers come: whole answers, a matrix of energies, fields up to 4096².

    python -m tests.benchmarks.planning                 everything, some five minutes on two cores
    python -m tests.benchmarks.planning --questions 2 --without fields matrix

How good the answers are, beside those of other planners: python -m tests.benchmarks.peers.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from planner import energy_matrix, plan_route
from planner.terrain.catalogue import open_map
from tests.benchmarks.questions import fractal, questions

PARTS = ("times", "matrix", "fields")


def times(count: int) -> dict[str, Any]:
    """Seconds for a whole answer: a new goal on 512² and 1024², another start to a known goal."""
    result: dict[str, Any] = {}
    for name, terrain in (("512", open_map("fractal-512")), ("1024", fractal(1024, 3))):
        asked = questions(terrain, count, 7)
        taken = []
        for one in asked:
            # Another goal than any before: a step beside it.
            goal = {"x": one["goal"]["x"] + 0.1, "y": one["goal"]["y"] + 0.1}
            begun = time.perf_counter()
            plan_route(terrain=terrain, start=one["start"], goal=goal)
            taken.append(time.perf_counter() - begun)
        result[f"new goal, {name}²"] = _spread(taken)
        goal, taken = asked[0]["goal"], []
        for one in asked:
            begun = time.perf_counter()
            plan_route(terrain=terrain, start=one["start"], goal=goal)
            taken.append(time.perf_counter() - begun)
        result[f"known goal, {name}²"] = _spread(taken[1:])
    result["bar"] = "new goal p50 ≤ 0.2 s and p95 ≤ 0.35 s, 1024² p50 ≤ 0.6 s; known p50 ≤ 0.06 s"
    result["holds"] = (
        result["new goal, 512²"]["p50_s"] <= 0.2
        and result["new goal, 512²"]["p95_s"] <= 0.35
        and result["new goal, 1024²"]["p50_s"] <= 0.6
        and result["known goal, 512²"]["p50_s"] <= 0.06
    )
    return result


def _spread(taken: Sequence[float]) -> dict[str, float]:
    return {
        "p50_s": float(np.quantile(taken, 0.5)),
        "p95_s": float(np.quantile(taken, 0.95)),
        "count": len(taken),
    }


def matrix(count: int = 50) -> dict[str, Any]:
    """Seconds for a matrix of 50 by 50 on 512², and its error on pairs that were not driven."""
    terrain = open_map("fractal-512")
    places = [asked["start"] for asked in questions(terrain, count, 11)]
    begun = time.perf_counter()
    found = energy_matrix(terrain=terrain, starts=places)
    taken = time.perf_counter() - begun
    errors = []
    for a, b in np.argwhere(~found.driven & ~np.eye(count, dtype=bool))[:: count * 2][:15]:
        single = plan_route(terrain=terrain, start=places[a], goal=places[b]).routes[0].energy_j
        errors.append(abs(100.0 * (float(found.energy_j[a, b]) / single - 1.0)))
    return {
        "seconds": taken,
        "bar": "≤ 15 s",
        "holds": taken <= 15.0,
        "said_percent": 100.0 * found.error_share,
        "median_error_percent": statistics.median(errors),
        "worst_error_percent": max(errors),
    }


_FIELD = """
import json, resource, sys, time
from planner.search.cost_to_go import cost_to_go
from planner.search.request import PlanRequest
from planner.search.situation import situation_of
from tests.benchmarks.questions import fractal
count = int(sys.argv[1])
asked = {"map": "x", "start": {"x": 5, "y": 5}, "goal": {"x": 10, "y": 10}}
def run(count):
    terrain = fractal(count, 3)
    begun = time.perf_counter()
    situation = situation_of(PlanRequest.from_json(asked), terrain=terrain)
    field = situation.field("energy")
    lattice = situation.lattice("energy", field)
    ready = time.perf_counter()
    middle = 0.125 * count
    found = cost_to_go(field, lattice, (middle, middle))
    return ready - begun, time.perf_counter() - ready, float(found.values.max())
run(64)
ground, seconds, _ = run(count)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
print(json.dumps({"ground_s": ground, "field_s": seconds, "peak_mib": peak}))
"""


def fields(sizes: Sequence[int] = (512, 1024, 2048, 4096)) -> dict[str, Any]:
    """Seconds and peak memory of one field that fills the map, each in a process of its own."""
    result: dict[str, Any] = {}
    for size in sizes:
        done = subprocess.run(
            [sys.executable, "-c", _FIELD, str(size)], capture_output=True, text=True, check=True
        )
        result[f"{size}²"] = json.loads(done.stdout)
    result["bar"] = "1024² ≤ 0.8 s; 4096² ≤ 15 s and ≤ 1,229 MiB"
    bars = {1024: (0.8, np.inf), 4096: (15.0, 1229.0)}
    result["holds"] = all(
        result[f"{size}²"]["field_s"] <= seconds and result[f"{size}²"]["peak_mib"] <= peak
        for size, (seconds, peak) in bars.items()
        if size in sizes
    )
    return result


def whole(count: int, without: Sequence[str] = ()) -> dict[str, Any]:
    """All parts, or some."""
    parts = {
        "times": lambda: times(5 * count),
        "matrix": matrix,
        "fields": fields,
    }
    return {name: part() for name, part in parts.items() if name not in without}


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--questions", type=int, default=4, help="on each map")
    parser.add_argument("--without", nargs="*", default=[], choices=PARTS)
    asked = parser.parse_args()
    sys.stdout.write(json.dumps(whole(asked.questions, asked.without), indent=1) + "\n")


if __name__ == "__main__":
    main()
