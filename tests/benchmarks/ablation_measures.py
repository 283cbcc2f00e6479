"""What an ablation measures, on so many questions: answers by question, and the CPU time of all.

    found = MEASURES["hard"](10)

    planning     change of the energy in % (mean, worst, best), and ratio of the CPU times
    time         the same for answers of least time, with their duration
    hard         energy among obstacles and on relief
    relief       energy on relief up to the slope limit
    coarse       energy on maps with cells of many metres, so many questions on each
    coarse time  duration there, of answers of least time
    steep        energy on open hills, without and with payload, so many questions on each
    anytime      as planning, with iterations given
    budget       as hard and on a hill, with a time budget
    certificate  change of the gap between route and lower bound, in percentage points
    naming       right and wrong verdicts on drawn laboratory logs, of so many
    several      the same on a few chosen ones, most of them with two or three effects

A fresh process calls them. Nothing of planner is imported before the constant is replaced.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

FIRST_LOG = 300
"""Seed of the first log of ``naming``; rules are tuned on smaller ones."""
SEVERAL = [
    ("several", "gear_asymmetry+air_drag+yaw_scrub", 4889),
    ("several", "air_drag+sensor_rate", 4874),
    ("several", "cold_grease+sensor_rate+regeneration_limit", 4877),
    ("one", "motor_heating", 5127),
]
"""Logs on which a second effect is there and hard to see, or is not there and seems to be: on most
drawn logs with several effects the number of those named does not hang on a single constant."""
ITERATIONS = 24
"""Of searches with iterations given."""
STEEP = (8.0, 11.0, 14.0)
"""Mean slopes of open hills, °: on the steeper ones the slope limit is reached at many places."""
COARSE = 10.0
"""m, cells of coarse hills: larger than a robot."""
HILLS = 3
"""Hills of each slope: near the slope limit a route may change by some per cent whatever changes,
and only many routes tell what a constant is worth."""
LOADS = (0.0, 20.0)
"""Payloads on hills, kg: with the second one, many slopes are too steep."""
HARD = ("warehouse", "shelves", "rocks", "maze", "jacksboro-1to100")
"""Maps of ``hard``; a question on relief of full size takes longer than on all of them."""
ABLATED_SEED = 4
"""Of the maps and questions of ``hard``; other ones than those that ``make bench`` times."""
SECONDS = 10.0
"""s that a certificate is given."""
BUDGET = 5.0
"""s of CPU time that an answer is given: of all threads, as other work on the machine would take
part of a budget by the clock."""
QUESTIONS = (
    ("cone", (6.0, 20.0), (34.0, 20.0)),
    ("warehouse", (2.0, 2.0), (20.0, 17.0)),
    ("test-bench", (0.8, 1.5), (13.0, 1.5)),
    ("saddle", (6.0, 9.0), (34.0, 33.0)),
    ("tilted-plane", (4.0, 4.0), (19.0, 18.0)),
    ("fractal-512", (10.0, 10.0), (118.0, 116.0)),
    ("jacksboro-1to100", (93.0, 225.0), (212.0, 73.0)),
    ("cone", (8.0, 8.0), (33.0, 30.0)),
    ("warehouse", (2.0, 15.0), (27.5, 4.0)),
    ("test-bench", (13.0, 1.5), (0.8, 1.5)),
    ("saddle", (6.0, 20.0), (34.0, 20.0)),
    ("jacksboro-1to100", (20.6, 226.1), (209.9, 203.9)),
)
"""Map, start and goal in m; the first ones stand for all kinds of maps."""


def planning(
    count: int, iterations: int | None = None, objective: str = "energy"
) -> dict[str, Any]:
    """Energies in J, or durations in s, by question, None without a route, and CPU s of all."""
    from planner import plan_route

    def answer(name: str, start: Sequence[float], goal: Sequence[float]) -> float | None:
        ends = {
            "start": dict(zip("xy", start, strict=True)),
            "goal": dict(zip("xy", goal, strict=True)),
        }
        more = {} if iterations is None else {"iterations": iterations}
        routes = plan_route(map=name, **ends, **more, objective=objective).routes
        return routes[0].value(objective) if routes else None

    answer("test-bench", (2.0, 0.8), (11.0, 2.3))  # compiles or loads what is needed
    begun = time.process_time()
    found = {
        f"{name} {start} {goal}": answer(name, start, goal)
        for name, start, goal in QUESTIONS[:count]
    }
    return {"answers": found, "cpu_s": time.process_time() - begun}


def hard(count: int, seed: int = ABLATED_SEED) -> dict[str, Any]:
    """As ``planning``, for ``count`` questions on hard maps."""
    from tests.benchmarks.hard_maps import made

    maps = [made(name, seed) for name in HARD]
    return _on(maps, -(-count // len(maps)), LOADS[:1], seed)


def relief(count: int, seed: int = ABLATED_SEED) -> dict[str, Any]:
    """As ``planning``, for ``count`` questions on measured relief up to the slope limit."""
    from tests.benchmarks.hard_maps import made

    return _on([made("jacksboro-1to100", seed)], count, LOADS[:1], seed)


def coarse(count: int, seed: int = ABLATED_SEED, **given: str) -> dict[str, Any]:
    """As ``planning``, for ``count`` questions on each map with cells of many metres."""
    from tests.benchmarks.hard_maps import made

    hills = [_hills(STEEP[0], number, COARSE) for number in range(seed, seed + HILLS)]
    return _on([made("jacksboro", seed), *hills], count, LOADS[:1], seed, **given)


def steep(count: int, seed: int = ABLATED_SEED) -> dict[str, Any]:
    """As ``planning``, for ``count`` questions on each of the hills, with each payload."""
    drawn = itertools.product(STEEP, range(seed, seed + HILLS))
    return _on([_hills(*one) for one in drawn], count, LOADS, seed)


def budget(count: int, seed: int = ABLATED_SEED) -> dict[str, Any]:
    """As ``hard``, with a hill and BUDGET s for each answer; other than first ones on a map."""
    from tests.benchmarks.hard_maps import made

    maps = [*(made(name, seed) for name in HARD), _hills(STEEP[0], seed)]
    return _on(maps, -(-count // len(maps)), LOADS[:1], seed, time_budget_s=BUDGET)


def _hills(slope: float, seed: int, cell: float = 0.25) -> Any:
    """A map of open hills with a mean slope in °, and cells in m."""
    from planner.terrain.heightmap import Terrain
    from tests.benchmarks.hard_maps import rolling

    side = 160 if cell < 1.0 else 100  # few nodes, as relief with coarse cells often has
    heights = rolling((side, side), cell, slope, seed)
    return Terrain.from_arrays(heights, cell=(cell, cell), name=f"hills {seed} of {slope:g}°")


def _on(
    maps: Sequence[Any], each: int, loads: Sequence[float], seed: int, **given: float | str
) -> dict[str, Any]:
    """Energies, or s, and CPU time of ``each`` questions on every map, with every payload in kg."""
    from planner import plan_route
    from tests.benchmarks.hard_maps import places

    answers: dict[str, float | None] = {}
    objective, taken = str(given.get("objective", "energy")), 0.0
    for terrain in maps:
        for k, asked in enumerate(places(terrain, each + 1, seed)):
            for load in loads:
                begun = time.process_time()
                fields = {**asked, **(given if k else {})}
                routes = plan_route(terrain=terrain, payload={"mass": load}, **fields).routes
                if k:  # the first one warms the map up
                    taken += time.process_time() - begun
                    answers[f"{terrain.name} {load:g} kg {k}"] = (
                        routes[0].value(objective) if routes else None
                    )
    return {"answers": answers, "cpu_s": taken}


def certificate(count: int) -> dict[str, Any]:
    """Gaps in % by question."""
    from tests.benchmarks.bounds import measure

    gaps = {}
    for name, start, goal in QUESTIONS[:count]:
        found = measure(name, (*start, *goal), [SECONDS], 0)
        gaps[f"{name} {start} {goal}"] = found.get(f"gap_percent_{SECONDS:g}s")
    return {"gap_percent": gaps}


def naming(count: int) -> dict[str, Any]:
    """The outcome on each log; a third each without, with, and with an unknown hidden effect."""
    from tests.benchmarks.laboratory import draws

    third = -(-count // 3)
    chosen = draws(third, 0, 0, 0, FIRST_LOG) + draws(0, 0, 0, third, FIRST_LOG)
    return _outcomes([*chosen, *draws(0, 1, 0, 0, FIRST_LOG)[:third]])


def several(count: int) -> dict[str, Any]:
    """The outcome on each log of SEVERAL."""
    return _outcomes(SEVERAL[:count])


def _outcomes(chosen: Sequence[tuple[str, str, int]]) -> dict[str, Any]:
    """The outcome on each of some drawn logs."""
    from tests.hidden_effects.laboratory.examine import examine
    from tests.hidden_effects.runner import log_folder

    rows = [examine(*one, split="tuning", folder=log_folder() / "laboratory") for one in chosen]
    return {"outcomes": {row["log"]: row["outcome"] for row in rows}}


SEEDED = ("hard", "relief", "coarse", "coarse time", "steep", "budget")
"""Measures whose maps and questions are drawn."""
MEASURES: dict[str, Callable[..., dict[str, Any]]] = {
    "planning": planning,
    "hard": hard,
    "relief": relief,
    "coarse": coarse,
    "steep": steep,
    "budget": budget,
    "time": lambda count: planning(count, objective="time"),
    "coarse time": partial(coarse, objective="time"),
    "anytime": lambda count: planning(count, ITERATIONS),
    "certificate": certificate,
    "naming": naming,
    "several": several,
}
