"""Answers in full, to the last bit, so that two states of the code can be told apart.

    python -m tests.benchmarks.same_answers before.json           about half an hour on two cores
    python -m tests.benchmarks.same_answers after.json --against before.json
    python -m tests.benchmarks.same_answers after.json --parts maps bounds

maps        the fixed maps of tests.regression
questions   those that the benchmarks of planning ask
bounds      the certified bound, iterated until it settles and on one core: two race each other
naming      diagnoses of a hundred logs of tests.hidden_effects; every kind takes part

A move of code must leave all of them as they were. The exit code is 1 where any differs.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from planner import diagnose, energy_time_front, plan_route
from planner.search.second_core import CORE
from planner.terrain.catalogue import open_map
from tests.benchmarks.bounds import PAIRS, certified
from tests.benchmarks.questions import FIRST_SEED, MAPS, questions
from tests.hidden_effects.cases import KINDS, cases
from tests.hidden_effects.logs import VEHICLE, make
from tests.hidden_effects.runner import log_folder
from tests.regression.cases import CASES

BOUNDED = ("test-bench", "warehouse", "tilted-plane", "cone")
LOGS = 100
QUESTIONS = 4
"""On each of the maps."""
PASSING = ("seconds", "took_s", "bound_seconds", "source")
"""Keys of what a clock says, and of the temporary file that a log stands in."""

Found = dict[str, Any]


def maps() -> Iterator[tuple[str, Found]]:
    """Answers on the fixed maps, the first of them with its front."""
    for name, asked in CASES.items():
        yield name, plan_route(asked).to_json()
    name, asked = next(iter(CASES.items()))
    yield f"{name}, front", energy_time_front(asked).to_json()


def asked_at_random() -> Iterator[tuple[str, Found]]:
    """Answers to questions at random."""
    for number, name in enumerate(MAPS):
        for k, asked in enumerate(questions(open_map(name), QUESTIONS, FIRST_SEED + number)):
            yield f"{name} {k}", plan_route(map=name, **asked).to_json()


def bounds() -> Iterator[tuple[str, Found]]:
    """Certified bounds in J."""
    # Halves of a loop that run at once read what the other writes: in any order it is a bound.
    CORE.all = lambda tasks: [task() for task in tasks]  # type: ignore[method-assign]
    for name in BOUNDED:
        for k, ends in enumerate(PAIRS[name]):
            yield f"{name} {k}", {"bound_j": certified(name, ends, math.inf).bound_j}


def _diagnosed(case: Any) -> tuple[str, Found]:
    made = make(case, log_folder())
    return case.name, diagnose(made.log, VEHICLE, mapping=made.mapping).to_json()


def naming(processes: int) -> Iterator[tuple[str, Found]]:
    """Diagnoses of logs that are spread evenly over the benchmark's kinds."""
    everything = cases(KINDS, 5)
    chosen = [everything[k * len(everything) // LOGS] for k in range(LOGS)]
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        yield from pool.map(_diagnosed, chosen)


def without_passing(document: Any) -> Any:
    """A document without what differs from run to run."""
    if isinstance(document, dict):
        return {k: without_passing(v) for k, v in document.items() if k not in PASSING}
    if isinstance(document, (list, tuple)):
        return [without_passing(item) for item in document]
    return document


def differences(before: Any, after: Any, where: str = "") -> list[str]:
    """Every place at which two documents differ, with both values."""
    if isinstance(before, dict) and isinstance(after, dict):
        found = []
        for key in sorted({*before, *after}):
            found += differences(before.get(key), after.get(key), f"{where}/{key}")
        return found
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        pairs = enumerate(zip(before, after, strict=True))
        return [said for k, pair in pairs for said in differences(*pair, f"{where}/{k}")]
    # Exactly: no tolerance, and no number is as good as itself.
    return [] if repr(before) == repr(after) else [f"{where}: {before!r} → {after!r}"]


def main() -> int:
    """Write the answers; compare them where another file is given."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.same_answers")
    parser.add_argument("file", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--processes", type=int, default=2)
    made: dict[str, Callable[[], Iterator[tuple[str, Found]]]] = {
        "maps": maps,
        "questions": asked_at_random,
        "bounds": bounds,
    }
    parser.add_argument("--parts", nargs="+", default=[*made, "naming"], choices=[*made, "naming"])
    chosen = parser.parse_args()
    made["naming"] = partial(naming, chosen.processes)
    told: dict[str, dict[str, Any]] = {}
    for part in chosen.parts:
        told[part] = {}
        for name, document in made[part]():
            # Through text, so that what is compared is what a user can read.
            told[part][name] = json.loads(json.dumps(without_passing(document)))
            print(f"{part}: {name}", flush=True)
        chosen.file.write_text(json.dumps(told), encoding="utf-8")
    if chosen.against is None:
        return 0
    before = json.loads(chosen.against.read_text(encoding="utf-8"))
    found = [said for part in told for said in differences(before.get(part), told[part], f"{part}")]
    print("\n".join(found[:50]))
    count = sum(len(part) for part in told.values())
    print(f"{count} answers, {len(found)} differences")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
