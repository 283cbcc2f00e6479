"""``make bench``: all measurements, as a table here and as JSON in docs/benchmarks.json.

    python -m tests.benchmarks                 all; naming takes an hour
    python -m tests.benchmarks power routes    those whose names hold one of these words

The measurement "naming" also writes docs/naming.md, its picture and its JSON, and "planners" writes
docs/benchmarks/planning.json and docs/images/planning.svg.
"""

from __future__ import annotations

import json
import platform
import sys
from pathlib import Path

from tests.benchmarks import (
    best_known,
    energy_intervals,
    hard_maps,
    naming,
    planning,
    power,
    routes,
    serving,
    serving_many,
    sharp_friction,
    start,
)
from tests.benchmarks.peers.comparison import side_by_side


def power_model() -> dict[str, object]:
    """Time and accuracy of the power model."""
    found = power.measure()
    holds = found["power_ns"] <= 1000.0
    return {**{k: round(v, 4) for k, v in found.items()}, "bar": "≤ 1,000 ns", "holds": holds}


MEASUREMENTS = {
    "one evaluation of the power model": power_model,
    "planner start with compiled code on disk": start.planner_start,
    "1,200 x 650 raster, 0.5 m cells": lambda: start.raster_from_the_command_line(0.5),
    "1,200 x 650 raster, 30 m cells": lambda: start.raster_from_the_command_line(30.0),
    "service: CPU of an empty job": serving.empty_job,
    "service: clients that hang up": serving.hanging_up,
    "service: first starts side by side": serving.first_starts,
    "service: HTTP against in process": serving_many.over_http,
    "service: workers that are killed": serving_many.killed_workers,
    "service: memory over many requests": serving_many.memory,
    "OMPL's frame of an answer": routes.frame,
    "OMPL's samplers over least-energy, fixed maps": routes.measure,
    "planners side by side": side_by_side,
    "times of answers": lambda: planning.times(20),
    "answers on hard maps: obstacles and real relief": hard_maps.times,
    "time budgets on hard maps": hard_maps.budgets,
    "answers over the best known routes": best_known.measure,
    "routes with sharp friction": sharp_friction.measure,
    "matrix of 50 by 50": planning.matrix,
    "fields up to 4096²": planning.fields,
    "95 % intervals of energies": energy_intervals.measure,
    "naming of hidden effects": naming.whole,
}


def main() -> int:
    """Run all, print each line as it comes, and fail where a bar does not hold."""
    kept = Path("docs/benchmarks.json")
    words = sys.argv[1:]
    # A part of the measurements leaves the others' results as they are.
    results = json.loads(kept.read_text(encoding="utf-8"))["results"] if words else {}
    for name, measure in MEASUREMENTS.items():
        if words and not any(word in name for word in words):
            continue
        results[name] = measure()
        print(f"{name}: {json.dumps(results[name], ensure_ascii=False)}", flush=True)
    document = {"python": platform.python_version(), "results": results}
    text = json.dumps(document, indent=2, ensure_ascii=False)
    kept.write_text(text + "\n", encoding="utf-8")
    missed = [name for name, result in results.items() if not result.get("holds", True)]
    for name in missed:
        print(f"bar missed: {name}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
