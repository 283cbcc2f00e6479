"""How far answers stand above the best routes that are known, on hard maps.

    python -m tests.benchmarks.best_known                      40 questions on 10 maps, eight hours
    python -m tests.benchmarks.best_known --seed 7 --count 2 --seconds 60
    python -m tests.benchmarks.best_known --maps maze rocks --json known.json
    python -m tests.benchmarks.best_known --terrain FOLDER     relief of one's own (.asc) as well

Maps and questions are those of tests.benchmarks.hard_maps for a seed; any seed gives fresh ones.
Every question is answered at once and with ten seconds. Then a search by chance
(tests.benchmarks.random_search) begins with both answers and takes ``--seconds`` of CPU time. Its
cheapest feasible route is the best known. Ctrl-C keeps what is done.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from planner.search.ompl import answer
from planner.terrain.heightmap import Terrain
from tests.benchmarks.hard_maps import KINDS, MADE, made, own_maps, places
from tests.benchmarks.peers.case import Case, case_of
from tests.benchmarks.random_search import Known, RandomSearch, run_of

MAPS = tuple(name for names in KINDS.values() for name in names)
COUNT, SECONDS, SEED, MOST_MAPS = 4, 600.0, 11, 10
"""Questions on each map, CPU s of the search for each, first seed, and maps."""
TEN_SECONDS = 10.0
"""s of time budget."""
ANSWERS = ("at once", "ten seconds")
BARS = {
    "at once": {"median": 0.15, "worst": 1.0},
    "ten seconds": {"median": 0.02, "worst": 0.5},
}
"""% of the best known energy."""
Row = dict[str, Any]


def drawn(seed: int, most: int = MOST_MAPS) -> Iterator[tuple[str, int]]:
    """Names and seeds of maps: all of one seed, then those that further seeds make anew."""
    for number in range(most):
        further, k = divmod(number - len(MAPS), len(MADE))
        yield (MAPS[number], seed) if further < 0 else (tuple(MADE)[k], seed + 1 + further)


def questions(name: str, terrain: Terrain, count: int, seed: int) -> Iterator[tuple[str, Case]]:
    """Questions on a map, each with its name."""
    for k, asked in enumerate(places(terrain, count, seed), 1):
        yield f"{name} {seed}.{k}", case_of(terrain.name, asked, terrain)


def searched(
    case: Case, seconds: float, seed: int, ten_seconds: float = TEN_SECONDS
) -> tuple[dict[str, Known], RandomSearch]:
    """Both answers to a question, and a search that began with them; no answer without a route."""
    search = RandomSearch(case, seed)
    answers: dict[str, Known] = {}
    for name, further in zip(ANSWERS, ({}, {"time_budget_s": ten_seconds}), strict=True):
        candidate = answer(run_of(case, **further)).candidate
        if candidate is None:
            break
        (path, _), *_ = candidate.legs
        answers[name] = search.begin(candidate.route, path, name)
    else:
        search.run(seconds)
    return answers, search


def row_of(key: str, answers: dict[str, Known], search: RandomSearch) -> Row:
    """One line of the table: energies in J, excesses in %, what found the best, and all routes."""
    best = search.best
    shown = {**answers, "best known": best}
    return {
        "question": key,
        **{name: one.route.energy_j for name, one in shown.items()},
        "excess": {
            name: 100.0 * (one.route.energy_j / best.route.energy_j - 1.0)
            for name, one in answers.items()
        },
        "found by": best.source,
        "driven": search.driven,
        "start": search.case.start,
        "goal": search.case.goal,
        "paths": {name: one.path.tolist() for name, one in shown.items()},
    }


def line_of(row: Row) -> str:
    """One line of the table as text."""
    energies = "".join(f"{row[name]:12.2f}" for name in (*ANSWERS, "best known"))
    excesses = "".join(f"{row['excess'][name]:10.3f}" for name in ANSWERS)
    return f"{row['question']:24s}{energies}{excesses}  {row['found by']}"


def head() -> str:
    """What the columns are."""
    energies = "".join(f"{name:>12s}" for name in (*ANSWERS, "best known"))
    return f"{'J; excess in %':24s}{energies}{'at once':>10s}{'10 s':>10s}  best found by"


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Median and worst excess of both answers against the bars."""
    found: dict[str, Any] = {"questions": len(rows), "bars": BARS}
    for name in ANSWERS:
        excesses = [row["excess"][name] for row in rows]
        figures = {"median": statistics.median(excesses), "worst": max(excesses)}
        found[name] = {kind: round(value, 3) for kind, value in figures.items()}
    found["holds"] = all(
        found[name][kind] <= bar for name, bars in BARS.items() for kind, bar in bars.items()
    )
    return found


def rows_for(maps: Sequence[tuple[str, int, Terrain]], count: int, seconds: float) -> Iterator[Row]:
    """Rows of the table as they are found; each is printed. One question of every map in turn."""
    print(head(), flush=True)
    waiting = [questions(name, terrain, count, seed) for name, seed, terrain in maps]
    for _ in range(count):
        for of_map in waiting:
            key, case = next(of_map)
            answers, search = searched(case, seconds, seed=1)
            if len(answers) < len(ANSWERS):
                print(f"{key:24s}no route", flush=True)
                continue
            row = row_of(key, answers, search)
            print(line_of(row), flush=True)
            yield row


def measure(seed: int = SEED, count: int = 1, seconds: float = 30.0) -> dict[str, Any]:
    """Excesses on one map of each kind but the largest, for ``make bench``."""
    maps = [(name, seed, made(name, seed)) for name in MAPS if name != "jacksboro"]
    return {"search_cpu_s": seconds, **summary(list(rows_for(maps, count, seconds)))}


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--maps", nargs="*", choices=MAPS, help="of the seed; ten without it")
    parser.add_argument("--count", type=int, default=COUNT, help="questions on each map")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="CPU s of each search")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--terrain", type=Path)
    parser.add_argument("--json", type=Path)
    chosen = parser.parse_args()
    names = [(name, chosen.seed) for name in chosen.maps] if chosen.maps else drawn(chosen.seed)
    maps = [(name, seed, made(name, seed)) for name, seed in names]
    if chosen.terrain:
        own = own_maps(chosen.terrain)
        maps += [(name, chosen.seed, terrain) for name, terrain in own.items()]
    rows: list[Row] = []
    try:
        for row in rows_for(maps, chosen.count, chosen.seconds):
            rows.append(row)
            if chosen.json:
                text = json.dumps({"summary": summary(rows), "rows": rows}, indent=1)
                chosen.json.write_text(text + "\n", encoding="utf-8")
    except KeyboardInterrupt:
        print("stopped early", file=sys.stderr)
    if rows:
        print("\n".join([head(), *map(line_of, rows)]))
        print(json.dumps(summary(rows)))


if __name__ == "__main__":
    main()
