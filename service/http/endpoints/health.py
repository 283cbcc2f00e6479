"""GET /healthz: whether the service can plan and keep what it is given."""

from __future__ import annotations

import asyncio
from importlib.metadata import version

from fastapi import APIRouter, Response

from service.http.schemas import Health, WorkersHealth
from service.http.state import Running

router = APIRouter(tags=["health"])


@router.get("/healthz", response_model=Health, responses={503: {"model": Health}})
async def health(service: Running, response: Response) -> Health:
    """Version, load of the workers, and store; 503 if the workers or the store are unusable."""
    workers = WorkersHealth(**service.workers.state())
    problem = await asyncio.to_thread(service.store.problem)
    fine = workers.alive and problem is None
    if not fine:
        response.status_code = 503
    return Health(
        status="ok" if fine else "failing",
        version=version("joulepath"),
        workers=workers,
        store=problem or "ok",
    )
