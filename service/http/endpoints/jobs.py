"""/v1/jobs: progress and results of jobs, and cancelling."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query

from service.http.schemas import problem_responses
from service.http.state import Running
from service.http.workbench_schemas import Job, JobSummary

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])


@router.get("", response_model=list[JobSummary])
def jobs(
    service: Running, most: Annotated[int, Query(ge=1, le=1000)] = 100
) -> list[dict[str, Any]]:
    """The newest jobs, newest first, without their results."""
    return service.store.jobs.newest(most)


@router.get("/{job}", response_model=Job, responses=problem_responses(404))
async def job(job: str, service: Running) -> dict[str, Any]:
    """State and progress of a job, with its result or problem document."""
    return await service.jobs.get(job)


@router.delete("/{job}", response_model=Job, responses=problem_responses(404))
async def cancel(job: str, service: Running) -> dict[str, Any]:
    """Cancel a job and end its process at once; a finished job is unchanged."""
    return await service.jobs.cancel(job)
