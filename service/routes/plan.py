"""POST /v1/routes: plan a route in a worker process."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request, Response

from planner.errors import RequestError
from planner.search.request import PlanRequest
from service.bodies import json_body
from service.schemas import RouteAnswer, problem_responses
from service.state import Running

router = APIRouter(prefix="/v1", tags=["routes"])

EXAMPLE = {
    "map": "jacksboro-1to100",
    "vehicle": "minibalance",
    "start": {"x": 12.0, "y": 15.0},
    "goal": {"x": 85.0, "y": 70.0},
    "seed": 1,
}

_PROBLEMS = problem_responses(413, 415, 422, 500, 503, 504)


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
    asked = PlanRequest.from_text(await json_body(request, service.settings.max_body_bytes))
    most = service.settings.max_time_budget_s
    if asked.time_budget_s > most:
        raise RequestError(
            "time_budget_s",
            "is larger than this service allows",
            value=asked.time_budget_s,
            accepted=f"seconds to search, above 0 up to {most:g}",
        )
    asked = await asyncio.to_thread(service.names.resolve, asked)
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


async def _disconnected(request: Request) -> None:
    """Returns when the client is gone."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
