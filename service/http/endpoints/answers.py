"""How a job is answered: its result when it is there, itself while it is not."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

from fastapi import Request
from fastapi.responses import JSONResponse
from starlette.requests import ClientDisconnect

from service.http.error_handlers import respond
from service.problems import document

HEADER_LOCATION = {
    "Location": {"description": "address of the job", "schema": {"type": "string"}},
}


def job_response(job: dict[str, Any]) -> JSONResponse:
    """A job as a response: result, problem, or 202 with the job."""
    where = {"Location": f"/v1/jobs/{job['id']}"}
    if job["state"] == "done":
        return JSONResponse(job["result"], headers=where)
    if job["state"] == "failed":
        return respond(job["error"], where)
    if job["state"] == "cancelled":
        cancelled = document(409, "cancelled", "the job was cancelled")
        return respond(cancelled, where)
    return JSONResponse(job, 202, headers=where)


async def while_listening(request: Request, work: Coroutine[Any, Any, Any]) -> Any:
    """What a worker answers; a client that hangs up ends its own work.

    Args:
        request: whose body was read.
        work: what Workers.run returned.

    Raises:
        ClientDisconnect: nobody would read the answer any more.
    """
    working = asyncio.ensure_future(work)
    gone = asyncio.ensure_future(_disconnected(request))
    try:
        await asyncio.wait({working, gone}, return_when=asyncio.FIRST_COMPLETED)
        if not working.done():
            raise ClientDisconnect
        return working.result()
    finally:
        gone.cancel()
        working.cancel()


async def _disconnected(request: Request) -> None:
    """Returns when the client is gone."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
