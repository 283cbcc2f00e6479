"""POST /v1/routes, /v1/fronts, /v1/matrices, /v1/reachable-areas: questions about ways.

A worker process answers each of them.
"""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import APIRouter, Request, Response

from planner.errors import RequestError
from planner.search.requests import (
    FrontRequest,
    MatrixRequest,
    PlanRequest,
    ReachRequest,
    SituationRequest,
)
from service.http.bodies import json_body
from service.http.endpoints.answers import while_listening
from service.http.requests import Report
from service.http.schemas import (
    FrontAnswer,
    MatrixAnswer,
    ReachAnswer,
    RouteAnswer,
    problem_responses,
)
from service.http.state import Running

router = APIRouter(prefix="/v1", tags=["routes"])

EXAMPLE = {
    "map": "jacksboro-1to100",
    "vehicle": "minibalance",
    "start": {"x": 93.0, "y": 225.0},
    "goal": {"x": 212.0, "y": 73.0},
    "seed": 1,
}

MATRIX_EXAMPLE = {
    "map": "warehouse",
    "starts": [{"x": 2.0, "y": 2.0}, {"x": 20.0, "y": 17.0}, {"x": 27.0, "y": 4.0}],
}
FRONT_EXAMPLE = {
    "map": "warehouse",
    "start": {"x": 1.5, "y": 2.0},
    "goal": {"x": 27.0, "y": 17.0},
    "points": 5,
}
REACH_EXAMPLE = {"map": "jacksboro-1to100", "start": {"x": 93.0, "y": 225.0}, "energy_j": 1500}

_PROBLEMS = problem_responses(413, 415, 422, 500, 503, 504)


def _body(schema: str, example: dict[str, Any]) -> dict[str, Any]:
    """How a request's body is described in the OpenAPI document."""
    content = {"schema": {"$ref": f"#/components/schemas/{schema}"}, "example": example}
    return {"requestBody": {"required": True, "content": {"application/json": content}}}


@router.post(
    "/routes",
    response_class=Response,
    responses={
        200: {"model": RouteAnswer, "description": "A route, or why there is none."},
        **_PROBLEMS,
    },
    openapi_extra=_body("PlanRequest", EXAMPLE),
)
async def plan_route(request: Request, service: Running, report: Report = False) -> Response:
    """Plan the route that costs the least energy.

    The body is a PlanRequest. A well-formed question whose answer is "no route" is answered with
    status 200 and `"status": "no_route"`. A client that hangs up ends its own job.
    """
    asked = PlanRequest.from_text(await json_body(request, service.settings.max_body_bytes))
    most = service.settings.max_time_budget_s
    for name in ("time_budget_s", "certify_s"):
        seconds = getattr(asked, name) or 0.0
        if seconds > most:
            raise RequestError(
                name,
                "is larger than this service allows",
                value=seconds,
                accepted=f"seconds, above 0 up to {most:g}",
            )
    return await _answered(request, service, "plan_route", asked, report)


@router.post(
    "/matrices",
    response_class=Response,
    responses={
        200: {"model": MatrixAnswer, "description": "Energies between places."},
        **_PROBLEMS,
    },
    openapi_extra=_body("MatrixRequest", MATRIX_EXAMPLE),
)
async def energy_matrix(request: Request, service: Running) -> Response:
    """Energies from each of some places to each of others; null where there is no way."""
    body = await json_body(request, service.settings.max_body_bytes)
    return await _answered(request, service, "energy_matrix", MatrixRequest.from_text(body))


@router.post(
    "/reachable-areas",
    response_class=Response,
    responses={
        200: {"model": ReachAnswer, "description": "The area and its outlines."},
        **_PROBLEMS,
    },
    openapi_extra=_body("ReachRequest", REACH_EXAMPLE),
)
async def reachable_area(request: Request, service: Running) -> Response:
    """How far an energy takes the robot, there or there and back."""
    body = await json_body(request, service.settings.max_body_bytes)
    return await _answered(request, service, "reachable_area", ReachRequest.from_text(body))


@router.post(
    "/fronts",
    response_class=Response,
    responses={
        200: {"model": FrontAnswer, "description": "Routes, or why there are none."},
        **_PROBLEMS,
    },
    openapi_extra=_body("FrontRequest", FRONT_EXAMPLE),
)
async def energy_time_front(request: Request, service: Running) -> Response:
    """What a second costs: routes from the fastest to that of least energy."""
    body = await json_body(request, service.settings.max_body_bytes)
    return await _answered(request, service, "energy_time_front", FrontRequest.from_text(body))


async def _answered(
    request: Request, service: Running, job: str, asked: SituationRequest, *options: bool
) -> Response:
    """A worker's JSON text; a client that hangs up ends its own job."""
    asked = await asyncio.to_thread(service.names.resolve, asked)
    text = await while_listening(request, service.workers.run(job, asked, *options))
    return Response(text, media_type="application/json")
