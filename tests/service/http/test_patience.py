"""A client that sends half a request gets an end, not a place."""

from __future__ import annotations

import asyncio
import time
from contextlib import AbstractAsyncContextManager
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from service.http import create_app
from service.http.patience import BodyDeadline, PatientProtocol
from service.problems import TooSlow
from service.settings import Settings
from tests.service.conftest import ScriptedWorkers, listening
from tests.service.jobs.processes import run, until

SHORT_S = 0.2
HEAD = (
    b"POST /v1/routes HTTP/1.1\r\nHost: service\r\nContent-Type: application/json\r\n"
    b"Content-Length: 1000\r\n\r\n"
)


class Hasty(PatientProtocol):
    """Waits for a moment only."""

    patience_s = SHORT_S


def hasty(settings: Settings, workers: ScriptedWorkers) -> AbstractAsyncContextManager[int]:
    """The port of a service that waits for a moment only."""
    app = create_app(settings, workers)
    app.add_middleware(BodyDeadline, patience_s=SHORT_S)
    return listening(app, http=Hasty)


@pytest.mark.parametrize(
    ("sent", "answered"),
    [
        (b"", b"HTTP/1.1 408"),
        (b"POST /v1/routes HTTP/1.1\r\nHost: serv", b"HTTP/1.1 408"),
        (HEAD + b'{"map":', b"HTTP/1.1 408"),
        (HEAD.replace(b"/v1/routes", b"/v1/logs") + b"x", b"HTTP/1.1 408"),
        # One request as a whole, and the head of the next one by half.
        (b"GET /healthz HTTP/1.1\r\nHost: s\r\n\r\nGET /he", b"HTTP/1.1 200"),
    ],
)
def test_half_of_a_request_ends(
    settings: Settings, workers: ScriptedWorkers, sent: bytes, answered: bytes
) -> None:
    async def talk() -> None:
        async with hasty(settings, workers) as port:
            begun = time.monotonic()  # the service counts from the connection on
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(sent)
            # The connection ends, or this test does.
            got = await reader.read()
            assert got.startswith(answered)
            assert got.count(b"HTTP/1.1 408") == 1
            assert time.monotonic() - begun >= SHORT_S
            writer.close()

    run(talk)
    assert workers.asked == []


def test_a_late_body_is_a_problem_document(settings: Settings, workers: ScriptedWorkers) -> None:
    async def talk() -> None:
        async with hasty(settings, workers) as port:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(HEAD)
            head, _, body = (await reader.read()).partition(b"\r\n\r\n")
            assert b"application/problem+json" in head
            assert b"urn:joulepath:problem:too-slow" in body
            writer.close()

    run(talk)


def test_an_answer_may_take_longer_than_the_question(
    settings: Settings, workers: ScriptedWorkers
) -> None:
    async def long(job: str, arguments: tuple[Any, ...]) -> str:
        begun = time.monotonic()
        await until(lambda: time.monotonic() - begun > 2 * SHORT_S)
        return "{}"

    workers.work = long
    body = b'{"map": "warehouse", "start": {"x": 1, "y": 1}, "goal": {"x": 2, "y": 1}}'

    async def talk() -> None:
        async with hasty(settings, workers) as port:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(HEAD.replace(b"1000", str(len(body)).encode()) + body)
            assert (await reader.readline()).startswith(b"HTTP/1.1 200")
            writer.close()

    run(talk)


def test_a_body_that_keeps_coming_gets_the_time_it_needs() -> None:
    """Four pieces at four times the slowest rate take longer than the patience for none."""
    piece = bytes(8_192)
    taken: list[bytes] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        while True:
            message = await receive()
            taken.append(message["body"])
            if not message["more_body"]:
                return

    async def talk() -> None:
        begun = time.monotonic()

        async def receive() -> Message:
            number = len(taken) + 1
            await until(lambda: time.monotonic() - begun > 0.125 * number)
            return {"type": "http.request", "body": piece, "more_body": number < 4}

        async def send(message: Message) -> None:
            """Nothing to say."""

        deadline = BodyDeadline(app, patience_s=0.3)
        await deadline({"type": "http"}, receive, send)
        assert time.monotonic() - begun > 0.3
        taken.clear()

        async def never() -> Message:
            await asyncio.Event().wait()
            raise AssertionError

        with pytest.raises(TooSlow):
            await deadline({"type": "http"}, never, send)

    run(talk)
    assert taken == []
