"""Requests with odd geometry: every one gets an answer or a sentence, within ten seconds.

    python -m tests.benchmarks.odd_requests                     300 requests
    python -m tests.benchmarks.odd_requests --count 30 --seed 7

Equal places, distances from a nanometre on, cells from a millimetre to a kilometre, maps of a few
cells (one cell is refused in words), and goals among holes, on islands or at the border. A failure
is an error that is none of joulepath's own, a route that does not end at its goal, an energy that
is no number, or more than ten seconds.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from planner import plan_route
from planner.errors import InputError
from planner.terrain.heightmap import Terrain

LATEST = 10.0
"""s that an answer may take, CPU time of all threads."""

Question = tuple[str, Callable[[], Terrain], dict[str, Any]]
"""What it is, its map, and the request."""


def _ground(rng: np.random.Generator, cell: float, shape: tuple[int, int]) -> Callable[[], Terrain]:
    """Rolling ground of gentle slopes; making the map may be refused as well."""
    heights = 0.02 * cell * rng.standard_normal(shape)
    stretch = (cell, cell * float(rng.choice([1.0, 1.0, 0.5, 3.0])))
    return lambda: Terrain.from_arrays(heights, cell=stretch, name="odd")


def _place(rng: np.random.Generator, cell: float, shape: tuple[int, int]) -> dict[str, float]:
    place = {"x": rng.uniform(-0.6, shape[1]) * cell, "y": rng.uniform(-0.6, shape[0]) * cell}
    if rng.random() < 0.4:
        place["yaw"] = float(rng.choice([rng.uniform(-10.0, 10.0), 0.0, math.pi, 1e-12]))
    return place


def _equal_or_near(rng: np.random.Generator) -> Question:
    cell = float(rng.choice([0.1, 0.25, 1.0]))
    start = _place(rng, cell, (40, 40))
    apart = float(rng.choice([0.0, *(10.0 ** rng.uniform(-10.0, -1.0, 4))]))
    angle = rng.uniform(0.0, 2.0 * math.pi)
    goal = {
        "x": start["x"] + apart * math.cos(angle),
        "y": start["y"] + apart * math.sin(angle),
        **({"yaw": rng.uniform(-4.0, 4.0)} if rng.random() < 0.5 else {}),
    }
    asked: dict[str, Any] = {"start": start, "goal": goal}
    if rng.random() < 0.3:
        asked["via"] = [start, {k: goal[k] for k in ("x", "y")}][: int(rng.integers(1, 3))]
    return f"{apart:.1e} m apart", _ground(rng, cell, (40, 40)), asked


def _odd_cells(rng: np.random.Generator) -> Question:
    cell = 10.0 ** float(rng.choice([rng.uniform(-3.0, -1.5), rng.uniform(1.0, 3.0)]))
    shape = tuple(int(n) for n in rng.integers(4, 200 if cell < 1.0 else 60, 2))
    start, goal = (_place(rng, cell, shape) for _ in range(2))
    return f"cells of {cell:.3g} m", _ground(rng, cell, shape), {"start": start, "goal": goal}


def _few_cells(rng: np.random.Generator) -> Question:
    cell = 10.0 ** float(rng.uniform(-1.0, 2.0))
    shape = tuple(int(n) for n in rng.integers(1, 7, 2))
    start, goal = (_place(rng, cell, shape) for _ in range(2))
    text = f"{shape[0]} by {shape[1]} cells of {cell:.3g} m"
    return text, _ground(rng, cell, shape), {"start": start, "goal": goal}


def _holes(rng: np.random.Generator) -> Question:
    cell, side = float(rng.choice([0.1, 0.25, 1.0])), 50
    y, x = np.indices((side, side))
    centre, radius = rng.uniform(5.0, 45.0, 2), rng.uniform(1.0, 12.0)
    away = np.hypot(x - centre[0], y - centre[1])
    known = ~((away > radius) & (away < radius + rng.uniform(1.0, 4.0)))
    if rng.random() < 0.4:  # a door in the ring of holes
        known |= np.abs(y - centre[1]) < rng.uniform(0.0, 1.5) / cell
    known &= rng.random((side, side)) > rng.choice([0.0, 0.002])
    heights = 0.01 * cell * rng.standard_normal((side, side))
    start = _place(rng, cell, (side, side))
    goal = {"x": centre[0] * cell, "y": centre[1] * cell}

    def ground() -> Terrain:
        return Terrain.from_arrays(heights, cell=(cell, cell), known=known, name="odd")

    return f"holes round the goal, cells of {cell:g} m", ground, {"start": start, "goal": goal}


KINDS = (_equal_or_near, _odd_cells, _few_cells, _holes)


def questions(count: int, seed: int) -> Iterator[Question]:
    """Random questions, of all kinds in turn."""
    for number in range(count):
        yield KINDS[number % len(KINDS)](np.random.default_rng((seed, number)))


def outcome(question: Question) -> tuple[str, str]:
    """What came of a question, in a word, and what is wrong with that."""
    _, ground, asked = question
    begun = time.process_time()
    try:
        answer = plan_route(terrain=ground(), **asked)
    except InputError as error:
        late = time.process_time() - begun > LATEST
        return "refused", "a sentence of several lines" if "\n" in str(error) else "late" * late
    except Exception:
        return "crashed", traceback.format_exc()
    if (taken := time.process_time() - begun) > LATEST:
        return answer.status, f"took {taken:.1f} s"
    if not answer.routes:
        return answer.status, "" if answer.reason else "no reason"
    route, goal = answer.routes[0], asked["goal"]
    end = route.poses[-1]
    if math.hypot(end.x - goal["x"], end.y - goal["y"]) > 1e-6:
        return answer.status, f"ends at {end.x}, {end.y}"
    return answer.status, "" if math.isfinite(route.energy_j) else "energy is no number"


def main() -> None:
    """Ask all; exit 1 where something is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    counts: dict[str, int] = {}
    wrong = 0
    for question in questions(2 * len(KINDS), asked.seed + 1):
        outcome(question)  # compiles what is not compiled yet
    for number, question in enumerate(questions(asked.count, asked.seed)):
        came, what = outcome(question)
        counts[came] = counts.get(came, 0) + 1
        if what:
            wrong += 1
            print(f"{number}: {question[0]}: {came}: {what}", flush=True)
    told = ", ".join(f"{count} {came}" for came, count in sorted(counts.items()))
    print(f"{asked.count} requests: {told}; {wrong} wrong")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
