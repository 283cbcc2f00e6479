"""Every error of an endpoint, answered with its problem document.

install(app)
return respond(document(409, "cancelled", "the job was cancelled"))
"""

from __future__ import annotations

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from planner.errors import InputError, RequestError
from planner.validation import first_complaint, printable, problem_of
from service.problems import STATUS, TooSlow, Unavailable, describe, document

MEDIA_TYPE = "application/problem+json"


def respond(document: Mapping[str, Any], headers: Mapping[str, str] | None = None) -> JSONResponse:
    """A problem document as a response, with headers beside the content type."""
    return JSONResponse(
        dict(document),
        document["status"],
        media_type=MEDIA_TYPE,
        headers=dict(headers) if headers else None,
    )


def install(app: FastAPI) -> None:
    """Let the application answer every error with a problem document."""
    app.add_exception_handler(RequestValidationError, _bad_parameter)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(ClientDisconnect, _nobody)
    # Expected errors need their own handlers: the one for Exception logs and raises again.
    for kind in (InputError, Unavailable, *STATUS, Exception):
        app.add_exception_handler(kind, _described)


async def _described(request: Request, error: Exception) -> JSONResponse:
    headers = None
    if isinstance(error, Unavailable):
        headers = {"Retry-After": str(error.retry_after_s)}
    elif isinstance(error, TooSlow):
        # What else comes of its body is no next request.
        headers = {"Connection": "close"}
    return respond(describe(error), headers)


async def known_parameters(request: Request) -> None:
    """Refuse a query parameter that the endpoint does not have, such as a misspelt one.

    Raises:
        RequestError: naming it, and those that the endpoint has.
    """
    if not request.query_params:
        return
    endpoint = request.app.openapi()["paths"][request.scope["route"].path_format]
    declared = endpoint[request.method.lower()].get("parameters", ())
    known = [one["name"] for one in declared if one["in"] == "query"]
    for name in request.query_params:
        if name not in known:
            raise RequestError(
                f"query.{printable(name)}",
                "no such parameter",
                accepted=", ".join(known) or "no parameters",
            )


async def _bad_parameter(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = first_complaint(error.errors())
    # "Input should be a valid integer, unable to parse …"
    accepted = first.message.removeprefix("Input should be ").partition(",")[0]
    accepted = _PLAIN.get(accepted, accepted)
    described = RequestError(
        first.place, problem_of(first, "cannot be"), value=first.value, accepted=accepted
    )
    return respond(describe(described))


async def _nobody(request: Request, error: Exception) -> Response:
    # The client is gone and does not read this.
    return Response(status_code=499)


_PLAIN = {"a valid boolean": "true or false", "a valid integer": "a whole number"}
_KINDS = {
    404: "not-found",
    405: "method-not-allowed",
    406: "no-such-format",
    413: "too-large",
    415: "not-json",
}


async def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    kind, detail, headers = _KINDS.get(error.status_code, "http"), error.detail, error.headers
    path = printable(request.url.path)
    if kind == "method-not-allowed":
        # The first route of an address knows only its own methods.
        allowed = _methods(request, (error.headers or {}).get("Allow", "GET"))
        headers = {"Allow": ", ".join(allowed).upper()}
        detail = f"{path} takes no {request.method}; accepted: {headers['Allow']}"
    elif kind == "not-found" and detail == HTTPStatus.NOT_FOUND.phrase:
        detail = f"there is nothing at {path}; accepted: the addresses in /openapi.json"
    return respond(document(error.status_code, kind, detail), headers)


def _methods(request: Request, otherwise: str) -> list[str]:
    """Methods that the address of a request takes; the page's files are not in the schema."""
    address = getattr(request.scope.get("route"), "path_format", "")
    return sorted(request.app.openapi()["paths"].get(address, otherwise.split(", ")))
