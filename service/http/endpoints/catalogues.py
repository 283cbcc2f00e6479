"""GET /v1/maps, /v1/vehicles, /v1/effects: names for requests, and effects."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, HTTPException, Query, Request, Response

from planner.errors import RequestError
from service.http.endpoints.answers import while_listening
from service.http.requests import Report
from service.http.schemas import Entry, Problem, Relief
from service.http.state import Running, Service

router = APIRouter(prefix="/v1", tags=["catalogues"])


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
