"""POST /v1/routes: plan a route in a worker process."""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import APIRouter, HTTPException, Request, Response

from planner.errors import RequestError
from planner.search.request import PlanRequest
from service.problems import MEDIA_TYPE
from service.schemas import Problem, RouteAnswer
from service.state import Running

router = APIRouter(prefix="/v1", tags=["routes"])

EXAMPLE = {
    "map": "jacksboro-1to100",
    "vehicle": "minibalance",
    "start": {"x": 12.0, "y": 15.0},
    "goal": {"x": 85.0, "y": 70.0},
    "seed": 1,
}

_PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {"model": Problem, "content": {MEDIA_TYPE: {}}, "description": what}
    for status, what in {
        413: "The body is larger than the service takes.",
        415: "The body is not said to be JSON.",
        422: "Something in the request cannot be used; `field` says what.",
        500: "Something failed inside the service.",
        503: "All workers are busy; `Retry-After` says when to try again.",
        504: "The service's time limit was reached.",
    }.items()
}


@router.post(
    "/routes",
    response_class=Response,
    responses={
        200: {"model": RouteAnswer, "description": "A route, or why there is none."},
        **_PROBLEMS,
    },
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {
                    "schema": {"$ref": "#/components/schemas/PlanRequest"},
                    "example": EXAMPLE,
                }
            },
        }
    },
)
async def plan(request: Request, service: Running) -> Response:
    """Plan the route that costs the least energy.

    The body is a PlanRequest. A well-formed question whose answer is "no route" is answered with
    status 200 and `"status": "no_route"`. A client that hangs up ends its own job.
    """
    asked = PlanRequest.from_text(await _body(request, service.settings.max_body_bytes))
    most = service.settings.max_time_budget_s
    if asked.time_budget_s > most:
        raise RequestError(
            "time_budget_s",
            "is larger than this service allows",
            value=asked.time_budget_s,
            accepted=f"seconds to search, above 0 up to {most:g}",
        )
    asked = service.names.resolve(asked)
    job = asyncio.ensure_future(service.workers.run("solve", asked))
    gone = asyncio.ensure_future(_disconnected(request))
    try:
        await asyncio.wait({job, gone}, return_when=asyncio.FIRST_COMPLETED)
        if not job.done():
            # Nobody reads this answer.
            return Response(status_code=499)
        return Response(job.result(), media_type="application/json")
    finally:
        gone.cancel()
        job.cancel()


async def _body(request: Request, most: int) -> bytes:
    """The request's body, refused as soon as it is too large or not JSON."""
    media_type = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if media_type != "application/json":
        raise HTTPException(415, "the body must be JSON, sent with Content-Type: application/json")
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > most:
            raise HTTPException(413, f"the body is larger than {most} bytes")
    return bytes(body)


async def _disconnected(request: Request) -> None:
    """Returns when the client is gone."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
