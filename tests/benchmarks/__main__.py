"""``make bench``: all measurements, as a table here and as JSON in docs/benchmarks.json."""

from __future__ import annotations

import json
import platform
import sys
from pathlib import Path

from tests.benchmarks import power, routes, start


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
    "OMPL's route over the grid's, fixed maps": routes.measure,
}


def main() -> int:
    """Run all, print each line as it comes, and fail where a bar does not hold."""
    results = {}
    for name, measure in MEASUREMENTS.items():
        results[name] = measure()
        print(f"{name}: {json.dumps(results[name], ensure_ascii=False)}", flush=True)
    document = {"python": platform.python_version(), "results": results}
    Path("docs/benchmarks.json").write_text(
        json.dumps(document, indent=2, ensure_ascii=False) + "\n", encoding="utf-8"
    )
    missed = [name for name, result in results.items() if not result.get("holds", True)]
    for name in missed:
        print(f"bar missed: {name}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
