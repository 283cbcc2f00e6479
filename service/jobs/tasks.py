"""A worker's task for a job: plain data that crosses a process border.

A job's row holds the original request with its names. The task is made from it when the job
begins, so that a job that waited over a restart finds the current paths of its files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from planner.errors import RequestError
from service.jobs.names import Names
from service.store import MAPPING, Store


@dataclass(frozen=True)
class Task:
    """A log, an initial model, and what to do with them.

    Attributes:
        folder: the log's folder and the worker's working directory, so that sentences about the
            log give its plain name.
        log: name of the log's file.
        mapping: name of its mapping file.
        vehicle, model: name or path of a vehicle, or path of a saved model.
        effects, definition: what to adopt, see service.workbench.effects_to_adopt.
        report: whether the document gets pictures and tables as HTML.
    """

    folder: str
    log: str
    mapping: str | None
    vehicle: str | None = None
    model: str | None = None
    effects: tuple[str, ...] = ()
    definition: Mapping[str, Any] | None = None
    report: bool = False


def prepare(request: Mapping[str, Any], store: Store, names: Names) -> Task:
    """The task of a job.

    Args:
        request: as in its row; that of a new log includes its name and mapping.
        store: where logs and models are.
        names: what requests may name.

    Raises:
        RequestError: the log, vehicle or model does not exist (any more).
    """
    log = request["log"]
    known = request if "name" in request else store.logs.get(log)
    if known is None:
        raise RequestError(
            "log", "no such log in this service", value=log, accepted="an id from GET /v1/logs"
        )
    vehicle, model = request.get("vehicle"), request.get("model")
    return Task(
        folder=str(store.files.log_folder(log)),
        log=known["name"],
        mapping=MAPPING if known["mapped"] else None,
        vehicle=None if vehicle is None else names.find("vehicle", vehicle),
        model=None if model is None else _saved(model, names),
        effects=tuple(request.get("effects") or ()),
        definition=request.get("formula"),
        report=bool(request.get("report")),
    )


def _saved(model: str, names: Names) -> str:
    """Path of a saved model; a built-in kind of model is not allowed."""
    if model in names.catalogue["model"]:
        raise RequestError(
            "model",
            "is not a saved model",
            value=model,
            accepted="an id from GET /v1/models, or a file of the service's folder",
        )
    return names.find("model", model)
