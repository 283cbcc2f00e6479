"""API keys: who may ask. Without keys in the settings everybody may, on this machine alone.

A program sends ``Authorization: Bearer KEY``. The page asks for the key once and exchanges it at
``POST /key`` for a cookie that no script can read. The page's files and ``/healthz`` need no key:
they hold nothing of a user.
"""

from __future__ import annotations

import hmac
import ipaddress
from http.cookies import CookieError, SimpleCookie

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, Field
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from planner.errors import InputError
from service.http.bodies import json_body, read_json
from service.http.error_handlers import respond
from service.http.state import Running
from service.problems import document
from service.settings import Settings

COOKIE = "joulepath-key"
BODY_BYTES = 4096
"""Of a form with a key, at most."""
FREE = ("/", "/healthz", "/key", "/report.css", "/report.js", "/static/")
"""Paths that need no key; one that ends in a slash stands for all below it, but for "/" itself."""

router = APIRouter()


class Key(BaseModel):
    """What the page sends."""

    model_config = ConfigDict(extra="forbid")

    key: str = Field(min_length=1, max_length=1024)


@router.post("/key", include_in_schema=False)
async def exchange(request: Request, service: Running) -> Response:
    """A cookie for a key; 401 for a wrong one."""
    key = read_json(Key, await json_body(request, BODY_BYTES)).key
    if not known(key, service.settings.keys):
        return _refusal()
    response = Response(status_code=204)
    secure = request.url.scheme == "https"
    response.set_cookie(COOKIE, key, httponly=True, samesite="strict", secure=secure)
    return response


class KeyGuard:
    """Lets nobody without a key through to the application.

    Args:
        app: what is guarded.
        keys: those that open it.
    """

    def __init__(self, app: ASGIApp, keys: tuple[str, ...]) -> None:
        self.app, self.keys = app, keys

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer 401, or pass the request on."""
        if scope["type"] != "http" or _free(scope["path"]) or known(_key_of(scope), self.keys):
            await self.app(scope, receive, send)
        else:
            await _refusal()(scope, receive, send)


def known(key: str, keys: tuple[str, ...]) -> bool:
    """Whether a key is one of these, in a time that does not depend on how much of it is right."""
    given = key.encode()
    return sum(hmac.compare_digest(given, one.encode()) for one in keys) > 0  # looks at all


def check_address(host: str, settings: Settings) -> None:
    """Refuse to listen for others where everybody may ask.

    Raises:
        InputError: the address is not this machine's own, and neither keys nor openness are set.
    """
    if not (settings.keys or settings.open or _is_loopback(host)):
        raise InputError(
            "host",
            "lets other machines ask without a key",
            value=host,
            accepted="127.0.0.1, or any address with JOULEPATH_API_KEYS=KEY,… or JOULEPATH_OPEN=1",
        )


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _free(path: str) -> bool:
    return path in FREE or any(path.startswith(f) for f in FREE if f != "/" and f.endswith("/"))


def _key_of(scope: Scope) -> str:
    headers = Headers(scope=scope)
    kind, _, key = headers.get("authorization", "").partition(" ")
    if kind.lower() == "bearer" and key:
        return key.strip()
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return cookie.value if cookie else ""


def _refusal() -> Response:
    detail = "this service needs an API key; send the header Authorization: Bearer KEY"
    return respond(document(401, "no-key", detail), {"WWW-Authenticate": "Bearer"})
