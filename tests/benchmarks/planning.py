"""How fast answers come: whole answers, energies between places and in reach, maps up to 8192².

    python -m tests.benchmarks.planning                 everything, some five minutes on two cores
    python -m tests.benchmarks.planning --questions 2 --without fields matrix reach

How good the answers are, beside those of other planners: python -m tests.benchmarks.peers.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner import energy_matrix, plan_route, reachable_area
from planner.search.reach import Reach
from planner.terrain.catalogue import open_map
from tests.benchmarks.questions import fractal, questions

PARTS = ("times", "matrix", "reach", "fields")
AREAS = (
    ("fractal-512", (60.0, 60.0), 800.0),
    ("fractal-512", (30.0, 90.0), 400.0),
    ("tilted-plane", (12.0, 12.0), 150.0),
    ("cone", (20.0, 10.0), 200.0),
    ("warehouse", (2.0, 2.0), 300.0),
)
"""Maps, starts and J of reachable areas."""
EDGE = 25
"""Places at each area's edge whose energy is asked for by itself."""


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


def reach() -> dict[str, Any]:
    """Seconds for reachable areas, and how far single answers at their edges are off."""
    taken, errors = [], []
    for name, (x, y), energy in AREAS:
        terrain, start = open_map(name), {"x": x, "y": y}
        begun = time.perf_counter()
        area = reachable_area(terrain=terrain, start=start, energy_j=energy)
        taken.append(time.perf_counter() - begun)
        for px, py in _edge(area):
            answer = plan_route(terrain=terrain, start=start, goal={"x": px, "y": py})
            if answer.routes:
                errors.append(abs(100.0 * (answer.routes[0].energy_j / energy - 1.0)))
    return {
        "seconds": taken,
        "places": len(errors),
        "median_error_percent": statistics.median(errors),
        "p90_error_percent": float(np.quantile(errors, 0.9)),
        "worst_error_percent": max(errors),
        "bar": "≤ 1 %",
        "holds": max(errors) <= 1.0,
    }


def _edge(area: Reach) -> list[tuple[float, float]]:
    """Places on the outlines, not where the map or the ground that can be driven ends."""
    found = []
    for line in area.outlines:
        for x, y in line:
            j = round((y - area.origin[1]) / area.cell[1])
            i = round((x - area.origin[0]) / area.cell[0])
            near = area.needed_j[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2]
            if near.shape == (3, 3) and np.abs(near / area.energy_j - 1.0).max() < 0.25:
                found.append((float(x), float(y)))
    return found[:: max(1, len(found) // EDGE)][:EDGE]


_FIELD = """
import json, sys, time
import numpy as np
from planner import plan_route
from planner.search.grid import cost_to_go
from planner.search.requests import PlanRequest
from planner.search.situation import situation_of
from planner.terrain.heightmap import Terrain
file, whole = sys.argv[1], sys.argv[2] == "field"
ends = {"map": "x", "start": {"x": 5, "y": 5}, "goal": {"x": 10, "y": 10}}
def run(heights):
    terrain = Terrain.from_arrays(heights.astype(float), cell=(0.25, 0.25), name="x")
    side = 0.25 * len(heights)
    begun = time.perf_counter()
    situation = situation_of(PlanRequest.from_json(ends), terrain=terrain)
    field = situation.field("energy")
    lattice = situation.lattice("energy", field)
    ready = time.perf_counter()
    if whole:
        cost_to_go(field, lattice, (0.5 * side, 0.5 * side))
    else:
        start, goal = ({"x": a * side, "y": (1 - a) * side} for a in (0.2, 0.8))
        assert plan_route(terrain=terrain, start=start, goal=goal).status == "ok"
    return {"ground_s": ready - begun, "seconds": time.perf_counter() - ready}
heights = np.load(file)
run(heights[:64, :64])
found = run(heights)
# Not getrusage's: a child begins there with the size of its parent.
with open("/proc/self/status") as lines:
    found["peak_mib"] = next(int(x.split()[1]) for x in lines if x.startswith("VmHWM")) / 1024.0
print(json.dumps(found))
"""


def fields() -> dict[str, Any]:
    """Seconds and peak memory of fields that fill a map, and of one answer on a large one.

    Each in a process of its own, on relief from a file.
    """
    tasks = [(512, "field"), (1024, "field"), (2048, "field"), (4096, "field")]
    tasks += [(4096, "answer"), (8192, "answer")]
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for size, what in tasks:
            file = Path(folder) / f"{size}.npy"
            if not file.exists():
                np.save(file, _wide_relief(size))
            done = subprocess.run(
                [sys.executable, "-c", _FIELD, str(file), what],
                capture_output=True,
                text=True,
                check=True,
            )
            result[f"{what}, {size}²"] = json.loads(done.stdout)
    result["bar"] = (
        "fields: 1024² ≤ 0.8 s, 4096² ≤ 15 s and ≤ 1,229 MiB; 8192² answers in 4,096 MiB"
    )
    whole, large = result["field, 4096²"], result["answer, 8192²"]
    result["holds"] = (
        result["field, 1024²"]["seconds"] <= 0.8
        and whole["seconds"] <= 15.0
        and whole["peak_mib"] <= 1229.0
        and large["peak_mib"] <= 4096.0
    )
    return result


def _wide_relief(size: int) -> NDArray[np.float32]:
    """Relief of size by size cells; large ones are mirrored from a smaller one, without seams."""
    piece = fractal(min(size, 2048), 3).heights
    repeats = size // len(piece)
    wide = np.hstack([piece[:, :: (-1) ** k] for k in range(repeats)])
    return np.vstack([wide[:: (-1) ** k] for k in range(repeats)]).astype(np.float32)


def whole(count: int, without: Sequence[str] = ()) -> dict[str, Any]:
    """All parts, or some."""
    parts = {
        "times": lambda: times(5 * count),
        "matrix": matrix,
        "reach": reach,
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
