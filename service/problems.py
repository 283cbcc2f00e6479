"""Errors as RFC 9457 problem documents, the same shape for every one of them.

    {"type": "urn:joulepath:problem:bad-input", "title": "…", "status": 422,
     "detail": "start.x: is not a finite number; accepted: …", "field": "start.x", "accepted": "…"}

What a client sent is quoted only as far as the sentence of an InputError quotes it, which is always
printable: input that JSON or UTF-8 cannot say never comes back as a failure to answer.
"""

from __future__ import annotations

import errno
import uuid
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from planner.errors import InputError, JoulepathError

MEDIA_TYPE = "application/problem+json"
_log = structlog.get_logger("joulepath.service")


class Unavailable(JoulepathError):
    """What was asked for cannot be done now, and can be later; nothing was changed.

    Args:
        sentence: why.
        retry_after_s: when to try again.
    """

    kind = "unavailable"

    def __init__(self, sentence: str, retry_after_s: int) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(sentence)


class Busy(Unavailable):
    """All workers are busy and the queue is full."""

    kind = "busy"

    def __init__(self, retry_after_s: int) -> None:
        super().__init__("all workers are busy and the queue is full", retry_after_s)


class DatabaseLocked(Unavailable):
    """Another program holds the database, or it cannot be reached, for longer than is waited."""

    kind = "database-locked"

    def __init__(self) -> None:
        super().__init__("the database is locked by another program or cannot be reached", 5)


class TookTooLong(JoulepathError):
    """A request was ended because it reached the service's time limit."""


class WorkerLost(JoulepathError):
    """The process that worked on a request ended before it could answer."""


class Conflict(JoulepathError):
    """What was asked for cannot be done in the state that things are in."""


class TooLarge(JoulepathError):
    """What was sent is larger than the service takes."""


class NoSuch(JoulepathError):
    """Nothing has the id that was asked for."""

    def __init__(self, what: str, identity: str) -> None:
        super().__init__(f"there is no {what} {identity[:40]!r}")


def document(status: int, kind: str, detail: str, **members: Any) -> dict[str, Any]:
    """One problem document.

    Args:
        status: HTTP status.
        kind: last part of the type URN; stable, for programs.
        detail: one sentence for people.
        members: further members; those that are None are left out.
    """
    return {
        "type": f"urn:joulepath:problem:{kind}",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
        **{key: value for key, value in members.items() if value is not None},
    }


def respond(document: Mapping[str, Any], headers: Mapping[str, str] | None = None) -> JSONResponse:
    """A problem document as a response, with headers beside the content type."""
    return JSONResponse(
        dict(document),
        document["status"],
        media_type=MEDIA_TYPE,
        headers=dict(headers) if headers else None,
    )


_STATUS = {
    Conflict: (409, "conflict"),
    NoSuch: (404, "not-found"),
    TooLarge: (413, "too-large"),
    TookTooLong: (504, "time-limit"),
    WorkerLost: (500, "worker-lost"),
}


def describe(error: Exception) -> dict[str, Any]:
    """The problem document of any error; an unexpected one is logged under its ``id``."""
    if isinstance(error, InputError):
        return document(422, "bad-input", str(error), field=error.field, accepted=error.accepted)
    if isinstance(error, Unavailable):
        return document(503, error.kind, f"{error}; try again in {error.retry_after_s} s")
    for kind, (status, name) in _STATUS.items():
        if isinstance(error, kind):
            return document(status, name, str(error))
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return document(507, "no-space", "the service's disk is full")
    number = str(uuid.uuid4())
    _log.error("failed", id=number, exc_info=error)
    detail = f"something failed inside the service; its log has id {number}"
    return document(500, "unexpected", detail, id=number)


def install(app: FastAPI) -> None:
    """Let the application answer every error with a problem document."""
    app.add_exception_handler(RequestValidationError, _bad_parameter)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(ClientDisconnect, _nobody)
    # One that is expected must have a handler of its own: the last one logs and raises again.
    for kind in (InputError, Unavailable, *_STATUS, Exception):
        app.add_exception_handler(kind, _described)


async def _described(request: Request, error: Exception) -> JSONResponse:
    headers = None
    if isinstance(error, Unavailable):
        headers = {"Retry-After": str(error.retry_after_s)}
    return respond(describe(error), headers)


async def _bad_parameter(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    field = ".".join(str(step) for step in first["loc"])
    detail = f"{field}: {first['msg']}"
    return respond(document(422, "bad-input", detail, field=field, accepted=first["msg"]))


async def _nobody(request: Request, error: Exception) -> Response:
    # Nobody reads this answer.
    return Response(status_code=499)


_KINDS = {404: "not-found", 405: "method-not-allowed", 413: "too-large", 415: "not-json"}


async def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    kind = _KINDS.get(error.status_code, "http")
    return respond(document(error.status_code, kind, error.detail), error.headers)
