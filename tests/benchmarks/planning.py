"""How fast and how near the best routes are: five maps, random questions, other planners beside.

    python -m tests.benchmarks.planning                 everything, some 15 minutes on two cores
    python -m tests.benchmarks.planning --questions 2 --without fields large

Every route is priced by the same power model along a motion worked out in the same way. The best
known route of a question is the cheapest that any method found, ours with ten seconds included.
Other methods: scikit-image's MCP_Geometric with the cost of a metre averaged over all directions
(pip install 'joulepath[bench]'), its path driven as it is and refined as ours are.
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
from numpy.typing import NDArray

from planner import energy_matrix, plan_route
from planner.errors import InputError
from planner.search.drive import drive
from planner.search.lattice import CLOSELY
from planner.search.refine import refine
from planner.search.request import PlanRequest
from planner.search.route import Route
from planner.search.situation import Situation, situation_of
from planner.terrain.catalogue import open_map
from planner.terrain.heightmap import Terrain

MAPS = ("fractal-512", "jacksboro-1to100", "cone", "saddle", "warehouse")
LONG = 10.0
"""s for the best known route."""
PARTS = ("quality", "times", "matrix", "fields")

Question = dict[str, Any]
Array = NDArray[np.float64]


def fractal(count: int, seed: int) -> Terrain:
    """Relief of count by count cells of 0.25 m with a mean slope of 4.6°."""
    rng = np.random.default_rng(seed)
    rows, columns = np.fft.fftfreq(count)[:, None], np.fft.rfftfreq(count)[None, :]
    frequency = np.hypot(rows, columns)
    frequency[0, 0] = 1.0
    spectrum = rng.standard_normal(frequency.shape) + 1j * rng.standard_normal(frequency.shape)
    heights = np.fft.irfft2(spectrum / frequency**2.1, (count, count))
    slope = np.hypot(*np.gradient(heights, 0.25)).mean()
    return Terrain.from_arrays(heights * (0.08 / slope), cell=(0.25, 0.25), name=f"fractal-{count}")


def questions(terrain: Terrain, count: int, seed: int) -> list[Question]:
    """Starts and goals at random that have a route."""
    rng = np.random.default_rng(seed)
    west, south, east, north = terrain.extent
    found: list[Question] = []
    while len(found) < count:
        x = west + (east - west) * rng.uniform(0.05, 0.95, 2)
        y = south + (north - south) * rng.uniform(0.05, 0.95, 2)
        asked = {
            "start": {"x": float(x[0]), "y": float(y[0])},
            "goal": {"x": float(x[1]), "y": float(y[1])},
        }
        if np.hypot(x[1] - x[0], y[1] - y[0]) < 0.2 * (east - west):
            continue
        try:
            if plan_route(terrain=terrain, **asked).status == "ok":
                found.append(asked)
        except InputError:
            continue
    return found


def quality(count: int) -> dict[str, Any]:
    """Excess over the best known route in percent, by map, for us and for others."""
    rows = []
    for number, name in enumerate(MAPS):
        terrain = open_map(name)
        for asked in questions(terrain, count, 100 + number):
            quick = plan_route(terrain=terrain, **asked).routes[0].energy_j
            long = plan_route(terrain=terrain, **asked, time_budget_s=LONG)
            others = _isotropic(terrain, asked)
            best = min([quick, long.routes[0].energy_j, *(e for e in others.values() if e)])
            rows.append(
                {
                    "map": name,
                    **asked,
                    "best_known_j": best,
                    "found_by": long.planner["chosen"],
                    "quick_percent": 100.0 * (quick / best - 1.0),
                    "isotropic_percent": {
                        key: 100.0 * (energy / best - 1.0) if energy else None
                        for key, energy in others.items()
                    },
                    "isotropic_over_ours_percent": {
                        key: 100.0 * (energy / quick - 1.0) if energy else None
                        for key, energy in others.items()
                    },
                }
            )
    excess = [row["quick_percent"] for row in rows]
    plain = [row["isotropic_over_ours_percent"].get("as it is") for row in rows]
    drivable = [value for value in plain if value is not None]
    return {
        "questions": len(rows),
        "median_percent": statistics.median(excess),
        "worst_percent": max(excess),
        "bar": "median ≤ 0.1 %, worst ≤ 0.5 %",
        "holds": statistics.median(excess) <= 0.1 and max(excess) <= 0.5,
        "isotropic_median_percent": statistics.median(drivable) if drivable else None,
        "isotropic_least_percent": min(drivable, default=None),
        "isotropic_not_drivable": len(plain) - len(drivable),
        "isotropic_bar": "never below 0 %, median ≥ 5 %",
        "rows": rows,
    }


def _isotropic(terrain: Terrain, asked: Question) -> dict[str, float | None]:
    """Energy of scikit-image's path as it is and refined; None where it cannot be driven."""
    try:
        from skimage.graph import MCP_Geometric
    except ImportError:
        return {}
    request = PlanRequest.from_json({"map": terrain.name, **asked})
    situation = situation_of(request, terrain=terrain)
    field = situation.field("energy")
    costs = _mean_costs(situation)
    ends = [
        (
            round((asked[end]["y"] - field.y0) / field.dy),
            round((asked[end]["x"] - field.x0) / field.dx),
        )
        for end in ("start", "goal")
    ]
    search = MCP_Geometric(costs, sampling=(field.dy, field.dx))
    search.find_costs([ends[0]], [ends[1]])
    try:
        nodes = np.array(search.traceback(ends[1]))
    except ValueError:
        return {"as it is": None, "refined": None}
    points = np.column_stack([field.x0 + field.dx * nodes[:, 1], field.y0 + field.dy * nodes[:, 0]])
    points[0] = asked["start"]["x"], asked["start"]["y"]
    points[-1] = asked["goal"]["x"], asked["goal"]["y"]
    energies: dict[str, float | None] = {}
    [(smoother, _)] = refine(field, points, tolls=[situation.toll("energy")], knot_cells=4.0)
    for key, path in (("as it is", points), ("refined", smoother)):
        route = drive(field, situation.around, [path], (None, None), objective=0)
        energies[key] = route.energy_j if isinstance(route, Route) else None
    return energies


def _mean_costs(situation: Situation) -> Array:
    """J/m of every node (ny, nx), the mean over all directions; dear where a limit may be near."""
    field = situation.field("energy")
    lattice = situation.lattice("energy", field)
    lengths = np.hypot(lattice.moves[:, 0] * field.dx, lattice.moves[:, 1] * field.dy)
    shares = lengths * np.where(lattice.beside.any(axis=1), 0.25, 0.5)
    by_slope = (lattice.table[0] / shares).mean(axis=1)
    costs = np.full(field.heights.shape, np.nan)
    known = lattice.slopes != CLOSELY
    costs[known] = by_slope[lattice.slopes[known]]
    dear = 3.0 * float(np.nanmax(costs)) if known.any() else 1.0
    costs[~known] = dear
    costs[field.mask == 0] = -1.0  # no way
    return costs


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
from tests.benchmarks.planning import fractal
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
        "quality": lambda: quality(count),
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
