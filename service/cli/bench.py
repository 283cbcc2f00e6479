"""Speed of planning and diagnosis on this machine, for ``joulepath bench``.

The log is that of the virtual robot with one hidden effect, so it needs no file and is the same
everywhere. Code is compiled before the clock starts.
"""

from __future__ import annotations

import math
import platform
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import Cancelled
from planner.progress import Progress, silent

ROUTE: dict[str, Any] = {
    "map": "jacksboro-1to100",
    "vehicle": "minibalance",
    "start": {"x": 93.0, "y": 225.0},
    "goal": {"x": 212.0, "y": 73.0},
    "seed": 1,
    "iterations": 500,
}
HIDDEN = "air_drag"
_ROUNDS = 5
"""Repetitions, of which the quickest counts: others waited for another program."""
_ROWS_A_RUN = 300
"""Rows of each run of the drive that is timed."""


def measure(
    rows: int, *, progress: Progress | None = None, cancelled: Callable[[], bool] | None = None
) -> dict[str, Any]:
    """Time the power model, a plan, and what the workbench does with a log.

    Args:
        rows: of the log that is compared and diagnosed.
        progress: called with the share done and what is being measured.
        cancelled: asked between the measurements.

    Returns:
        ``timings``: a list of {"name", "seconds", "what"}; ``diagnosed`` and ``hidden``: what the
        diagnosis named, and what was there; ``machine``.

    Raises:
        Cancelled: ``cancelled`` returned True.
    """
    say = progress or silent
    timings: list[dict[str, Any]] = []

    def note(name: str, seconds: float, what: str) -> None:
        timings.append({"name": name, "seconds": seconds, "what": what})
        if cancelled is not None and cancelled():
            raise Cancelled("by the caller")

    say(0.0, "power model")
    note("power model", _one_evaluation(), "one evaluation for four wheels, of a batch of 100,000")
    say(0.1, "route")
    note("route", _one_plan(), f"{ROUTE['map']}, {ROUTE['iterations']} iterations, warm")
    say(0.3, "log")
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.parquet"
        count = _drive(rows, log)
        from planner import compare, diagnose

        what = f"{count:,} rows, base model fitted"
        say(0.4, "compare")
        seconds, _ = _timed(lambda: compare(log, "minibalance", cancelled=cancelled))
        note("compare", seconds, what)
        say(0.6, "diagnose")
        seconds, found = _timed(lambda: diagnose(log, "minibalance", cancelled=cancelled))
        note("diagnose", seconds, f"{what}, all effects of the catalogue")
    return {
        "timings": timings,
        "hidden": [HIDDEN],
        "diagnosed": list(found.to_json()["selected"]),
        "machine": {"python": platform.python_version(), "system": platform.platform()},
    }


def _one_evaluation() -> float:
    from planner.power.model import PowerModel
    from planner.power.rows import rows_from
    from planner.power.vehicles import load_vehicle

    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    speeds = np.linspace(-0.8, 0.8, 100_000)
    rows = rows_from(vx=speeds, vy=0.5 * speeds, wz=0.3 * np.ones_like(speeds))
    model.watts(rows[:10])
    return min(_timed(lambda: model.watts(rows))[0] for _ in range(_ROUNDS)) / len(rows)


def _one_plan() -> float:
    from planner import plan_route

    return min(_timed(lambda: plan_route(ROUTE))[0] for _ in range(2))


def _drive(rows: int, path: Path) -> int:
    """Write a log of at least ``rows`` rows; returns how many it has."""
    from planner.telemetry.virtual import Noise, VirtualRobot

    robot = VirtualRobot("minibalance", hidden={HIDDEN: {"size": 0.05}}, seed=1)
    drive = robot.profile("rich", runs=max(3, math.ceil(rows / _ROWS_A_RUN)), rows=_ROWS_A_RUN)
    log = robot.drive(drive, noise=Noise(level=0.02))
    log.write_parquet(path)
    return len(log.columns["power"])


def _timed(work: Callable[[], Any]) -> tuple[float, Any]:
    begun = time.perf_counter()
    result = work()
    return time.perf_counter() - begun, result
