"""Whether advice works: robots are drawn, diagnosed, driven as told, and diagnosed again.

    python -m tests.benchmarks.advice                     48 logs, about four minutes of CPU
    python -m tests.benchmarks.advice --seeds 3 --kind narrow column

Kinds of logs: ``tied``, designs in which quantities move together; ``narrow``, so few and noisy
rows that a named effect has a wide interval; ``faint``, fewer still; ``column``, without
temperatures, slope or the place of the load. Every recommendation is followed by itself. A drive is
added to the first log; a column is what the same log would have had.

A recommendation works if the second diagnosis tells the effects apart, or if the standard errors of
the named effect, where they were wide, are at most half. Of what was undecided something must be
named; nothing false may be. Slope works if the held-out error halves.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.telemetry.diagnosis import diagnose
from planner.telemetry.virtual import Noise, VirtualLog, VirtualRobot
from tests.hidden_effects.cases import settings_of
from tests.hidden_effects.logs import LARGEST_STRENGTH, VEHICLE, write_robot
from tests.hidden_effects.scoring import aliases_of
from tests.hidden_effects.second_drive import recommended_drive

TIED = {
    "speed_heats_motor": ("motor_heating", "viscous_drag", "cold_grease", "air_drag"),
    "one_heading": ("wheel_imbalance", "wheel_preload", "viscous_drag", "com_offset"),
    "one_load": ("load_dependent_rolling", "wear", "wheel_slip", "yaw_scrub"),
}
COMMON = (
    "viscous_drag", "load_dependent_rolling", "air_drag", "wheel_preload", "yaw_scrub",
    "wheel_imbalance", "motor_heating", "stiction",
)  # fmt: skip
UNLOGGED = {
    "viscous_drag": ("motor_temp", "ambient_temp"),
    "air_drag": ("pitch", "roll"),
    "wheel_imbalance": ("com_x", "com_y"),
    "cold_grease": ("motor_temp", "ambient_temp"),
}
KINDS = ("tied", "narrow", "faint", "column")
SIZES = (0.03, 0.08)
"""Size of the hidden effect, a share of the mean power; in short logs smaller ones do not show."""
WIDE = 0.05
"""Standard error over value from which an interval counts as wide."""

Document = Mapping[str, Any]


@dataclass(frozen=True)
class Log:
    """A log to be diagnosed: what is hidden, on which drive, and which columns it lacks."""

    kind: str
    effect: str
    seed: int
    design: str = "rich"
    runs: int = 24
    rows: int = 300
    lacks: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """kind/effect/design/seed."""
        return f"{self.kind}/{self.effect}/{self.design}/{self.seed}"


def logs(kinds: Sequence[str], seeds: int) -> Iterator[Log]:
    """All logs of some kinds."""
    for seed in range(seeds):
        if "tied" in kinds:
            for design, effects in TIED.items():
                yield from (Log("tied", e, seed, design, runs=9, rows=150) for e in effects)
        if "narrow" in kinds:
            yield from (Log("narrow", effect, seed, runs=6, rows=100) for effect in COMMON)
        if "faint" in kinds:
            yield from (Log("faint", effect, seed, runs=6, rows=60) for effect in COMMON)
        if "column" in kinds:
            yield from (Log("column", e, seed, lacks=lacks) for e, lacks in UNLOGGED.items())


@dataclass(frozen=True)
class Robot:
    """A robot that is not quite like its file, and its first log."""

    log: Log
    folder: Path
    robot: VirtualRobot
    noise: Noise
    first: VirtualLog

    @classmethod
    def drawn(cls, log: Log, folder: Path) -> Robot:
        """Draw it; size of the effect, noise and parameters differ from seed to seed."""
        rng = np.random.default_rng([log.seed, *log.name.encode()])
        path = folder / "robot.toml"
        write_robot(path, rng)
        size = float(np.exp(rng.uniform(*np.log(SIZES))))
        hidden = {log.effect: {**settings_of(log.effect, rng), "size": size}}
        robot = VirtualRobot(str(path), hidden=hidden, seed=log.seed)
        noise = Noise(level=float(rng.uniform(0.015, 0.04)))
        drive = robot.profile(log.design, runs=log.runs, rows=log.rows)
        return cls(log, folder, robot, noise, robot.drive(drive, noise=noise))

    @property
    def possible(self) -> bool:
        """Whether the effect of this size has strengths that a robot of this kind can have."""
        strengths = self.first.truth["hidden"][self.log.effect]
        return all(
            np.max(np.abs(value)) <= LARGEST_STRENGTH.get(name, np.inf)
            for name, value in strengths.items()
        )

    def diagnosed(self, second: VirtualLog | None = None, lacks: Sequence[str] = ()) -> Document:
        """The answer to the first log, with a second drive after it."""
        columns = {name: values for name, values in self.first.columns.items() if name not in lacks}
        if second is not None:
            columns = {
                name: np.concatenate([values, second.columns[name]])
                for name, values in columns.items()
            }
        path = self.folder / "log.csv"
        VirtualLog(columns, {}).write_csv(path)
        return diagnose(path, VEHICLE).to_json()

    def follow(self, experiment: Document) -> Document:
        """The answer after one recommendation was followed."""
        if not experiment["settings"]:
            lacks = [name for name in self.log.lacks if name not in experiment["run"]]
            return self.diagnosed(lacks=lacks)
        far = float(self.robot.profile(self.log.design).starts[:, 7].max())
        drive = recommended_drive(experiment["settings"], far)
        # The hidden size was found on the first drive; the robot stays the same.
        strengths = self.first.truth["hidden"]
        again = VirtualRobot(str(self.folder / "robot.toml"), hidden=strengths, seed=self.log.seed)
        second = again.drive(drive, noise=self.noise, seed=self.log.seed + 1000)
        return self.diagnosed(second, self.log.lacks)


def widths(answer: Document, effect: str) -> dict[str, float]:
    """Standard errors over values of the parameters of an effect."""
    for candidate in answer["candidates"]:
        if candidate["effect"] == effect:
            return {
                name: (p["stderr"] or np.inf) / max(abs(p["value"]), 1e-300)
                for name, p in candidate["parameters"].items()
            }
    return {}


def asked(first: Document, experiment: Document) -> str:
    """What a recommendation is about."""
    if not experiment["separates"]:
        return "slope"
    if not set(experiment["separates"]) & set(first["selected"]):
        return "undecided"
    return "tie" if len(experiment["separates"]) > 1 else "interval"


def works(log: Log, first: Document, experiment: Document, second: Document) -> bool:
    """Whether a recommendation did what it was given for."""
    kind, names = asked(first, experiment), set(experiment["separates"])
    if kind == "slope":
        before, after = (a["after"]["heldout_rmse_w"] for a in (first, second))
        return bool(after <= 0.5 * before)
    false = set(second["selected"]) - {log.effect}
    if kind == "interval":
        (name,) = names
        before, after = widths(first, name), widths(second, name)
        return name in second["selected"] and all(
            after.get(p, np.inf) <= 0.5 * w for p, w in before.items() if w > WIDE
        )
    left = {rival for name in second["selected"] for rival in aliases_of(second).get(name, ())}
    return bool(second["selected"]) and not false and not left & names


def main(arguments: Sequence[str] | None = None) -> int:
    """Follow all advice, print each piece and the share that works."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kind", nargs="*", choices=KINDS, default=KINDS)
    parser.add_argument("--seeds", type=int, default=2, help="robots of each kind and effect")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    chosen = parser.parse_args(arguments)
    good, every = Counter[str](), Counter[str]()
    silent = 0
    began = time.process_time()
    for log in logs(chosen.kind, chosen.first + chosen.seeds):
        if log.seed < chosen.first:
            continue
        with tempfile.TemporaryDirectory() as folder:
            robot = Robot.drawn(log, Path(folder))
            if not robot.possible:
                continue
            first = robot.diagnosed(lacks=log.lacks)
            silent += not first["experiments"]
            for experiment in first["experiments"]:
                if not experiment["settings"] and experiment["run"].startswith("No drive"):
                    continue  # nothing that a robot could do
                second = robot.follow(experiment)
                kind, done = asked(first, experiment), works(log, first, experiment, second)
                every[kind] += 1
                good[kind] += done
                print(
                    f"{'works' if done else 'FAILS'}  {log.name}: {kind} of "
                    f"{' '.join(experiment['separates'])}: {experiment['run']} → "
                    f"{second['verdict']} {' '.join(second['selected'])}: {second['sentence']}",
                    flush=True,
                )
    for kind, count in every.items():
        print(f"{kind}: {good[kind]} of {count}")
    total = every.total()
    share = 100.0 * good.total() / max(total, 1)
    print(f"{good.total()} of {total} recommendations work, {share:.0f} %; {silent} logs without")
    print(f"{time.process_time() - began:.0f} s of CPU")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
