"""How long the service waits for the rest of a request.

    app.add_middleware(BodyDeadline)
    uvicorn.run(app, http=PatientProtocol)

A client that sends half a request, or none, keeps a connection and perhaps a file on the disk.
The protocol ends connections whose head is incomplete, the middleware requests whose body is.
"""

from __future__ import annotations

import asyncio

import h11
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.problems import TooSlow

PATIENCE_S = 30.0
"""Seconds for a request's head, and again for its body."""
SLOWEST_BYTES_PER_S = 16_384
"""A body that comes at least so fast, slower than any usable network, gets the time it needs."""

_TIMEOUT = b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"


class BodyDeadline:
    """Ends a request whose body is late.

    Args:
        app: what reads the body; its reading raises TooSlow.
        patience_s: seconds, beside those that the received bytes take at the slowest rate.
    """

    def __init__(self, app: ASGIApp, patience_s: float = PATIENCE_S) -> None:
        self.app, self.patience_s = app, patience_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, its body with a deadline."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        loop = asyncio.get_running_loop()
        deadline, complete = loop.time() + self.patience_s, False

        async def receive_in_time() -> Message:
            nonlocal deadline, complete
            if complete:
                # What comes now is that the client is gone.
                return await receive()
            try:
                async with asyncio.timeout_at(deadline):
                    message = await receive()
            except TimeoutError:
                raise TooSlow(
                    f"the request's body did not arrive within {self.patience_s:g} s"
                ) from None
            complete = not message.get("more_body", False)
            deadline += len(message.get("body", b"")) / SLOWEST_BYTES_PER_S
            return message

        await self.app(scope, receive_in_time, send)


class PatientProtocol(H11Protocol):
    """Ends a connection on which no whole head of a request arrives in time."""

    patience_s = PATIENCE_S
    _waiting: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first request."""
        super().connection_made(transport)
        self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Nothing to wait for."""
        self._stop_waiting()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Stop waiting when a head is complete."""
        before = self.cycle
        super().handle_events()
        if self.cycle is not before:
            self._stop_waiting()

    def on_response_complete(self) -> None:
        """Wait for the next request, which may be there already."""
        self._wait()
        super().on_response_complete()

    def _wait(self) -> None:
        self._stop_waiting()
        self._waiting = self.loop.call_later(self.patience_s, self._give_up)

    def _stop_waiting(self) -> None:
        if self._waiting is not None:
            self._waiting.cancel()
            self._waiting = None

    def _give_up(self) -> None:
        if self.conn.our_state is h11.IDLE:
            self.transport.write(_TIMEOUT)
        self.transport.close()
