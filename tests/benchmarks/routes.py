"""OMPL's samplers against the default planner, and what OMPL's frame takes, on the fixed maps.

``measure``: the energy of the best route along a sampler's path, after some seconds, over that of
least-energy. ``frame``: CPU time of the frame around a search that has its result already.
"""

from __future__ import annotations

import statistics
import time
from typing import Any

from planner.cancellation import CancellationToken
from planner.progress import silent
from planner.search.ompl import compare_planners, solved
from planner.search.requests import PlanRequest
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.solve import best_route
from tests.regression.cases import CASES


def measure(runs: int = 5, space: str = "plane", seconds: float = 2.0) -> dict[str, Any]:
    """Excess of every sampler over least-energy, in percent: median, worst, and runs unsolved."""
    excess: dict[str, list[float]] = {}
    unsolved: dict[str, int] = {}
    for case in CASES.values():
        found = compare_planners(case, space=space, runs=runs, seconds=seconds).runs
        least = found[0].energy_j or float("nan")
        for run in found[1:]:
            if run.energy_j is None:
                unsolved[run.planner] = unsolved.get(run.planner, 0) + 1
            else:
                excess.setdefault(run.planner, []).append(100.0 * (run.energy_j / least - 1.0))
    return {
        "space": space,
        "seconds": seconds,
        "median_percent": {name: round(statistics.median(v), 3) for name, v in excess.items()},
        "worst_percent": {name: round(max(v), 3) for name, v in excess.items()},
        "unsolved": unsolved,
        "bar": "least-energy is no worse in the median",
        "holds": all(statistics.median(values) >= 0.0 for values in excess.values()),
    }


def frame(rounds: int = 15) -> dict[str, Any]:
    """CPU milliseconds of the frame for one answer: the median of each map, and the largest."""
    medians = {}
    for name, case in CASES.items():
        request = PlanRequest.from_json({**case, "via": []})
        with CancellationToken() as token:
            run = Run(request, situation_of(request), silent, token)
            found = best_route(run)
            spent = []
            for _ in range(rounds):
                begun = time.process_time()
                solved(run, lambda _, found=found: found)
                spent.append(1e3 * (time.process_time() - begun))
        medians[name] = round(statistics.median(spent), 2)
    largest = max(medians.values())
    return {"median_ms": medians, "largest_ms": largest, "bar": "≤ 5 ms", "holds": largest <= 5.0}
