"""How fast and how good answers are where it is hard: among obstacles and on real relief.

    python -m tests.benchmarks.hard_maps                          the fixed questions
    python -m tests.benchmarks.hard_maps --seed 7 --count 4       others, on maps of another seed
    python -m tests.benchmarks.hard_maps --json after.json --against before.json
    python -m tests.benchmarks.hard_maps --only maze --profile    where the time goes, by function
    python -m tests.benchmarks.hard_maps --terrain FOLDER         relief of one's own (.asc) as well

Obstacles: the catalogue's warehouse, and three maps made here from a seed: rows of shelves on
rolling ground, rocks strewn over hills, and a maze. Relief: Jacksboro at its own scale and at
1:100. Every question has a new goal on a map that this process knows already. Loaded relief is that
at 1:100 with payloads that it may be too steep for. "No route" asks for a walled-in goal. Times are
CPU seconds of all threads, so that other work on the machine counts little; on two idle cores an
answer takes between half of them and all.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import pstats
import statistics
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np

from planner import plan_route
from planner.search.field import CostField
from planner.search.grid import Lattice, build_lattice, cost_to_go, grid_path
from planner.search.requests import PlanRequest
from planner.search.resolution import MARGIN
from planner.search.situation import situation_of
from planner.search.solve import pipeline
from planner.terrain.catalogue import open_map
from planner.terrain.footprint import body_fits
from planner.terrain.heightmap import Terrain

Place = tuple[float, float]
KINDS = {
    "obstacles": ("warehouse", "shelves", "rocks", "maze"),
    "relief": ("jacksboro-1to100", "jacksboro"),
}
"""Maps by the kind of ground, which the bars are for."""
LOADED = ("jacksboro-1to100 loaded",)
"""Relief that is crossed with payloads, some of which find no route."""
PAYLOADS = (4.0, 6.0, 8.0, 10.0, 12.0)
"""kg on a robot of 12 kg."""
COUNT = {"obstacles": 10, "relief": 20, "loaded relief": 20}
"""Questions on each map."""
WALLED = ("shelves walled", "rocks walled", "maze walled")
"""Maps with a goal that nothing leads to."""
BARS = {"p50": 0.25, "p95": 0.8, "worst": 2.0}
"""s of a warm answer on two cores."""
BUDGETS = (0.05, 0.5, 2.0, 10.0)
"""s of time budget that are given, and to be kept within ``LATE``."""
LATE = 0.1
SEED = 1
STANDS_ON = 0.2
"""tan(slope) at most where a question begins or ends: there the robot stands with any yaw."""


def rolling(shape: tuple[int, int], cell: float, degrees: float, seed: int) -> Any:
    """Heights (ny, nx) of smooth hills of 5 to 15 m with this mean slope."""
    rng = np.random.default_rng(seed)
    y, x = (cell * axis for axis in np.indices(shape))
    heights = np.zeros(shape)
    for length, azimuth, phase in rng.uniform((5.0, 0.0, 0.0), (15.0, 7.0, 7.0), (20, 3)):
        k = 2.0 * np.pi / length
        heights += np.sin(k * (np.cos(azimuth) * x + np.sin(azimuth) * y) + phase) / k
    slope = np.hypot(*np.gradient(heights, cell)).mean()
    return heights * (np.tan(np.radians(degrees)) / slope)


def shelves(seed: int) -> Terrain:
    """36 m by 26 m of shelves with aisles of 0.9 to 1.6 m, on ground of 1.5°."""
    rng = np.random.default_rng(seed)
    solid = np.zeros((260, 360), bool)
    row = 20
    while row < 235:
        column = 15
        while column < 330:
            length = int(rng.integers(40, 110))
            solid[row : row + 8, column : min(column + length, 345)] = True
            column += length + int(rng.integers(9, 16))
        row += 8 + int(rng.integers(9, 17))
    heights = rolling(solid.shape, 0.1, 1.5, seed)
    return Terrain.from_arrays(heights, cell=(0.1, 0.1), obstacles=solid, name="shelves")


def rocks(seed: int) -> Terrain:
    """45 m by 45 m of hills of 4° with 160 rocks of 0.2 to 1.2 m."""
    rng = np.random.default_rng(seed)
    solid = np.zeros((300, 300), bool)
    y, x = 0.15 * np.indices(solid.shape)
    for px, py, radius in rng.uniform((0.0, 0.0, 0.2), (45.0, 45.0, 1.2), (160, 3)):
        solid |= np.hypot(x - px, y - py) < radius
    heights = rolling(solid.shape, 0.15, 4.0, seed)
    return Terrain.from_arrays(heights, cell=(0.15, 0.15), obstacles=solid, name="rocks")


def maze(seed: int) -> Terrain:
    """A maze of 12 by 9 rooms of 1.9 m with walls of 0.2 m; every fifth wall is left out."""
    rng = np.random.default_rng(seed)
    across, down, room, wall = 12, 9, 19, 2
    pitch = room + wall
    solid = np.zeros((down * pitch + wall, across * pitch + wall), bool)
    for n in range(max(across, down) + 1):
        solid[n * pitch : n * pitch + wall, :] = True
        solid[:, n * pitch : n * pitch + wall] = True

    def open_wall(a: tuple[int, int], b: tuple[int, int]) -> None:
        (ja, ia), (jb, ib) = sorted((a, b))
        rows = slice(ja * pitch + wall, (jb + 1) * pitch)
        solid[rows, ia * pitch + wall : (ib + 1) * pitch] = False

    seen, trail = {(0, 0)}, [(0, 0)]
    while trail:
        j, i = trail[-1]
        beside = [(j + a, i + b) for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0))]
        new = [
            (a, b) for a, b in beside if 0 <= a < down and 0 <= b < across and (a, b) not in seen
        ]
        if new:
            to = new[int(rng.integers(len(new)))]
            open_wall((j, i), to)
            seen.add(to)
            trail.append(to)
        else:
            trail.pop()
    for j, i in np.argwhere(rng.random((down - 1, across - 1)) < 0.2):
        open_wall((j, i), (j + 1, i) if rng.random() < 0.5 else (j, i + 1))
    flat = np.zeros(solid.shape)
    return Terrain.from_arrays(flat, cell=(0.1, 0.1), obstacles=solid, name="maze")


def walled(terrain: Terrain) -> Terrain:
    """The same map with a wall from south to north, at three quarters of its width."""
    solid = terrain.obstacles.copy()
    at = int(0.75 * solid.shape[1])
    solid[:, at : at + 3] = True
    return Terrain.from_arrays(
        terrain.heights, cell=terrain.cell, obstacles=solid, name=f"{terrain.name} walled"
    )


MADE = {"shelves": shelves, "rocks": rocks, "maze": maze}


def made(name: str, seed: int) -> Terrain:
    """A map by its name; ``seed`` is for those that are made here."""
    kind = name.removesuffix(" walled").removesuffix(" loaded")
    if kind not in MADE:
        return open_map(kind)
    terrain = MADE[kind](seed)
    return walled(terrain) if name != kind else terrain


def own_maps(folder: Path) -> dict[str, Terrain]:
    """Relief of one's own by name: every .asc of a folder."""
    return {file.stem: open_map(str(file)) for file in sorted(folder.glob("*.asc"))}


def places(terrain: Terrain, count: int, seed: int) -> Iterator[dict[str, Any]]:
    """Starts and goals at random with room for the robot, a third of the map apart.

    They have a path on the grid; on a walled map the start is west of the wall, the goal east.
    """
    rng = np.random.default_rng(seed)
    west, south, east, north = terrain.extent
    request = PlanRequest.from_json(
        {"map": terrain.name, "start": {"x": west, "y": south}, "goal": {"x": east, "y": north}}
    )
    situation = situation_of(request, terrain=terrain)
    field = situation.field("energy", MARGIN)
    # Of its own: what is found here is not to be known when the question is asked.
    lattice = build_lattice(field)
    apart = 0.35 * min(east - west, north - south)
    across = terrain.name.endswith("walled")
    while count:
        (x, to_x), (y, to_y) = (
            a + (b - a) * rng.uniform(0.03, 0.97, 2) for a, b in ((west, east), (south, north))
        )
        if np.hypot(to_x - x, to_y - y) < apart:
            continue
        if across and not x < west + 0.7 * (east - west) < west + 0.8 * (east - west) < to_x:
            continue
        if np.hypot(*terrain.gradient((x, to_x), (y, to_y))).max() > STANDS_ON:
            continue
        ends = (float(x), float(y)), (float(to_x), float(to_y))
        yaws = np.linspace(0.0, np.pi, 16, endpoint=False)
        if not all(any(body_fits(field, *end, yaw) for yaw in yaws) for end in ends):
            continue
        if not across and not _leads(field, lattice, *ends):
            continue
        count -= 1
        start, goal = ({"x": x, "y": y} for x, y in ends)
        yield {"start": start, "goal": goal}


def questions(name: str, terrain: Terrain, count: int, seed: int) -> Iterator[dict[str, Any]]:
    """Places, and on loaded relief a payload with each."""
    rng = np.random.default_rng([seed, len(PAYLOADS)])
    for asked in places(terrain, count, seed):
        mass = float(rng.choice(PAYLOADS))
        yield asked | ({"payload": {"mass": mass}} if name.endswith("loaded") else {})


def _leads(field: CostField, lattice: Lattice, start: Place, goal: Place) -> bool:
    """Whether the grid has a path from start to goal."""
    to_go = cost_to_go(field, lattice, goal, start=start)
    return grid_path(field, lattice, to_go, start) is not None


def ask(terrain: Terrain, asked: dict[str, Any], **further: Any) -> dict[str, Any]:
    """What one question takes, and its energy, J."""
    wall, begun = time.perf_counter(), time.process_time()
    answer = plan_route(terrain=terrain, **asked, **further)
    taken = time.process_time() - begun
    found = {"cpu_s": taken, "wall_s": time.perf_counter() - wall, "status": answer.status}
    if answer.routes:
        found["energy_j"] = answer.routes[0].energy_j
    return found


def measured(name: str, terrain: Terrain, count: int, seed: int) -> dict[str, Any]:
    """Answers on one map by name of their question; the first one warms the map up."""
    found = {}
    for k, asked in enumerate(questions(name, terrain, count + 1, seed)):
        one = ask(terrain, asked)
        if k == 0:
            continue
        key = f"{name} {seed}.{k}"
        found[key] = one
        energy = f"{one['energy_j']:10.2f} J" if "energy_j" in one else one["status"]
        print(f"{key:26s} {one['cpu_s']:7.3f} s {energy}", flush=True)
    return found


def spread(answers: dict[str, Any], key: str = "cpu_s") -> dict[str, float]:
    """Median, 95 % quantile and worst time."""
    taken = np.array([one[key] for one in answers.values()])
    p50, p95 = np.quantile(taken, (0.5, 0.95))
    figures = {"p50": p50, "p95": p95, "worst": taken.max()}
    return {"count": len(taken), **{name: round(float(v), 3) for name, v in figures.items()}}


def times(seed: int = SEED, count: int | None = None) -> dict[str, Any]:
    """CPU seconds of warm answers by kind of ground, for ``make bench``."""
    found: dict[str, Any] = {}
    for kind, names in {**KINDS, "loaded relief": LOADED}.items():
        answers = {}
        for name in names:
            answers |= measured(name, made(name, seed), count or COUNT[kind], seed)
        found[kind] = {"maps": names, "cpu_s": spread(answers), "wall_s": spread(answers, "wall_s")}
    answers = {}
    for name in WALLED:
        answers |= measured(name, made(name, seed), count or COUNT["obstacles"], seed)
    found["no route"] = {"maps": WALLED, "cpu_s": spread(answers)}
    warm = [found[kind]["wall_s"] for kind in (*KINDS, "loaded relief")]
    found["bar"] = "wall p50 ≤ 0.25 s, p95 ≤ 0.8 s, worst ≤ 2 s; no route: p95 at most twice that"
    found["holds"] = (
        all(one[name] <= bar for one in warm for name, bar in BARS.items())
        and found["no route"]["cpu_s"]["p95"] <= 2.0 * BARS["p95"]
    )
    return found


def budgets(seed: int = SEED) -> dict[str, Any]:
    """How late answers with a time budget come, CPU s, on one map of each kind, for ``make bench``.

    The planner's clock is the CPU time of the process, which other programs do not advance. Late is
    what comes after the end of the budget, or after the first route where that comes later.
    """
    late: dict[str, float] = {}
    clock = SimpleNamespace(perf_counter=time.process_time)
    firsts: list[float] = []
    plain = pipeline.priced

    def priced(*given: Any) -> Any:
        route = plain(*given)
        if threading.current_thread() is threading.main_thread():
            firsts.append(time.process_time())
        return route

    where = "planner.search"
    with ExitStack() as patched:
        patched.enter_context(mock.patch(f"{where}.run.time", clock))
        patched.enter_context(mock.patch(f"{where}.plan.time", clock))
        patched.enter_context(mock.patch(f"{where}.solve.pipeline.priced", priced))
        for name in ("shelves", "jacksboro-1to100"):
            terrain = made(name, seed)
            for asked in places(terrain, 2, seed):
                plan_route(terrain=terrain, **asked)
                for budget in BUDGETS:
                    firsts.clear()
                    begun = time.process_time()
                    plan_route(terrain=terrain, **asked, time_budget_s=budget)
                    ended = time.process_time()
                    key = f"{name}, {budget:g} s"
                    taken = round(ended - max(begun + budget, firsts[0]), 3)
                    late[key] = max(late.get(key, taken), taken)
                    print(f"{key:26s} late {taken:7.3f} s", flush=True)
    return {"late_cpu_s": late, "bar": f"≤ {LATE} s", "holds": max(late.values()) <= LATE}


def compared(before: dict[str, Any], after: dict[str, Any]) -> str:
    """What changed between two runs of the same questions."""
    both = [key for key in after if key in before]
    more, speed = [], []
    for key in both:
        speed.append(after[key]["cpu_s"] / before[key]["cpu_s"])
        if "energy_j" in before[key] and "energy_j" in after[key]:
            ratio = after[key]["energy_j"] / before[key]["energy_j"] - 1.0
            more.append((100.0 * ratio, key))
        elif before[key]["status"] != after[key]["status"]:
            print(f"{key}: {before[key]['status']} → {after[key]['status']}")
    more.sort()
    told = [f"time {statistics.median(speed):.3f} of before (median of {len(both)})"]
    if more:
        values = [value for value, _ in more]
        told.append(f"energy {statistics.median(values):+.3f} % (mean {np.mean(values):+.3f} %)")
        told += [f"  {value:+.3f} % {key}" for value, key in [*more[:4], *more[-8:]]]
    return "\n".join(told)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--count", type=int, help="questions on each map")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--terrain", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--profile", action="store_true")
    chosen = parser.parse_args()
    kinds = {**KINDS, "loaded relief": LOADED, "no route": WALLED}
    own: dict[str, Terrain] = {}
    if chosen.terrain:
        own = own_maps(chosen.terrain)
        kinds["relief of one's own"] = tuple(own)
    watch = cProfile.Profile()
    everything: dict[str, Any] = {}
    for kind, names in kinds.items():
        answers: dict[str, Any] = {}
        for name in names:
            if chosen.only and name not in chosen.only:
                continue
            terrain = own[name] if name in own else made(name, chosen.seed)
            count = chosen.count or COUNT.get(kind, COUNT["obstacles"])
            if chosen.profile:
                ask(terrain, next(places(terrain, 1, chosen.seed)))
                watch.enable()
            answers |= measured(name, terrain, count, chosen.seed)
            watch.disable()
        if answers:
            print(f"{kind} ({', '.join(names)}): CPU {json.dumps(spread(answers))}", flush=True)
        everything |= answers
    if chosen.profile:
        pstats.Stats(watch, stream=sys.stdout).sort_stats("tottime").print_stats(45)
    if chosen.json:
        chosen.json.write_text(json.dumps(everything, indent=1), encoding="utf-8")
    if chosen.against:
        print(compared(json.loads(chosen.against.read_text(encoding="utf-8")), everything))


if __name__ == "__main__":
    main()
