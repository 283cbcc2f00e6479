"""POST /v1/compare, /v1/diagnose, /v1/adopt: the workbench's verbs, each as a job."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from service.http.bodies import json_body, read_json
from service.http.endpoints.answers import HEADER_LOCATION, job_response
from service.http.requests import AdoptRequest, CompareRequest, DiagnoseRequest, Report, Wait
from service.http.schemas import described, json_content
from service.http.state import Running, Service
from service.http.workbench_schemas import Adoption, Comparison, Diagnosis, Job

router = APIRouter(prefix="/v1", tags=["workbench"])

_EXAMPLE = {"log": "5f2d0c1b7a9e4433", "vehicle": "minibalance"}
_UNFINISHED = "The unfinished job; its URL gives progress and result."


def _described(
    asked: type[BaseModel], answered: type[BaseModel], example: Mapping[str, Any] = _EXAMPLE
) -> dict[str, Any]:
    """OpenAPI description of a verb."""
    answers = {
        200: {"model": answered, "description": "The result, if ready within `wait`."},
        202: {"model": Job, "description": _UNFINISHED, "headers": HEADER_LOCATION},
    }
    problems = (408, 409, 413, 415, 422, 500, 503, 504)
    return described(json_content(asked, example), answers, *problems, status_code=202)


@router.post("/compare", **_described(CompareRequest, Comparison))
async def compare(
    request: Request, service: Running, wait: Wait = 0.0, report: Report = False
) -> Response:
    """Compare measured with predicted power: error, where it occurs, and share of noise."""
    return await _as_job("compare", CompareRequest, request, service, wait, report)


@router.post("/diagnose", **_described(DiagnoseRequest, Diagnosis))
async def diagnose(
    request: Request, service: Running, wait: Wait = 0.0, report: Report = False
) -> Response:
    """Name the physical effects missing from a model, or say that they cannot be identified."""
    return await _as_job("diagnose", DiagnoseRequest, request, service, wait, report)


@router.post("/adopt", **_described(AdoptRequest, Adoption, {**_EXAMPLE, "effects": ["air_drag"]}))
async def adopt(
    request: Request, service: Running, wait: Wait = 0.0, report: Report = False
) -> Response:
    """Add effects to the model, fit it to the log, and store it as a new version."""
    return await _as_job("adopt", AdoptRequest, request, service, wait, report)


async def _as_job(
    kind: str, asked: type[BaseModel], request: Request, service: Service, wait: float, report: bool
) -> Response:
    body = await json_body(request, service.settings.max_body_bytes, "max_body_bytes")
    wanted = read_json(asked, body).model_dump(mode="json", exclude_none=True)
    job = await service.jobs.submit(kind, {**wanted, "report": True} if report else wanted)
    return job_response(await service.jobs.wait(job["id"], wait) if wait else job)
