"""OMPL's routes against the exhaustive grid with refinement, on the fixed maps, with five seeds.

Each run is a fresh process, since OMPL has one random generator for a process. The figure is the
energy of OMPL's own refined route, after 2 s, over that of the grid's refined route.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
from typing import Any

from tests.regression.cases import CASES

PROGRAM = """
import json, sys
from planner import plan_route
case = json.loads(sys.argv[1])
answer = plan_route(case, seed=int(sys.argv[2]), planner=sys.argv[3], time_budget_s=2.0)
sys.stdout.write(json.dumps(dict(answer.planner)))
"""


def measure(seeds: int = 5, space: str = "tube") -> dict[str, Any]:
    """Excess of OMPL's route over the grid's, in percent, by case and over all."""
    by_case: dict[str, list[float]] = {}
    for name, case in CASES.items():
        for seed in range(seeds):
            done = subprocess.run(
                [sys.executable, "-c", PROGRAM, json.dumps(case), str(seed), space],
                capture_output=True,
                text=True,
                check=True,
            )
            found = json.loads(done.stdout)
            without = found.get("legs_without_ompl", 1) > 0  # the grid's leg stood in: no result
            if without or "ompl_energy_j" not in found or "grid_energy_j" not in found:
                by_case.setdefault(name, []).append(float("inf"))
                continue
            excess = 100.0 * (found["ompl_energy_j"] / found["grid_energy_j"] - 1.0)
            by_case.setdefault(name, []).append(excess)
    values = [value for case in by_case.values() for value in case]
    return {
        "space": space,
        "excess_percent": {name: [round(v, 3) for v in case] for name, case in by_case.items()},
        "median_percent": round(statistics.median(values), 3),
        "worst_percent": round(max(values), 3),
        "bar": "median ≤ +1 %, worst ≤ +3 %",
        "holds": statistics.median(values) <= 1.0 and max(values) <= 3.0,
    }
