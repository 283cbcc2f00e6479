"""/v1/models: versions of models, their history, and reverting."""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse

from service.http.bodies import json_body, read_json
from service.http.endpoints.answers import while_listening
from service.http.requests import RevertRequest
from service.http.schemas import described, json_content, problem_responses
from service.http.state import Running
from service.http.workbench_schemas import HistoryEntry, ModelSummary
from service.problems import found
from service.store import now

router = APIRouter(prefix="/v1/models", tags=["models"])

MOST_MODEL = 1 << 20
"""Largest size of an uploaded model in bytes; a version in its history takes about 2,000."""

_SCHEMA = {"type": "object", "description": "a file written by joulepath adopt"}
_SAVED = {"application/json": {"schema": _SCHEMA}}
_REVERT = json_content(RevertRequest, {"version": 2})
_STORED = {201: {"model": ModelSummary, "description": "The stored version."}}
_PROBLEMS = (408, 413, 415, 422, 500, 503)
"""HTTP statuses that a change may be refused with."""
_NOT_FOUND = problem_responses(404)


@router.get("", response_model=list[ModelSummary])
def models(service: Running) -> list[dict[str, Any]]:
    """All versions of all models, newest first."""
    return service.store.models.all()


@router.post("", **described(_SAVED, _STORED, *_PROBLEMS, status_code=201))
async def upload_model(request: Request, service: Running) -> Response:
    """Upload a saved model, such as one from `joulepath adopt`."""
    body = await json_body(request, MOST_MODEL)
    text = await while_listening(request, service.workers.run("check_model", body))
    return await _keep(service, text, None)


@router.get(
    "/{model}",
    response_class=Response,
    responses={200: {"content": _SAVED, "description": "The saved model."}, **_NOT_FOUND},
)
def model(model: str, service: Running) -> Response:
    """The saved model, byte for byte; the command line and Python read it from a file."""
    text = found(service.store.models.document(model), "model", model)
    return Response(text, media_type="application/json")


@router.get("/{model}/history", response_model=list[HistoryEntry], responses=_NOT_FOUND)
def history(model: str, service: Running) -> list[dict[str, Any]]:
    """Changes of a model with their logs and the error before and after, oldest first."""
    return found(service.store.models.history(model), "model", model)


@router.get("/{model}/report", response_class=Response, responses=_NOT_FOUND)
async def report(model: str, request: Request, service: Running) -> Response:
    """The model and its history as `report`: pictures and tables as HTML."""
    path = found(await asyncio.to_thread(service.store.model_file, model), "model", model)
    text = await while_listening(request, service.workers.run("model_report", str(path)))
    return Response(text, media_type="application/json")


@router.post("/{model}/revert", **described(_REVERT, _STORED, 404, *_PROBLEMS, status_code=201))
async def revert(model: str, request: Request, service: Running) -> Response:
    """Revert to an earlier version; the result is a new version."""
    asked = read_json(RevertRequest, await json_body(request, service.settings.max_body_bytes))
    path = found(await asyncio.to_thread(service.store.model_file, model), "model", model)
    text = await while_listening(request, service.workers.run("revert", str(path), asked.version))
    return await _keep(service, text, model)


async def _keep(service: Running, text: str, parent: str | None) -> Response:
    kept = await asyncio.to_thread(service.store.models.save, text, parent, now())
    return JSONResponse(kept, 201, headers={"Location": f"/v1/models/{kept['id']}"})
