"""/v1/logs: upload logs, list and remove them."""

from __future__ import annotations

import asyncio
import hashlib
from contextlib import suppress
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import JSONResponse

from service.http.bodies import Upload, receive_log
from service.http.endpoints.answers import job_response, while_listening
from service.http.requests import Wait
from service.http.schemas import described, problem_responses
from service.http.state import Running, Service
from service.http.workbench_schemas import Job, Log, LogSummary
from service.problems import Conflict, NoSuch, Unavailable, found
from service.store import log_id

router = APIRouter(prefix="/v1/logs", tags=["logs"])

_BYTES = {"type": "string", "format": "binary"}
_MAPPING = {**_BYTES, "description": "TOML: which columns are which quantities"}
_PARTS = {"log": _BYTES, "mapping": _MAPPING}
_FORM = {"type": "object", "properties": _PARTS, "required": ["log"]}
_CONTENT = {
    "multipart/form-data": {"schema": _FORM},
    "text/csv": {"schema": _BYTES},
    "application/vnd.apache.parquet": {"schema": _BYTES},
    "application/octet-stream": {"schema": _BYTES},
}
_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {"model": Log, "description": "The same log is already stored."},
    201: {"model": Log, "description": "The log was read and stored."},
    202: {"model": Job, "description": "The unfinished job; its result is the log."},
}
_PROBLEMS = (408, 409, 413, 422, 500, 503, 504, 507)
"""HTTP statuses that an upload may be refused with."""


@router.post("", **described(_CONTENT, _ANSWERS, *_PROBLEMS, status_code=201))
async def upload_log(
    request: Request,
    service: Running,
    wait: Wait = 60.0,
    name: Annotated[str, Query(max_length=1024, description="name of a log sent as body")] = "log",
) -> Response:
    """Upload a log, as a form with `log` and optionally `mapping`, or as the body.

    The log is read completely before it is accepted. The same bytes with the same mapping are
    the same log; its first name is kept.
    """
    _refuse_other_sites(request)
    place = service.store.files.incoming()
    async with receive_log(request, place, service.settings.max_log_bytes) as received:
        return await _take_in(service, received, wait)


@router.post(
    "/demo",
    response_class=Response,
    status_code=201,
    responses={**_ANSWERS, **problem_responses(*_PROBLEMS)},
)
async def demo_log(request: Request, service: Running, wait: Wait = 60.0) -> Response:
    """Upload a log of a simulated minibalance with an effect that its base model lacks."""
    _refuse_other_sites(request)
    content = await while_listening(request, service.workers.run("demo_log"))
    digest = hashlib.sha256(content).hexdigest()
    made = Upload(service.store.files.incoming(), "demo.csv", digest, len(content))
    try:
        await asyncio.to_thread(made.path.write_bytes, content)
        return await _take_in(service, made, wait)
    finally:
        made.path.unlink(missing_ok=True)


def _refuse_other_sites(request: Request) -> None:
    if request.headers.get("sec-fetch-site") == "cross-site":
        # A form on another site's page could send this without consent.
        raise Conflict("logs are not accepted from pages of other sites")


async def _take_in(service: Service, received: Upload, wait: float) -> Response:
    log = log_id(received.sha256, received.mapping)
    known = await asyncio.to_thread(service.store.logs.get, log)
    if known is not None:
        return JSONResponse(known, headers={"Location": f"/v1/logs/{log}"})
    job = await asyncio.to_thread(service.store.jobs.reading, log)
    if job is None:
        name = await asyncio.to_thread(
            service.store.files.take_in, received.path, log, received.name, received.mapping
        )
        request = {
            "log": log,
            "name": name,
            "sha256": received.sha256,
            "bytes": received.size,
            "mapped": received.mapping is not None,
        }
        try:
            job = await service.jobs.submit("check", request)
        except Exception:
            await asyncio.to_thread(_put_away, service, log)
            raise
    job = await service.jobs.wait(job["id"], wait)
    if job["state"] == "done":
        return JSONResponse(job["result"], 201, headers={"Location": f"/v1/logs/{log}"})
    return job_response(job)


def _put_away(service: Service, log: str) -> None:
    """Remove an upload that no job reads, unless the same log was stored meanwhile."""
    with suppress(Unavailable):
        if service.store.logs.get(log) is None and service.store.jobs.reading(log) is None:
            service.store.files.drop_log(log)


@router.get("", response_model=list[LogSummary])
def logs(service: Running) -> list[dict[str, Any]]:
    """All logs, newest first."""
    return service.store.logs.all()


@router.get("/{log}", response_model=Log, responses=problem_responses(404))
def log(log: str, service: Running) -> dict[str, Any]:
    """One log with its findings, derived quantities and assumptions."""
    return found(service.store.logs.get(log), "log", log)


@router.delete("/{log}", status_code=204, responses=problem_responses(404, 409))
def delete_log(log: str, service: Running) -> Response:
    """Remove a log; models adopted from it stay."""
    if service.store.jobs.uses_log(log):
        raise Conflict("an unfinished job reads this log; cancel it first")
    if not service.store.logs.remove(log):
        raise NoSuch("log", log)
    service.store.files.drop_log(log)
    return Response(status_code=204)
