"""The workbench inside a worker process: thin calls of planner.telemetry.

Most functions take a Task and return a document. The worker changes into the log's folder, so that
its sentences name the file without the service's folders.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import planner

# Loaded with the fork server, so that a fresh worker has it.
import planner.telemetry.adoption
import planner.telemetry.comparison
from planner.errors import ModelError
from planner.power.model import PowerModel
from planner.power.saved import ACCEPTED
from planner.report.workbench import as_html
from planner.telemetry.logs import Telemetry
from planner.telemetry.virtual import Noise, VirtualRobot
from service.compiling import compile_for_planning
from service.documents import finite, model_text, strict
from service.jobs.outcomes import Adopted
from service.jobs.process import report as tell
from service.jobs.tasks import Task
from service.workbench import effects_to_adopt, starting_model

DEMO_VEHICLE, DEMO_HIDDEN = "minibalance", {"air_drag": {"size": 0.1}}
"""Robot of the demo log, and what its base model does not know: drag area, m²."""
DEMO_RUNS, DEMO_ROWS, DEMO_NOISE = 9, 120, 0.02
"""Enough to name the effect in seconds; noise is a share of the power."""


def demo_log() -> bytes:
    """A log of a simulated robot with an effect that its vehicle's model lacks, as CSV."""
    robot = VirtualRobot(DEMO_VEHICLE, hidden=DEMO_HIDDEN, seed=2)
    profile = robot.profile("rich", runs=DEMO_RUNS, rows=DEMO_ROWS)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "demo.csv"
        robot.drive(profile, noise=Noise(level=DEMO_NOISE)).write_csv(file)
        return file.read_bytes()


def check(task: Task) -> dict[str, Any]:
    """Read a whole log: findings, derived quantities and assumptions."""
    os.chdir(task.folder)
    rows, seconds = 0, 0.0
    tell(0.0, "reading")
    for chunk in Telemetry.chunks(task.log, task.mapping):
        rows += len(chunk)
        seconds += float(chunk.interval.sum())
        tell(0.0, f"{rows:,} rows read")
    return {
        "rows": rows,
        "runs": len(chunk.run_names),
        "duration_s": seconds,
        "present": sorted(chunk.present),
        "report": [asdict(finding) for finding in chunk.report],
        "derived": list(chunk.derived),
        "assumed": list(chunk.assumed),
    }


def compare(task: Task) -> dict[str, Any]:
    """Comparison.to_json() with data for charts: mean residuals and a thinned point cloud."""
    found = _asked(planner.compare, task)
    cloud = {"measured_w": found.measured, "predicted_w": found.predicted}
    return {**_document(found, task), "pictures": finite({"curves": found.curves, "cloud": cloud})}


def diagnose(task: Task) -> Any:
    """Diagnosis.to_json()."""
    return _document(_asked(planner.diagnose, task), task)


def adopt(task: Task) -> Adopted:
    """Adoption.to_json() and the new version."""
    effects = effects_to_adopt(task.effects, task.definition)
    found = _asked(planner.adopt, task, effects)
    compile_for_planning(found.model, tell)
    return Adopted(_document(found, task), model_text(found.model))


def revert(path: str, version: int) -> str:
    """The new version that goes back to an earlier one."""
    return model_text(planner.revert(PowerModel.load(path), version))


def model_report(path: str) -> str:
    """A saved model and its history as ``report``, in JSON."""
    return strict({"report": as_html(PowerModel.load(path))})


def check_model(content: bytes) -> str:
    """An uploaded model, read and written again."""
    try:
        text = model_text(PowerModel.from_document(json.loads(content.decode("utf-8-sig"))))
        text.encode()
    except (ValueError, OverflowError, RecursionError) as error:
        # Such as an infinite number, or text that UTF-8 cannot encode.
        problem = str(error).splitlines()[0]
        raise ModelError("model", f"cannot be read: {problem}", accepted=ACCEPTED) from None
    return text


def _document(found: Any, task: Task) -> dict[str, Any]:
    """A result as JSON, with its pictures and tables as HTML if asked for."""
    return {**found.to_json(), **({"report": as_html(found)} if task.report else {})}


def _asked(function: Callable[..., Any], task: Task, *given: Any) -> Any:
    """Result of a function of the planner for a task's log and initial model."""
    os.chdir(task.folder)
    start = starting_model(task.vehicle, task.model)
    return function(*given, task.log, start, mapping=task.mapping, progress=tell)
