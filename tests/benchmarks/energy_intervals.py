"""Whether 95 % intervals of an energy hold 95 % of the energies that a robot is measured to need.

    python -m tests.benchmarks.energy_intervals                    20 robots, 5 minutes
    python -m tests.benchmarks.energy_intervals --robots 6 --planned 0 --training 4
    python -m tests.benchmarks.energy_intervals --robots 0         tables of the rows kept last

Every robot (tests.hidden_effects.cases, kinds "one" and "two") hides one or two effects, differs
from its vehicle's file in its base parameters, and is measured with 1 to 5 % of noise, half of the
robots with an autocorrelated part. Its training log is diagnosed and what is found is adopted, the
hidden effect by its name where nothing is found: so the model is sometimes wrong. Then come drives
that nobody fitted:

    profile    runs like those of the training log. Energies are predicted from the logged motion.
    short      the same, but 20 s long
    planned    routes over hilly ground, planned with the adopted model and driven by the robot.
               What its way of driving differs from the plan (corners are rounded) is in them too.

What counts is the energy that the log adds up to, noise included. Drives of one robot share its
model's error; the range of a coverage therefore comes from drawing robots anew (bootstrap), beside
the binomial range of independent drives, which is too narrow.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from planner import plan_route
from planner.errors import ModelError
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.search.results.energy_interval import EnergyDistribution, energy_distribution
from planner.telemetry.adoption import DIAGNOSED, adopt
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import Nodes
from planner.telemetry.virtual import Noise, VirtualLog, VirtualRobot
from planner.terrain.heightmap import Terrain
from planner.terrain.surface import GroundClass
from tests.hidden_effects.cases import Case, cases
from tests.hidden_effects.logs import VEHICLE, Made, make
from tests.hidden_effects.runner import log_folder

BAR = (0.92, 0.98)
UNSEEN = 30
"""Constants of planner.telemetry.estimation were chosen on robots before this one."""
KEPT = log_folder() / "energy-intervals.jsonl"
RUNS, SHORT_RUNS, SHORT_ROWS = 16, 16, 40
Row = dict[str, Any]


def robots(count: int) -> list[Case]:
    """The first ``count`` robots; effects alternate, every fifth robot hides two."""
    alone, pairs = cases(["one"], 5), cases(["two"], 5)
    alone.sort(key=lambda case: case.seed)
    mixed: list[Case] = []
    while len(mixed) < count and alone:
        mixed += [alone.pop(0) for _ in range(min(4, len(alone)))]
        mixed += [pairs.pop(0)] if pairs else []
    return mixed[:count]


def drives_of(case: Case, planned: int, training: int = 16) -> list[Row]:
    """Predicted and measured energies of one robot's drives that nobody fitted.

    Args:
        case: the robot.
        planned: number of planned routes.
        training: number of runs that the model learns from, of 16.
    """
    made = make(case, log_folder())
    model, adopted = _adopted(case, made, training)
    robot = VirtualRobot(str(made.robot), hidden=made.truth["strengths"], seed=case.number + 1)
    noise = Noise(**{**case.noise, "level": made.truth["level"]})
    about = {
        "case": case.name,
        "adopted": adopted,
        "level": noise.level,
        "autocorrelated": noise.autocorrelated,
        "scale": model.energy_error.scale if model.energy_error else None,
    }
    rows = []
    for kind, runs, length in (("profile", RUNS, 300), ("short", SHORT_RUNS, SHORT_ROWS)):
        drive = robot.profile("rich", runs=runs, rows=length)
        log = robot.drive(drive, noise=noise, sensors=case.sensors)
        rows += [{**about, "kind": kind, **row} for row in _told(log, model, made)]
    for row in _planned(robot, str(made.robot), model, noise, planned):
        rows.append({**about, "kind": "planned", **row})
    return rows


def _adopted(case: Case, made: Made, training: int) -> tuple[PowerModel, list[str]]:
    log = Telemetry.read(made.log, made.mapping)
    log = log.take(log.run < training)
    try:
        found = adopt(DIAGNOSED, log, VEHICLE)
    except ModelError:  # the diagnosis proposes nothing
        found = adopt(list(case.truth), log, VEHICLE)
    return found.model, list(found.adopted)


def _told(log: VirtualLog, model: PowerModel, made: Made) -> Iterator[Row]:
    passing = made.log.with_name(f"{made.log.stem}-drives.parquet")
    log.write_parquet(passing)
    read = Telemetry.read(passing, made.mapping)
    passing.unlink()
    for run in np.unique(read.run):
        one = read.take(read.run == run)
        nodes = Nodes.of(one, model)
        seconds = nodes.weight * np.repeat(one.interval, np.diff(nodes.first))
        energy = float(model.watts(nodes.rows) @ seconds)
        known = energy_distribution(model, nodes.rows, seconds, energy)
        yield _row(known, float(one.power @ one.interval))


def _planned(
    robot: VirtualRobot, toml: str, model: PowerModel, noise: Noise, count: int
) -> Iterator[Row]:
    rng = np.random.default_rng(robot.seed)
    for number in range(count):
        ground = hills(rng)
        start, goal = ({"x": x, "y": float(rng.uniform(3, 27))} for x in (3.0, 27.0))
        answer = plan_route(terrain=ground, model=model, start=start, goal=goal)
        if not answer.routes:
            continue
        # Another seed, or every drive would have the same noise.
        driver = VirtualRobot(toml, hidden=robot.hidden, seed=robot.seed + number)
        _, log = driver.drive_route(answer.to_json(), terrain=ground, noise=noise)
        known = answer.routes[0].distribution
        measured = float(np.asarray(log.columns["power"]).sum() * 0.5)
        # The last row of the log is filled up by standing at the goal.
        standing = 0.5 * len(log.columns["power"]) - answer.routes[0].duration_s
        measured -= standing * float(model.watts(rows_from(vx=[0.0]))[0])
        yield _row(known, measured)


def hills(rng: np.random.Generator) -> Terrain:
    """30 m square, slopes up to about 8 degrees."""
    x, y = np.meshgrid(np.arange(0.0, 30.01, 0.5), np.arange(0.0, 30.01, 0.5))
    heights = np.zeros_like(x)
    for _ in range(6):
        length, angle, phase = rng.uniform(12, 40), rng.uniform(0, np.pi), rng.uniform(0, 6.28)
        along = x * np.cos(angle) + y * np.sin(angle)
        heights += 0.045 * length / 6.28 * np.sin(6.28 * along / length + phase)
    nothing = np.zeros(heights.shape, bool)
    return Terrain(
        name="hills",
        heights=heights,
        known=~nothing,
        obstacles=nothing,
        ground=nothing.astype(np.uint8),
        ground_classes=(GroundClass("hard"),),
        origin=(0.0, 0.0),
        cell=(0.5, 0.5),
        crs=None,
        source="made by a benchmark",
    )


def _row(known: EnergyDistribution, measured: float) -> Row:
    low, high = known.interval_j
    return {
        "predicted_j": known.energy_j,
        "measured_j": measured,
        "deviations": (measured - known.energy_j) / known.deviation_j,
        "covered": low <= measured <= high,
        "half_width": 0.5 * (high - low) / abs(known.energy_j),
        "main": known.sensitivity[0].effect,
    }


def coverage(rows: Sequence[Row]) -> dict[str, Any]:
    """Share of covered drives with its ranges, and the median half width over the energy."""
    covered = np.array([row["covered"] for row in rows], float)
    binomial = stats.binomtest(int(covered.sum()), len(covered)).proportion_ci(0.95, "wilson")
    names = sorted({row["case"] for row in rows})
    of = {name: [row["covered"] for row in rows if row["case"] == name] for name in names}
    rng = np.random.default_rng(1)
    drawn = [
        np.mean(np.concatenate([of[names[k]] for k in rng.integers(len(names), size=len(names))]))
        for _ in range(2000)
    ]
    return {
        "robots": len(names),
        "drives": len(rows),
        "coverage": float(covered.mean()),
        "binomial_95": [binomial.low, binomial.high],
        "robots_drawn_95": np.quantile(drawn, [0.025, 0.975]).tolist(),
        "median_half_width": float(np.median([row["half_width"] for row in rows])),
        "rms_deviations": float(np.sqrt(np.mean([row["deviations"] ** 2 for row in rows]))),
    }


def tables(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Coverage of all drives and of groups of them."""
    groups = {
        "profile": lambda r: r["kind"] == "profile",
        "short": lambda r: r["kind"] == "short",
        "planned": lambda r: r["kind"] == "planned",
        "noise to 2 %": lambda r: r["level"] <= 0.02,
        "noise above 2 %": lambda r: r["level"] > 0.02,
        "white noise": lambda r: r["autocorrelated"] == 0.0,
        "autocorrelated noise": lambda r: r["autocorrelated"] > 0.0,
        "all": lambda r: True,
    }
    found = {}
    for name, belongs in groups.items():
        mine = [row for row in rows if belongs(row)]
        if mine:
            found[name] = coverage(mine)
    return found


def run(
    path: Path, *, first: int = UNSEEN, count: int = 20, planned: int = 3, training: int = 16
) -> list[Row]:
    """Drive some robots, tell each, and keep the rows as JSON lines.

    Args:
        path: where rows are kept.
        first, count: which robots.
        planned: number of planned routes of each.
        training: number of runs that a model learns from.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    with path.open("w", encoding="utf-8") as file:
        for case in robots(first + count)[first:]:
            before = time.perf_counter()
            mine = drives_of(case, planned, training)
            rows += mine
            file.writelines(json.dumps(row) + "\n" for row in mine)
            file.flush()
            kinds = {row["kind"]: None for row in mine}
            held = {k: np.mean([r["covered"] for r in mine if r["kind"] == k]) for k in kinds}
            told = ", ".join(f"{kind} {100 * share:.0f} %" for kind, share in held.items())
            seconds = time.perf_counter() - before
            print(
                f"{case.name} {' + '.join(mine[0]['adopted'])}: {told}, {seconds:.0f} s", flush=True
            )
    return rows


def measure() -> dict[str, Any]:
    """The figures of ``make bench``."""
    found = tables(run(KEPT))
    return {
        **{
            name: {k: np.round(v, 4).tolist() for k, v in entry.items()}
            for name, entry in found.items()
        },
        "bar": f"{BAR[0]:.0%} to {BAR[1]:.0%} of profile drives",
        "holds": BAR[0] <= found["profile"]["coverage"] <= BAR[1],
    }


def main() -> int:
    """Drive, print the tables, and fail where the coverage of profiles misses its bar."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.energy_intervals")
    parser.add_argument("--robots", type=int, default=20, help="0 takes kept rows")
    parser.add_argument("--first", type=int, default=UNSEEN, help="number of the first robot")
    parser.add_argument("--planned", type=int, default=3, help="planned routes of each robot")
    parser.add_argument("--training", type=int, default=16, help="runs that are fitted, of 16")
    parser.add_argument("--rows", type=Path, default=KEPT)
    given = parser.parse_args()
    if given.robots:
        rows = run(
            given.rows,
            first=given.first,
            count=given.robots,
            planned=given.planned,
            training=given.training,
        )
    else:
        rows = [json.loads(line) for line in given.rows.read_text("utf-8").splitlines()]
    found = tables(rows)
    for name, entry in found.items():
        low, high = entry["robots_drawn_95"]
        print(
            f"{name:22s} {entry['drives']:5d} drives of {entry['robots']} robots: "
            f"{100 * entry['coverage']:.1f} % covered ({100 * low:.1f} to {100 * high:.1f}; "
            f"binomial {100 * entry['binomial_95'][0]:.1f} to {100 * entry['binomial_95'][1]:.1f}),"
            f" half width {100 * entry['median_half_width']:.2f} % of the energy"
        )
    return 0 if BAR[0] <= found["profile"]["coverage"] <= BAR[1] else 1


if __name__ == "__main__":
    sys.exit(main())
