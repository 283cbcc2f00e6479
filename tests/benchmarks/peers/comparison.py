"""Our planner and others side by side, on the same questions, priced by the same integrator.

    python -m tests.benchmarks.peers                        20 questions, half an hour on two cores
    python -m tests.benchmarks.peers --questions 1 --seconds 5 --others 2
    python -m tests.benchmarks.peers --maps cone saddle     other maps' rows stay as they are
    python -m tests.benchmarks.peers --only ours            the same questions, others' rows stay
    python -m tests.benchmarks.peers --picture              only the summary and the picture again

Writes docs/benchmarks/planning.json and docs/images/planning.svg. Times are CPU seconds of the
search itself, without reading the map or working out costs by node: a busy machine tells the same.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from planner.terrain.catalogue import open_map
from tests.benchmarks.peers import checks
from tests.benchmarks.peers.picture import draw
from tests.benchmarks.peers.report import Row, findings_of, row_of, summary
from tests.benchmarks.questions import FIRST_SEED, MAPS, questions

KEPT = Path("docs/benchmarks/planning.json")
PICTURE = Path("docs/images/planning.svg")
ALONE = ("ours", "MCP_Geometric", "Dijkstra", "ttcrpy")
POSES = ("BIT*, energy", "Informed RRT*, energy", "RRT*, energy", "BIT*, work")
REFINED = "everything, refined"
LONG = 10.0
"""s for our own long run."""
Findings = list[dict[str, Any]]


def budgets(options: argparse.Namespace) -> dict[str, float]:
    """CPU seconds by method."""
    poses = {**dict.fromkeys(POSES, options.others), POSES[0]: options.seconds}
    return {"ours": LONG, **poses, REFINED: options.optimise_waypoints}


def find(task: dict[str, Any], paths: Sequence[Any] = ()) -> Findings:
    """Findings of one method on one question, from a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.peers.measure", json.dumps(task)],
        input=json.dumps(list(paths)),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"{task['method']} on {task['map']}: {done.stderr[-2000:]}")
    found: Findings = json.loads(done.stdout)
    return found


def again(row: Row, methods: Sequence[str], budget: dict[str, float]) -> Row:
    """The same question with some methods measured anew.

    What is refined for the best known route are the paths of these.
    """
    task = {"map": row["map"], "asked": {end: row[end] for end in ("start", "goal")}}
    fresh: Findings = []
    for method in methods:
        if method != REFINED:
            fresh += find({**task, "method": method, "seconds": budget.get(method, 0.0)})
    if REFINED in methods:
        asked = {**task, "method": "best known", "seconds": budget[REFINED]}
        fresh += find(asked, _promising(fresh))
    # Methods with several findings carry names of their own beside the one asked for.
    names = {one["method"] for one in fresh} | set(methods)
    kept = [one for one in findings_of(row) if one["method"] not in names]
    found = row_of(row["map"], task["asked"], kept + fresh)
    had = budget[POSES[0]] if POSES[0] in methods else row["poses_s"]
    return {**found, "poses_s": had}


def answer(name: str, asked: dict[str, Any], options: argparse.Namespace) -> Row:
    """Everything on one question."""
    task = {"map": name, "asked": asked}
    budget = budgets(options)
    # Ours has two threads, so nothing beside it.
    found = find({**task, "method": "ours", "seconds": LONG})
    others = [name for name in (*ALONE[1:], *POSES) if name not in options.without]
    with ThreadPoolExecutor(options.workers) as pool:
        asks = [{**task, "method": m, "seconds": budget.get(m, 0.0)} for m in others]
        for findings in pool.map(find, asks):
            found += findings
    asking = {**task, "method": "best known", "seconds": budget[REFINED]}
    found += find(asking, _promising(found))
    return {**row_of(name, asked, found), "poses_s": options.seconds}


def _promising(found: Findings) -> list[Any]:
    """Paths by their least energy, only the last of each search's."""
    latest = {(one["method"], one.get("cost")): one for one in found}

    def energy(one: dict[str, Any]) -> float:
        return min((e for e in one["energies"].values() if e is not None), default=float("inf"))

    return [one["path"] for one in sorted(latest.values(), key=energy)]


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Ask all questions and put the results beside those that are kept."""
    document = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    rows: list[Row] = document.get("rows", [])
    if options.only:
        chosen = [row["map"] in options.maps for row in rows]
        rows = [
            again(row, options.only, budgets(options)) if anew else row
            for row, anew in zip(rows, chosen, strict=True)
        ]
    else:
        rows = [row for row in rows if row["map"] not in options.maps]
    for name in () if options.only else options.maps:
        seed = FIRST_SEED + MAPS.index(name)
        for asked in questions(open_map(name), options.questions, seed):
            rows.append(answer(name, asked, options))
            own = rows[-1]["methods"].get("ours", [{}])[0].get("percent")
            print(f"{name}: {rows[-1]['best_known_j']:.1f} J, ours {own}", flush=True)
    kept = document.get("checks", {})
    return write(rows, kept if "checks" in options.without else checks.whole())


def write(rows: list[Row], kept: dict[str, Any]) -> dict[str, Any]:
    """Summary, rows and picture into docs/."""
    rows.sort(key=lambda row: MAPS.index(row["map"]))
    told = summary(rows)
    head = json.dumps({"summary": told, "checks": kept}, indent=1, ensure_ascii=False)
    # A question a line.
    lines = ",\n".join(json.dumps(row, ensure_ascii=False) for row in rows)
    KEPT.write_text(f'{head[:-2]},\n "rows": [\n{lines}\n]}}\n', encoding="utf-8")
    PICTURE.write_text(draw(rows), encoding="utf-8")
    return told | {"checks": kept}


def side_by_side(arguments: Sequence[str] = ()) -> dict[str, Any]:
    """The whole comparison, as ``make bench`` runs it; returns its summary with ``holds``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--questions", type=int, default=4, help="on each map")
    parser.add_argument("--maps", nargs="+", default=list(MAPS), choices=MAPS)
    parser.add_argument("--seconds", type=float, default=20.0, help="for BIT* on poses")
    parser.add_argument("--others", type=float, default=10.0, help="s for OMPL's other planners")
    parser.add_argument("--polish", type=float, default=20.0, help="s for the best known route")
    parser.add_argument("--workers", type=int, default=2, help="processes at once")
    choices = [*ALONE[1:], *POSES, "checks"]
    parser.add_argument("--without", nargs="*", default=[], choices=choices)
    parser.add_argument("--only", nargs="+", choices=[*ALONE, *POSES, REFINED], help="these anew")
    parser.add_argument("--picture", action="store_true", help="only the summary and the picture")
    options = parser.parse_args(arguments)
    if options.picture:
        document = json.loads(KEPT.read_text(encoding="utf-8"))
        told = write(document["rows"], document["checks"])
    else:
        told = run(options)
    parts = [*told["bars"].values(), *told["checks"].values()]
    return {**told, "holds": all(part["holds"] for part in parts)}
