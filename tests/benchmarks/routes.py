"""OMPL's samplers against the default planner, on the fixed maps.

The figure is the energy of the best route along a sampler's path, after 2 s, over that of
least-energy.
"""

from __future__ import annotations

import statistics
from typing import Any

from planner.search.ompl import compare_planners
from tests.regression.cases import CASES


def measure(runs: int = 5, space: str = "plane") -> dict[str, Any]:
    """Excess of every sampler over least-energy, in percent: median, worst, and runs unsolved."""
    excess: dict[str, list[float]] = {}
    unsolved: dict[str, int] = {}
    for case in CASES.values():
        found = compare_planners(case, space=space, runs=runs).runs
        least = found[0].energy_j or float("nan")
        for run in found[1:]:
            if run.energy_j is None:
                unsolved[run.planner] = unsolved.get(run.planner, 0) + 1
            else:
                excess.setdefault(run.planner, []).append(100.0 * (run.energy_j / least - 1.0))
    return {
        "space": space,
        "median_percent": {name: round(statistics.median(v), 3) for name, v in excess.items()},
        "worst_percent": {name: round(max(v), 3) for name, v in excess.items()},
        "unsolved": unsolved,
        "bar": "least-energy is no worse in the median",
        "holds": all(statistics.median(values) >= 0.0 for values in excess.values()),
    }
