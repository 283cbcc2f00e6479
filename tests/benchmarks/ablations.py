"""What tuned constants are worth: each is replaced, and the change of a result is measured.

    python -m tests.benchmarks.ablations                       the whole table, some hours
    python -m tests.benchmarks.ablations --only SURPLUS --questions 4
    python -m tests.benchmarks.ablations --save                also into docs/benchmarks/
    python -m tests.benchmarks.ablations --only DETOURS --seed 5   confirms it on other questions

Constants stand in ablation_table.toml. Every value is measured in a fresh process:

    planning     change of the energy in % (mean, worst, best), and ratio of the CPU times
    time         the same for answers of least time, with their duration
    hard         energy among obstacles and on relief
    relief       energy on relief up to the slope limit
    coarse       energy on maps with cells of many metres, so many questions on each
    steep        energy on open hills, without and with payload, so many questions on each
    anytime      as planning, with iterations given
    budget       as hard and on a hill, with a time budget
    certificate  change of the gap between route and lower bound, in percentage points
    naming       right and wrong verdicts on drawn laboratory logs, of so many
"""

from __future__ import annotations

import argparse
import ast
import itertools
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from tests.benchmarks.ablated_constant import environment, in_compiled_code, replace_when_imported

ROOT = Path(__file__).parents[2]
RIGHT = ("exact", "tied", "complete", "sensor")
"""Outcomes of tests.hidden_effects.laboratory that are as good as the log allows."""
FIRST_LOG = 300
"""Seed of the first log of ``naming``; rules are tuned on smaller ones."""
TABLE = Path(__file__).with_name("ablation_table.toml")
KEPT = ROOT / "docs" / "benchmarks" / "ablations.json"
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


@dataclass(frozen=True)
class Constant:
    """One entry of the table, see there."""

    module: str
    name: str
    value: Any
    unit: str
    decides: str
    measured: str
    ablated: tuple[Any, ...]
    compiled: bool = False

    @property
    def label(self) -> str:
        """Module without its package, and name."""
        return f"{self.module.partition('.')[2]}.{self.name}"


def table(path: Path = TABLE) -> list[Constant]:
    """All entries; arrays of the file become tuples, as constants are."""
    entries = tomllib.loads(path.read_text(encoding="utf-8"))["constant"]
    return [Constant(**{key: _tuples(value) for key, value in one.items()}) for one in entries]


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {float(key): _tuples(one) for key, one in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


# What a fresh process measures. Nothing of planner is imported before the constant is replaced.


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
    from tests.hidden_effects.laboratory.examine import examine
    from tests.hidden_effects.runner import log_folder

    third = -(-count // 3)
    chosen = draws(third, 0, 0, 0, FIRST_LOG) + draws(0, 0, 0, third, FIRST_LOG)
    chosen += draws(0, 1, 0, 0, FIRST_LOG)[:third]
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
}


# What the results say together.


def worth(base: Mapping[str, Any], ablated: Mapping[str, Any]) -> dict[str, float]:
    """Change of a result by an ablation, in the units of the module's head.

    Raises:
        ValueError: the two are of different measures.
    """
    if set(base) != set(ablated):
        raise ValueError("results of different measures")
    if "answers" in base:
        pairs = list(zip(base["answers"].values(), ablated["answers"].values(), strict=True))
        changes = [100.0 * (b / a - 1.0) for a, b in pairs if a and b]
        lost = sum(a is not None and b is None for a, b in pairs)
        return {
            "percent": statistics.fmean(changes) if changes else math.nan,
            "worst_percent": max(changes, default=math.nan),
            "best_percent": min(changes, default=math.nan),
            "cpu_ratio": ablated["cpu_s"] / base["cpu_s"],
            "routes_lost": lost,
        }
    if "gap_percent" in base:
        gaps = zip(base["gap_percent"].values(), ablated["gap_percent"].values(), strict=True)
        changes = [b - a for a, b in gaps if a is not None and b is not None]
        return {"gap_points": statistics.fmean(changes), "worst_points": max(changes)}
    found = {"logs": len(base["outcomes"])}
    for when, one in (("", ablated), ("_before", base)):
        said = list(one["outcomes"].values())
        found[f"right{when}"] = sum(word in RIGHT for word in said)
        found[f"wrong{when}"] = said.count("wrong")
    return found


def in_words(change: Mapping[str, float]) -> str:
    """The change in a cell of the table."""
    if "percent" in change:
        lost = f", {change['routes_lost']:.0f} routes lost" if change["routes_lost"] else ""
        most = f"worst {change['worst_percent']:+.2f}"
        if "best_percent" in change:  # earlier rows do not have it
            most += f", best {change['best_percent']:+.2f}"
        return f"answer {change['percent']:+.3f} % ({most} %), CPU x{change['cpu_ratio']:.2f}{lost}"
    if "gap_points" in change:
        return f"gap {change['gap_points']:+.2f} points (worst {change['worst_points']:+.2f})"
    return (
        f"{change['right']} right, {change['wrong']} wrong of {change['logs']}, "
        f"before {change['right_before']} and {change['wrong_before']}"
    )


def in_fresh_process(
    measured: str,
    count: int,
    constant: Constant | None = None,
    value: Any = None,
    seed: int = ABLATED_SEED,
) -> dict[str, Any]:
    """What a process measures in which a constant has another value; None for the code as it is."""
    command = [sys.executable, "-m", "tests.benchmarks.ablations", "--worker", measured]
    command += ["--questions", str(count), "--seed", str(seed)]
    if constant is None:
        return _result(command, {})
    changed = [*command, "--set", constant.module, constant.name, repr(value)]
    if not (constant.compiled or in_compiled_code(constant.module, constant.name)):
        return _result(changed, {})
    cache = numba_cache()
    if not cache.exists():
        _result(command, {"NUMBA_CACHE_DIR": str(cache)})
    with tempfile.TemporaryDirectory() as folder:
        own = environment(constant.module, cache, Path(folder))
        _result(changed, own)  # compiles, so that the time is not counted
        return _result(changed, own)


def _result(command: Sequence[str], variables: Mapping[str, str]) -> dict[str, Any]:
    done = subprocess.run(
        command,
        cwd=ROOT,
        # Tables on disk follow from the sources, which an ablation leaves as they are.
        env={**os.environ, **variables, "JOULEPATH_KEEP_TABLES": "0"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def numba_cache() -> Path:
    """Folder in which numba keeps what is compiled of the code as it is, by its own rules.

    joulepath's rules go by the text of the sources, which an ablation leaves as it is.
    """
    import planner
    from planner.code_cache import Sources, cache_base

    package = Path(planner.__file__).parent
    return cache_base() / "ablations" / Sources(package).key(package.name)


def rows(
    constants: Sequence[Constant], count: int, seed: int = ABLATED_SEED
) -> Iterator[dict[str, Any]]:
    """One for each value that a constant is given, as they come."""
    base: dict[str, dict[str, Any]] = {}
    command = ("git", "describe", "--always", "--dirty")
    commit = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for one in constants:
        if one.measured not in base:
            in_fresh_process(one.measured, count, seed=seed)  # compiles what is not on disk
            base[one.measured] = in_fresh_process(one.measured, count, seed=seed)
        for value in one.ablated:
            found = in_fresh_process(one.measured, count, one, value, seed)
            yield {
                "constant": one.label,
                "value": one.value,
                "ablated": value,
                "unit": one.unit,
                "decides": one.decides,
                "measured": one.measured,
                "questions": count,
                "commit": commit.strip(),
                **worth(base[one.measured], found),
            }


def page(kept: Sequence[Mapping[str, Any]]) -> str:
    """The table as Markdown."""
    lines = [
        "# What tuned constants are worth",
        "",
        "Written by `python -m tests.benchmarks.ablations --save`. Each constant is given another",
        "value in a fresh process; the last column says how the answer changes: energy,",
        "with `time` duration, with `certificate` the gap, with `naming` verdicts on drawn logs.",
        "The code may have changed since a row's commit.",
        "",
        "| constant | value | ablated | unit | decides | measured | questions | worth | commit |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in kept:
        cells = (
            row["value"],
            row["ablated"],
            row["unit"],
            row["decides"],
            row["measured"],
            row["questions"],
            in_words(row),
            row["commit"],
        )
        lines.append(f"| `{row['constant']}` | {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


def key_of(row: Mapping[str, Any]) -> tuple[str, str, str]:
    """What a row is of: constant, measure and value; arrays read alike from a table and a file."""
    return row["constant"], row["measured"], json.dumps(row["ablated"])


def keys(constants: Sequence[Constant]) -> set[tuple[str, str, str]]:
    """Of all rows that a whole table has."""
    return {
        (one.label, one.measured, json.dumps(value)) for one in constants for value in one.ablated
    }


def save(
    new: Sequence[Mapping[str, Any]],
    place: Path = KEPT,
    of: set[tuple[str, str, str]] | None = None,
) -> None:
    """Write rows beside those that an earlier run kept; with ``of``, only rows with these keys."""
    kept = json.loads(place.read_text(encoding="utf-8")) if place.exists() else []
    merged = {key_of(row): row for row in (*kept, *json.loads(json.dumps(new)))}
    ordered = [merged[key] for key in sorted(merged) if of is None or key in of]
    place.write_text(json.dumps(ordered, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    place.with_suffix(".md").write_text(page(ordered), encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.ablations")
    parser.add_argument("--only", nargs="*", help="names, or parts of module.NAME")
    parser.add_argument("--questions", type=int, default=8, help="or logs, at most 12")
    parser.add_argument("--save", action="store_true", help=f"write {KEPT.relative_to(ROOT)}, .md")
    parser.add_argument(
        "--seed", type=int, default=ABLATED_SEED, help=f"of the questions of {' and '.join(SEEDED)}"
    )
    parser.add_argument("--worker", choices=MEASURES, help=argparse.SUPPRESS)
    parser.add_argument("--set", nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args(arguments)
    if asked.worker:
        if asked.worker == "budget":
            # Before planner takes its clock.
            time.perf_counter = time.process_time
        if asked.set:
            module, name, value = asked.set
            replace_when_imported(module, name, ast.literal_eval(value))
        seeds = [asked.seed] if asked.worker in SEEDED else []
        print(json.dumps(MEASURES[asked.worker](asked.questions, *seeds)))
        return 0
    if asked.save and asked.seed != ABLATED_SEED:
        parser.error(f"--save keeps rows of seed {ABLATED_SEED} only")
    whole = table()
    chosen = [c for c in whole if not asked.only or any(word in c.label for word in asked.only)]
    for row in rows(chosen, asked.questions, asked.seed):
        told = f"{row['value']} -> {row['ablated']} {row['unit'] if row['unit'] != '1' else ''}"
        print(f"{row['constant']:<58} {told:<22} {in_words(row)}", flush=True)
        if asked.save:
            save([row], of=keys(whole))
    return 0


if __name__ == "__main__":
    sys.exit(main())
