"""The workbench inside a worker process: thin calls of planner.telemetry.

Every function takes a Task and returns a document, or the refusal. The worker changes into the
log's folder: what it says of the log names the file and not the service's disk.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import asdict
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import planner

# Loaded with the fork server, so that a fresh worker has it.
import planner.telemetry.adoption
import planner.telemetry.comparison
from planner.errors import InputError, ModelError
from planner.power.model import PowerModel
from planner.power.saved import ACCEPTED
from planner.report.workbench import workbench_view
from planner.telemetry.logs import Telemetry
from service.documents import finite, strict
from service.jobs import progress
from service.jobs.outcomes import Adopted
from service.jobs.tasks import Task
from service.workbench import effects_to_adopt, starting_model

P = ParamSpec("P")
T = TypeVar("T")


def _refusing(work: Callable[P, T]) -> Callable[P, T | InputError]:
    """Return a refusal instead of raising it, so that it arrives without a traceback."""

    @wraps(work)
    def wrapped(*arguments: P.args, **named: P.kwargs) -> T | InputError:
        try:
            return work(*arguments, **named)
        except InputError as error:
            return error

    return wrapped


@_refusing
def check(task: Task) -> dict[str, Any]:
    """Read a log from end to end; what was found, derived and assumed."""
    os.chdir(task.folder)
    say = progress.reporter(Path(task.progress))
    rows, seconds = 0, 0.0
    say(0.0, "reading")
    for chunk in Telemetry.chunks(task.log, task.mapping):
        rows += len(chunk)
        seconds += float(chunk.interval.sum())
        say(0.0, f"{rows:,} rows read")
    return {
        "rows": rows,
        "runs": len(chunk.run_names),
        "duration_s": seconds,
        "present": sorted(chunk.present),
        "report": [asdict(finding) for finding in chunk.report],
        "derived": list(chunk.derived),
        "assumed": list(chunk.assumed),
    }


@_refusing
def compare(task: Task) -> dict[str, Any]:
    """Comparison.to_json(), with what pictures need beside it."""
    found = planner.compare(*_log_and_model(task), **_options(task))
    return {**_document(found, task), "pictures": _pictures(found)}


@_refusing
def diagnose(task: Task) -> dict[str, Any]:
    """Diagnosis.to_json()."""
    return _document(planner.diagnose(*_log_and_model(task), **_options(task)), task)


@_refusing
def adopt(task: Task) -> Adopted:
    """Adoption.to_json() and the new version."""
    effects = effects_to_adopt(task.effects, task.definition)
    found = planner.adopt(effects, *_log_and_model(task), **_options(task))
    return Adopted(_document(found, task), _saved(found.model))


@_refusing
def revert(path: str, version: int) -> str:
    """The new version that goes back to an earlier one."""
    return _saved(planner.revert(PowerModel.load(path), version))


@_refusing
def model_report(path: str) -> str:
    """A saved model and its history as ``report``, in JSON."""
    return strict({"report": _report(PowerModel.load(path))})


@_refusing
def check_model(content: bytes) -> str:
    """A saved model that came from outside, read and written again."""
    try:
        text = _saved(PowerModel.from_document(json.loads(content.decode("utf-8-sig"))))
        text.encode()
    except (ValueError, OverflowError, RecursionError) as error:
        # Such as a number that is none, or text that is none.
        problem = str(error).splitlines()[0]
        raise ModelError("model", f"cannot be read: {problem}", accepted=ACCEPTED) from None
    return text


def _log_and_model(task: Task) -> tuple[str, Any]:
    os.chdir(task.folder)
    return task.log, starting_model(task.vehicle, task.model)


def _options(task: Task) -> dict[str, Any]:
    return {"mapping": task.mapping, "progress": progress.reporter(Path(task.progress))}


def _document(found: Any, task: Task) -> dict[str, Any]:
    """What a verb found as JSON, and as HTML where that was asked for."""
    more = {"report": _report(found)} if task.report else {}
    return {**found.to_json(), **more}


def _report(found: Any) -> str:
    return "".join(workbench_view(found).sections)


def _saved(model: PowerModel) -> str:
    """What PowerModel.save writes into a file."""
    return json.dumps(model.document(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _pictures(found: Any) -> dict[str, Any]:
    """Mean residual over each quantity that varies, and a thinned cloud of points."""
    curves = {name: _plain(curve) for name, curve in found.curves.items()}
    cloud = {"measured_w": _plain(found.measured), "predicted_w": _plain(found.predicted)}
    pictures: dict[str, Any] = finite({"curves": curves, "cloud": cloud})
    return pictures


def _plain(values: Any) -> Any:
    """Arrays as lists, in mappings too."""
    if isinstance(values, dict):
        return {key: _plain(value) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [_plain(value) for value in values]
    return values.tolist() if hasattr(values, "tolist") else values
