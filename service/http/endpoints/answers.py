"""How a job is answered: its result if finished, the job itself otherwise."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.responses import JSONResponse, StreamingResponse
from starlette.requests import ClientDisconnect
from starlette.types import Receive, Scope, Send

from service.http.error_handlers import respond
from service.problems import describe, document

LINES = "application/x-ndjson"
"""Media type of an answer that comes in lines of JSON."""
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


async def with_progress(
    request: Request, begin: Callable[..., Coroutine[Any, Any, str]]
) -> Response:
    """A worker's answer in lines of JSON, with its progress as it comes.

    A line is ``{"progress": {"share", "sentence"}}``; the last one is ``{"answer"}`` or, where
    something went wrong after the first progress, ``{"problem"}``.

    Args:
        request: its body has been read.
        begin: takes a Progress as ``progress`` and gives JSON text.

    Raises:
        ClientDisconnect: the client disconnected before the first progress.
        Exception: what the work raised before it.
    """
    lines: asyncio.Queue[str | None] = asyncio.Queue()

    def tell(share: float, sentence: str) -> None:
        lines.put_nowait(json.dumps({"progress": {"share": share, "sentence": sentence}}) + "\n")

    working = asyncio.ensure_future(begin(progress=tell))
    working.add_done_callback(lambda _: lines.put_nowait(None))
    try:
        first = await while_listening(request, lines.get())
        if first is None:
            return Response(_last_line(working.result()), media_type=LINES)
    except BaseException:
        working.cancel()
        raise
    return _Lines(first, lines, working)


def _last_line(text: str) -> str:
    return f'{{"answer": {text}}}\n'


class _Lines(StreamingResponse):
    """Lines as they come; work that nobody reads any more ends."""

    def __init__(
        self, first: str, lines: asyncio.Queue[str | None], working: asyncio.Future[str]
    ) -> None:
        self._working = working

        async def content() -> AsyncIterator[str]:
            yield first
            while (line := await lines.get()) is not None:
                yield line
            try:
                yield _last_line(working.result())
            except Exception as error:
                yield json.dumps({"problem": describe(error)}) + "\n"

        super().__init__(content(), media_type=LINES)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._working.cancel()


async def _disconnected(request: Request) -> None:
    """Return when the client is gone."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
