"""GET /v1/maps, /v1/vehicles, /v1/effects: names for requests, and effects."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, HTTPException, Query, Request, Response

from planner.errors import RequestError
from planner.search.requests import SituationRequest
from service.http.endpoints.answers import while_listening
from service.http.requests import Report
from service.http.schemas import Entry, Ground, Problem, Relief
from service.http.state import Running, Service

router = APIRouter(prefix="/v1", tags=["catalogues"])

DEFAULT_VEHICLE = SituationRequest.default_vehicle


def _with_files(
    entries: list[dict[str, Any]], service: Service, field: str
) -> list[dict[str, Any]]:
    files = [{"name": name, "title": "file of this service"} for name in service.names.files(field)]
    return [*entries, *files]


@router.get("/maps", response_model=list[Entry])
def maps(service: Running) -> list[dict[str, Any]]:
    """Maps of the catalogue and of the service's folder."""
    return _with_files(service.catalogues.maps, service, "map")


@router.get("/vehicles", response_model=list[Entry])
def vehicles(service: Running) -> list[dict[str, Any]]:
    """Vehicles of the catalogue and of the service's folder."""
    return _with_files(service.catalogues.vehicles, service, "vehicle")


@router.get("/effects", response_model=list[Entry])
def effects(service: Running) -> list[dict[str, Any]]:
    """Physical effects of power models, with their parameters."""
    return service.catalogues.effects


@router.get(
    "/maps/{name:path}/ground",
    response_class=Response,
    responses={200: {"model": Ground}, 404: {"model": Problem}, 503: {"model": Problem}},
)
async def ground(
    name: str,
    request: Request,
    service: Running,
    vehicle: Annotated[str, Query(max_length=1024)] = DEFAULT_VEHICLE,
    model: Annotated[str | None, Query(max_length=1024)] = None,
) -> Response:
    """Where a robot cannot go on a map, and the kinds of its ground, as HTML in `report`."""
    try:
        known = [service.names.find("map", name), service.names.find("vehicle", vehicle)]
        # A built-in kind of model says nothing of the robot.
        kind = model is None or model in service.names.catalogue["model"]
        stored = None if kind else service.names.find("model", model or "")
    except RequestError as error:
        raise HTTPException(404, str(error)) from None
    layer = await while_listening(request, service.workers.run("ground", *known, stored))
    return Response(layer, media_type="application/json", headers={"Cache-Control": "max-age=300"})


@router.get(
    "/maps/{name:path}/relief",
    response_class=Response,
    responses={200: {"model": Relief}, 404: {"model": Problem}, 503: {"model": Problem}},
)
async def relief(
    name: str,
    request: Request,
    service: Running,
    most: Annotated[int, Query(ge=16, le=1024)] = 320,
    report: Report = False,
) -> Response:
    """Heights of a map for a picture, reduced to at most `most` columns and rows."""
    try:
        found = service.names.find("map", name)
    except RequestError as error:
        raise HTTPException(404, str(error)) from None
    heights = await while_listening(request, service.workers.run("relief", found, most, report))
    return Response(
        heights, media_type="application/json", headers={"Cache-Control": "max-age=300"}
    )
