"""Errors as RFC 9457 problem documents, the same shape for every one of them.

    {"type": "urn:joulepath:problem:bad-input", "title": "…", "status": 422,
     "detail": "start.x: is not a finite number; accepted: …", "field": "start.x", "accepted": "…"}

What a client sent is quoted only as far as the sentence of an InputError quotes it, which is always
printable: input that JSON or UTF-8 cannot say never comes back as a failure to answer.
"""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from planner.errors import InputError, JoulepathError

MEDIA_TYPE = "application/problem+json"
_log = structlog.get_logger("joulepath.service")


class Busy(JoulepathError):
    """All workers plan and the queue is full."""

    def __init__(self, retry_after_s: int) -> None:
        self.retry_after_s = retry_after_s
        super().__init__("all workers are busy and the queue is full")


class TookTooLong(JoulepathError):
    """A request was ended because it reached the service's time limit."""


class WorkerLost(JoulepathError):
    """The process that worked on a request ended before it could answer."""


def problem(
    status: int,
    kind: str,
    detail: str,
    *,
    headers: Mapping[str, str] | None = None,
    **members: Any,
) -> JSONResponse:
    """One problem document.

    Args:
        status: HTTP status.
        kind: last part of the type URN; stable, for programs.
        detail: one sentence for people.
        headers: beside the content type.
        members: further members; those that are None are left out.
    """
    document = {
        "type": f"urn:joulepath:problem:{kind}",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
        **{key: value for key, value in members.items() if value is not None},
    }
    return JSONResponse(
        document, status, media_type=MEDIA_TYPE, headers=dict(headers) if headers else None
    )


def install(app: FastAPI) -> None:
    """Let the application answer every error with a problem document."""
    app.add_exception_handler(InputError, _bad_input)
    app.add_exception_handler(RequestValidationError, _bad_parameter)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Busy, _busy)
    app.add_exception_handler(TookTooLong, _too_long)
    app.add_exception_handler(WorkerLost, _lost)
    app.add_exception_handler(Exception, _unexpected)


async def _bad_input(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, InputError)
    return problem(422, "bad-input", str(error), field=error.field, accepted=error.accepted)


async def _bad_parameter(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    field = ".".join(str(step) for step in first["loc"])
    return problem(422, "bad-input", f"{field}: {first['msg']}", field=field, accepted=first["msg"])


_KINDS = {404: "not-found", 405: "method-not-allowed", 413: "too-large", 415: "not-json"}


async def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    kind = _KINDS.get(error.status_code, "http")
    return problem(error.status_code, kind, error.detail, headers=error.headers)


async def _busy(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, Busy)
    wait = str(error.retry_after_s)
    return problem(503, "busy", f"{error}; try again in {wait} s", headers={"Retry-After": wait})


async def _too_long(request: Request, error: Exception) -> JSONResponse:
    return problem(504, "time-limit", str(error))


async def _lost(request: Request, error: Exception) -> JSONResponse:
    return problem(500, "worker-lost", str(error))


async def _unexpected(request: Request, error: Exception) -> JSONResponse:
    number = str(uuid.uuid4())
    _log.error("request failed", id=number, path=request.url.path, exc_info=error)
    return problem(
        500,
        "unexpected",
        f"something failed inside the service; its log has id {number}",
        id=number,
    )
