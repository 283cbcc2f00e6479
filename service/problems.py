"""Errors of the service, and every error as an RFC 9457 problem document.

    {"type": "urn:joulepath:problem:bad-input", "title": "…", "status": 422,
     "detail": "start.x: is not a finite number; accepted: …", "field": "start.x", "accepted": "…"}

A document quotes from a request only what the sentence of an InputError quotes, which is always
printable. Store, jobs and endpoints share this module; it needs no web framework.
"""

from __future__ import annotations

import errno
import os
import uuid
from collections.abc import Iterable
from http import HTTPStatus
from pathlib import Path
from typing import Any, TypeVar

import structlog

from planner.errors import InputError, JoulepathError

T = TypeVar("T")

_log = structlog.get_logger("joulepath.service")


class Unavailable(JoulepathError):
    """The request cannot be carried out now, but later; nothing was changed.

    Args:
        sentence: why.
        retry_after_s: when to try again.
    """

    kind = "unavailable"

    def __init__(self, sentence: str, retry_after_s: int) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(sentence)


class Busy(Unavailable):
    """All workers are busy and the queue is full."""

    kind = "busy"

    def __init__(self, retry_after_s: int) -> None:
        super().__init__("all workers are busy and the queue is full", retry_after_s)


class DatabaseLocked(Unavailable):
    """The database stayed locked by another program, or unreachable, beyond the waiting time."""

    kind = "database-locked"

    def __init__(self) -> None:
        super().__init__("the database is locked by another program or cannot be reached", 5)


class TookTooLong(JoulepathError):
    """A request exceeded the service's time limit and was ended."""


class WorkerLost(JoulepathError):
    """The worker process of a request ended before it answered."""


class Conflict(JoulepathError):
    """The request conflicts with the current state."""


class TooLarge(JoulepathError):
    """The body of the request is too large."""


class TooSlow(JoulepathError):
    """The body of the request did not arrive in time."""


class NoSuch(JoulepathError):
    """Nothing has the requested id."""

    def __init__(self, what: str, identity: str) -> None:
        super().__init__(f"there is no {what} {identity[:40]!r}")


def found(value: T | None, what: str, identity: str) -> T:
    """The value of a look-up.

    Raises:
        NoSuch: it is None.
    """
    if value is None:
        raise NoSuch(what, identity)
    return value


def without_folders(error: Exception, folders: Iterable[Path]) -> Exception:
    """The same error; files in these folders are named as requests name them, not by their path."""
    if not isinstance(error, InputError):
        return error

    def shortened(words: Any) -> Any:
        for folder in folders if isinstance(words, str) else ():
            words = words.replace(f"{folder}{os.sep}", "")
        return words

    return type(error)(
        shortened(error.field),
        shortened(error.problem),
        value=shortened(error.value),
        accepted=shortened(error.accepted),
    )


def document(status: int, kind: str, detail: str, **members: Any) -> dict[str, Any]:
    """One problem document.

    Args:
        status: HTTP status.
        kind: last part of the type URN, which is stable.
        detail: one sentence for people.
        members: further members; those that are None are left out.
    """
    return {
        "type": f"urn:joulepath:problem:{kind}",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
        **{key: value for key, value in members.items() if value is not None},
    }


STATUS = {
    Conflict: (409, "conflict"),
    NoSuch: (404, "not-found"),
    TooLarge: (413, "too-large"),
    TooSlow: (408, "too-slow"),
    TookTooLong: (504, "time-limit"),
    WorkerLost: (500, "worker-lost"),
}
"""HTTP status and last part of the type URN of the service's own errors."""


def describe(error: Exception) -> dict[str, Any]:
    """The problem document of any error; an unexpected one is logged under its ``id``."""
    if isinstance(error, InputError):
        return document(422, "bad-input", str(error), field=error.field, accepted=error.accepted)
    if isinstance(error, Unavailable):
        return document(503, error.kind, f"{error}; try again in {error.retry_after_s} s")
    for kind, (status, name) in STATUS.items():
        if isinstance(error, kind):
            return document(status, name, str(error))
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return document(507, "no-space", "the service's disk is full")
    number = str(uuid.uuid4())
    _log.error("failed", id=number, exc_info=error)
    detail = f"internal error, logged by the service with id {number}"
    return document(500, "unexpected", detail, id=number)
