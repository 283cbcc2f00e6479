"""/v1/models: versions of models, their history, and going back."""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse

from service.http.bodies import json_body, read_json
from service.http.endpoints.answers import while_listening
from service.http.requests import RevertRequest
from service.http.schemas import problem_responses
from service.http.state import Running
from service.http.workbench_schemas import HistoryEntry, ModelSummary
from service.problems import NoSuch
from service.store import now

router = APIRouter(prefix="/v1/models", tags=["models"])

MOST_MODEL = 1 << 20
"""Largest saved model in bytes that may be uploaded; a version in its history takes about 2,000."""

_SAVED = {"schema": {"type": "object", "description": "a file that joulepath adopt wrote"}}


@router.get("", response_model=list[ModelSummary])
def models(service: Running) -> list[dict[str, Any]]:
    """All versions of all models, newest first."""
    return service.store.models.all()


@router.post(
    "",
    response_class=Response,
    status_code=201,
    responses={
        201: {"model": ModelSummary, "description": "Kept as it was read."},
        **problem_responses(413, 415, 422, 500, 503),
    },
    openapi_extra={"requestBody": {"required": True, "content": {"application/json": _SAVED}}},
)
async def upload_model(request: Request, service: Running) -> Response:
    """Upload a saved model, such as one that was adopted on the command line."""
    body = await json_body(request, MOST_MODEL)
    text = await while_listening(request, service.workers.run("check_model", body))
    return await _keep(service, text, None)


@router.get(
    "/{model}",
    response_class=Response,
    responses={
        200: {"content": {"application/json": _SAVED}, "description": "The saved model."},
        **problem_responses(404),
    },
)
def model(model: str, service: Running) -> Response:
    """The saved model, letter by letter; the command line and Python read it from a file."""
    text = service.store.models.document(model)
    if text is None:
        raise NoSuch("model", model)
    return Response(text, media_type="application/json")


@router.get("/{model}/history", response_model=list[HistoryEntry], responses=problem_responses(404))
def history(model: str, service: Running) -> list[dict[str, Any]]:
    """What was adopted from which log, with the error before and after; oldest first."""
    entries = service.store.models.history(model)
    if entries is None:
        raise NoSuch("model", model)
    return entries


@router.get("/{model}/report", response_class=Response, responses=problem_responses(404))
async def report(model: str, request: Request, service: Running) -> Response:
    """The model and its history as `report`: pictures and tables as HTML."""
    path = await _path(service, model)
    text = await while_listening(request, service.workers.run("model_report", path))
    return Response(text, media_type="application/json")


@router.post(
    "/{model}/revert",
    response_class=Response,
    status_code=201,
    responses={
        201: {"model": ModelSummary, "description": "The new version."},
        **problem_responses(404, 413, 415, 422, 500, 503),
    },
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {
                    "schema": {"$ref": "#/components/schemas/RevertRequest"},
                    "example": {"version": 2},
                }
            },
        }
    },
)
async def revert(model: str, request: Request, service: Running) -> Response:
    """Go back to an earlier version; that is a new version too."""
    asked = read_json(RevertRequest, await json_body(request, service.settings.max_body_bytes))
    path = await _path(service, model)
    text = await while_listening(request, service.workers.run("revert", path, asked.version))
    return await _keep(service, text, model)


async def _path(service: Running, model: str) -> str:
    path = await asyncio.to_thread(service.store.model_file, model)
    if path is None:
        raise NoSuch("model", model)
    return str(path)


async def _keep(service: Running, text: str, parent: str | None) -> Response:
    kept = await asyncio.to_thread(service.store.models.save, text, parent, now())
    return JSONResponse(kept, 201, headers={"Location": f"/v1/models/{kept['id']}"})
