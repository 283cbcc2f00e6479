"""POST /v1/routes, /v1/fronts, /v1/graphs and others: questions about routes.

A worker process answers each of them.
"""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Any, TypeVar

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel
from starlette.exceptions import HTTPException

from planner.errors import RequestError
from planner.search.requests import (
    FrontRequest,
    MatrixRequest,
    PlanRequest,
    ReachRequest,
    SituationRequest,
)
from planner.search.route_graph import GraphRequest
from service.formats import MEDIA_TYPES, accepted
from service.http.bodies import json_body
from service.http.endpoints.answers import LINES, while_listening, with_progress
from service.http.requests import BaselinePoses, Files, Report, WithProgress
from service.http.schemas import (
    FrontAnswer,
    GraphAnswer,
    MatrixAnswer,
    ReachAnswer,
    RouteAnswer,
    described,
    json_content,
)
from service.http.state import Running, Service

router = APIRouter(prefix="/v1", tags=["routes"])

_FAULT = {"map": "jacksboro-1to100", "start": {"x": 93.0, "y": 225.0}}
_WAREHOUSE = {"map": "warehouse", "start": {"x": 1.5, "y": 2.0}, "goal": {"x": 27.0, "y": 17.0}}
_STARTS = [{"x": 2.0, "y": 2.0}, {"x": 20.0, "y": 17.0}, {"x": 27.0, "y": 4.0}]
EXAMPLE = {**_FAULT, "vehicle": "minibalance", "goal": {"x": 212.0, "y": 73.0}, "seed": 1}
MATRIX_EXAMPLE = {"map": "warehouse", "starts": _STARTS}
FRONT_EXAMPLE = {**_WAREHOUSE, "points": 5}
_GRAPH = GraphRequest.model_fields["graph"].examples or [{}]
GRAPH_EXAMPLE = {"map": "warehouse", "corridor_m": 1.5, "graph": _GRAPH[0]}
REACH_EXAMPLE = {**_FAULT, "energy_j": 1500}


_OTHER_FORMATS = (*(media for media in MEDIA_TYPES if media != "application/json"), LINES)

Asked = TypeVar("Asked", bound=SituationRequest)


def _described(
    asked: type[BaseModel], answered: type[BaseModel], example: dict[str, Any], *other_media: str
) -> dict[str, Any]:
    """OpenAPI description of a question."""
    content = {media: {"schema": {"type": "string"}} for media in other_media}
    answer = {200: {"model": answered, "description": answered.__doc__, "content": content}}
    problems = (*(406,) * bool(other_media), 408, 413, 415, 422, 500, 503, 504)
    return described(json_content(asked, example), answer, *problems)


@router.post("/routes", **_described(PlanRequest, RouteAnswer, EXAMPLE, *_OTHER_FORMATS))
async def plan_route(
    request: Request,
    service: Running,
    report: Report = False,
    files: Files = False,
    baseline_poses: BaselinePoses = False,
    progress: WithProgress = False,
) -> Response:
    """Plan the route of least energy.

    The body is a PlanRequest. If no route exists, the status is 200 with `"status": "no_route"`.
    A client that disconnects ends its own job. `Accept` chooses GeoJSON, CSV or nav_msgs/Path.
    """
    best = accepted(request.headers.get("accept"))
    if best is None:
        raise HTTPException(406, f"a route is sent as one of {', '.join(MEDIA_TYPES)}")
    media, format_ = best
    options = (report, files, baseline_poses, format_)
    asked = await _asked(request, service, PlanRequest)
    work = partial(service.workers.run, "plan_route", asked, *options)
    if progress and format_ == "json":
        return await with_progress(request, work)
    return Response(await while_listening(request, work()), media_type=media)


@router.post("/matrices", **_described(MatrixRequest, MatrixAnswer, MATRIX_EXAMPLE))
async def energy_matrix(request: Request, service: Running) -> Response:
    """Energies from each start to each goal; null where there is no route."""
    return await _answered(request, service, "energy_matrix", MatrixRequest)


@router.post("/graphs", **_described(GraphRequest, GraphAnswer, GRAPH_EXAMPLE))
async def energy_graph(request: Request, service: Running) -> Response:
    """A graph of places and edges with the energy of every edge, for Nav2's route server."""
    return await _answered(request, service, "energy_graph", GraphRequest, "max_graph_bytes")


@router.post("/reachable-areas", **_described(ReachRequest, ReachAnswer, REACH_EXAMPLE))
async def reachable_area(request: Request, service: Running) -> Response:
    """Area that the robot can reach with an energy, one way or there and back."""
    return await _answered(request, service, "reachable_area", ReachRequest)


@router.post("/fronts", **_described(FrontRequest, FrontAnswer, FRONT_EXAMPLE))
async def energy_time_front(request: Request, service: Running) -> Response:
    """Pareto front of duration and energy, from the fastest route to that of least energy."""
    return await _answered(request, service, "energy_time_front", FrontRequest)


async def _answered(
    request: Request,
    service: Service,
    job: str,
    kind: type[SituationRequest],
    limit: str = "max_body_bytes",
) -> Response:
    """JSON text from a worker; a client that disconnects ends its own job."""
    asked = await _asked(request, service, kind, limit)
    text = await while_listening(request, service.workers.run(job, asked))
    return Response(text, media_type="application/json")


async def _asked(
    request: Request, service: Service, kind: type[Asked], limit: str = "max_body_bytes"
) -> Asked:
    """The request in the body, within the service's limits, with names as paths."""
    asked = kind.from_text(await json_body(request, getattr(service.settings, limit), limit))
    most = service.settings.max_time_budget_s
    for name in ("time_budget_s", "certify_s"):
        if (seconds := getattr(asked, name, None) or 0.0) > most:
            raise RequestError(
                name,
                "is larger than this service allows",
                value=seconds,
                accepted=f"seconds, above 0 up to {most:g}",
            )
    return await asyncio.to_thread(service.names.resolve, asked)
