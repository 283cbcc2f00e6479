"""How a job is answered: its result if finished, the job itself otherwise."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

from fastapi import Request
from fastapi.responses import JSONResponse
from starlette.requests import ClientDisconnect

from service.http.error_handlers import respond
from service.problems import document

HEADER_LOCATION = {"Location": {"description": "URL of the job", "schema": {"type": "string"}}}


def job_response(job: dict[str, Any]) -> JSONResponse:
    """A job as a response: result, problem, or 202 with the job."""
    where = {"Location": f"/v1/jobs/{job['id']}"}
    match job["state"]:
        case "done":
            return JSONResponse(job["result"], headers=where)
        case "failed":
            return respond(job["error"], where)
        case "cancelled":
            return respond(document(409, "cancelled", "the job was cancelled"), where)
    return JSONResponse(job, 202, headers=where)


async def while_listening(request: Request, work: Coroutine[Any, Any, Any]) -> Any:
    """The result of a worker; a client that disconnects ends its own work.

    Args:
        request: its body has been read.
        work: returned by Workers.run.

    Raises:
        ClientDisconnect: the client disconnected before the result.
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
    """Return when the client is gone."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
