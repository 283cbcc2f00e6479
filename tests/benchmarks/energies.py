"""Energies of planned routes in two checkouts, and the CPU time that they took.

    python -m tests.benchmarks.energies --against ../before               some minutes of CPU
    python -m tests.benchmarks.energies --against ../before --count 2

The fixed maps of tests.regression, then questions at random on the maps that the benchmarks of
planning and of peers use. The change of each energy in %, and the ratio of the CPU times, are those
of this checkout over the other one. Both must have the public face ``planner``.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from planner.terrain.catalogue import open_map
from tests.benchmarks.cpu_times import ROOT, environment_of
from tests.benchmarks.questions import MAPS
from tests.regression.cases import CASES

FIRST_SEED = 500
ALLOWED_PERCENT, ALLOWED_MEDIAN_PERCENT = 0.1, 0.01
"""By which one energy, and the median of all, may rise."""
PROGRAM = """
import json, sys, time
from planner import plan_route
from planner.errors import InputError
questions = json.load(sys.stdin)
def energy(asked):
    try:
        routes = plan_route(asked).routes
    except InputError:
        return None
    return routes[0].energy_j if routes else None
energy(questions[0])  # compiles or loads what is needed
for asked in questions:
    begun = time.process_time()
    found = energy(asked)
    print(json.dumps([found, time.process_time() - begun]), flush=True)
"""

Question = dict[str, Any]


def at_random(count: int) -> list[Question]:
    """Starts and goals on each of the maps, at least a fifth of the width apart."""
    asked: list[Question] = []
    for number, name in enumerate(MAPS):
        rng = np.random.default_rng(FIRST_SEED + number)
        west, south, east, north = open_map(name).extent
        for _ in range(count):
            apart = 0.0
            while apart < 0.2 * (east - west):
                x = west + (east - west) * rng.uniform(0.05, 0.95, 2)
                y = south + (north - south) * rng.uniform(0.05, 0.95, 2)
                apart = float(np.hypot(*np.diff([x, y])[:, 0]))
            ends = [{"x": float(x[k]), "y": float(y[k])} for k in (0, 1)]
            asked.append({"map": name, "start": ends[0], "goal": ends[1]})
    return asked


def planned(checkout: Path, asked: list[Question]) -> list[list[float | None]]:
    """Energy in J, None where there is no route, and CPU s of each question in a checkout."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=checkout,
        env=environment_of(checkout),
        input=json.dumps(asked),
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def main() -> int:
    """Print each change and what all together show; the exit code is 1 where one is not allowed."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.energies")
    parser.add_argument("--against", type=Path, required=True)
    parser.add_argument("--count", type=int, default=12, help="questions at random on each map")
    chosen = parser.parse_args()
    asked = [*CASES.values(), *at_random(chosen.count)]
    now, before = planned(ROOT, asked), planned(chosen.against.resolve(), asked)
    changes, lost = [], 0
    for question, (energy, _), (earlier, _) in zip(asked, now, before, strict=True):
        lost += earlier is not None and energy is None
        if energy is None or earlier is None:
            continue
        changes.append(100.0 * (energy / earlier - 1.0))
        print(f"{changes[-1]:+9.5f} %  {energy:10.3f} J  {json.dumps(question)}", flush=True)
    cpu = [sum(seconds or 0.0 for _, seconds in found) for found in (now, before)]
    median = statistics.median(changes)
    print(
        f"{len(changes)} routes, {lost} lost: median {median:+.5f} %, worst {max(changes):+.5f} %, "
        f"mean {statistics.fmean(changes):+.5f} %; CPU {cpu[0]:.1f} s over {cpu[1]:.1f} s, "
        f"ratio {cpu[0] / cpu[1]:.3f}"
    )
    bad = lost or max(changes) > ALLOWED_PERCENT or median > ALLOWED_MEDIAN_PERCENT
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
