"""How a job is answered: its result when it is there, itself while it is not."""

from __future__ import annotations

from typing import Any

from fastapi.responses import JSONResponse

from service import problems

HEADER_LOCATION = {
    "Location": {"description": "address of the job", "schema": {"type": "string"}},
}


def job_response(job: dict[str, Any]) -> JSONResponse:
    """A job as a response: result, problem, or 202 with the job."""
    where = {"Location": f"/v1/jobs/{job['id']}"}
    if job["state"] == "done":
        return JSONResponse(job["result"], headers=where)
    if job["state"] == "failed":
        return problems.respond(job["error"], where)
    if job["state"] == "cancelled":
        cancelled = problems.document(409, "cancelled", "the job was cancelled")
        return problems.respond(cancelled, where)
    return JSONResponse(job, 202, headers=where)
