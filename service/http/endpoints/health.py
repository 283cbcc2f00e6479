"""GET /healthz: whether the service can plan."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import APIRouter, Response

from service.http.schemas import Health, WorkersHealth
from service.http.state import Running

router = APIRouter(tags=["health"])


@router.get("/healthz", response_model=Health, responses={503: {"model": Health}})
async def health(service: Running, response: Response) -> Health:
    """Version of the service and load of its workers; 503 if the workers are unusable."""
    workers = WorkersHealth(**service.workers.state())
    if not workers.alive:
        response.status_code = 503
    return Health(
        status="ok" if workers.alive else "failing", version=version("joulepath"), workers=workers
    )
