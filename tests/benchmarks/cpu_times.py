"""CPU seconds of a start, a plan and a diagnosis; of two checkouts by turns.

    python -m tests.benchmarks.cpu_times
    python -m tests.benchmarks.cpu_times --against ../before --runs 5

Every run is a process of its own with compiled code on disk. Ratios of medians are told, this
checkout over the other one. Both must have the public face ``planner``.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.hidden_effects.cases import cases
from tests.hidden_effects.logs import VEHICLE, make

ROOT = Path(__file__).parents[2]
START = "from planner.search.plan import warm_up; warm_up()"
COMMAND = "import sys; sys.argv = ['joulepath', 'maps']; from service.cli import main; main()"
PLAN = """
import time
from planner import plan_route
QUESTIONS = (
    ("cone", (6, 20), (34, 20)), ("warehouse", (2, 2), (20, 17)),
    ("fractal-512", (10, 10), (118, 116)), ("tilted-plane", (4, 4), (19, 18)),
    ("jacksboro-1to100", (95, 264.8), (265.6, 120.2)),
)
def ask():
    for name, (x, y), (to_x, to_y) in QUESTIONS:
        plan_route(map=name, start={"x": x, "y": y}, goal={"x": to_x, "y": to_y})
plan_route(map="test-bench", start={"x": 0.8, "y": 1.5}, goal={"x": 13, "y": 1.5})
begun = time.process_time()
ask()
print(time.process_time() - begun)
"""
DIAGNOSE = """
import sys, time
from planner import diagnose
from planner.cache import CACHE
diagnose(sys.argv[1], sys.argv[2])
CACHE.clear()
begun = time.process_time()
diagnose(sys.argv[1], sys.argv[2])
print(time.process_time() - begun)
"""


def whole(program: str) -> str:
    """A program that prints the CPU seconds of its whole process."""
    return (
        "import atexit, os, sys\n"
        "def tell():\n"
        "    used = os.times()\n"
        "    print(used.user + used.system, file=sys.stderr)\n"
        f"atexit.register(tell)\n{program}\n"
    )


def environment_of(checkout: Path) -> dict[str, str]:
    """Variables with which Python runs a checkout, its compiled code in a folder of its own."""
    return {
        **os.environ,
        "PYTHONPATH": str(checkout),
        "NUMBA_CACHE_DIR": str(Path(tempfile.gettempdir()) / f"cpu-times-{checkout.name}-numba"),
        "OPENBLAS_NUM_THREADS": "1",
    }


def measure(checkout: Path, program: str, *arguments: str) -> float:
    """CPU seconds that a program prints last, run in a checkout."""
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        cwd=checkout,
        env=environment_of(checkout),
        capture_output=True,
        text=True,
        check=True,
    )
    told = done.stderr if "atexit" in program else done.stdout
    return float(told.split()[-1])


def main() -> int:
    """Print medians, and ratios where another checkout is given."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.cpu_times")
    parser.add_argument("--against", type=Path)
    parser.add_argument("--runs", type=int, default=5)
    chosen = parser.parse_args()
    case = next(c for c in cases(["one"], 1) if not c.power_at_source)
    log = str(make(case, Path(tempfile.gettempdir()) / "joulepath-hidden-effects").log)
    programs: dict[str, tuple[str, ...]] = {
        "command line": (whole(COMMAND),),
        "start": (whole(START),),
        "plan": (PLAN,),
        "diagnosis": (DIAGNOSE, log, VEHICLE),
    }
    checkouts = [ROOT, *([chosen.against.resolve()] if chosen.against else [])]
    for name, program in programs.items():
        seconds: list[list[float]] = [[] for _ in checkouts]
        for run in range(chosen.runs + 1):
            for found, checkout in zip(seconds, checkouts, strict=True):
                used = measure(checkout, *program)
                # The first one compiles what is not on disk.
                found += [used] if run else []
        medians = [statistics.median(found) for found in seconds]
        told = {"what": name, "cpu_s": [round(median, 3) for median in medians]}
        if len(medians) > 1:
            told["ratio"] = round(medians[0] / medians[1], 3)
        print(json.dumps(told), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
