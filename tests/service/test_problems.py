"""Every error is a problem document; what is not expected tells nothing of itself."""

from __future__ import annotations

import errno

import pytest

from planner.errors import RequestError
from service import problems
from service.problems import (
    Busy,
    Conflict,
    DatabaseLocked,
    NoSuch,
    TookTooLong,
    TooLarge,
    WorkerLost,
    describe,
)


@pytest.mark.parametrize(
    ("error", "status", "kind"),
    [
        (RequestError("start.x", "is not a number", accepted="a number"), 422, "bad-input"),
        (Busy(4), 503, "busy"),
        (DatabaseLocked(), 503, "database-locked"),
        (Conflict("it runs"), 409, "conflict"),
        (NoSuch("job", "abc"), 404, "not-found"),
        (TooLarge("too much"), 413, "too-large"),
        (TookTooLong("ended"), 504, "time-limit"),
        (WorkerLost("gone"), 500, "worker-lost"),
        (OSError(errno.ENOSPC, "no space left on device"), 507, "no-space"),
        (OSError(errno.EIO, "input/output error"), 500, "unexpected"),
    ],
)
def test_every_error_has_its_status_and_type(error: Exception, status: int, kind: str) -> None:
    found = describe(error)
    assert (found["status"], found["type"]) == (status, f"urn:joulepath:problem:{kind}")
    assert found["title"]
    assert found["detail"]


def test_a_refused_field_is_named_with_what_would_do() -> None:
    found = describe(RequestError("map", "no such map", value="x", accepted="valley"))
    assert (found["field"], found["accepted"]) == ("map", "valley")


def test_who_is_turned_away_learns_when_to_come_back() -> None:
    assert "try again in 7 s" in describe(Busy(7))["detail"]


def test_an_unexpected_error_is_told_by_a_number_only() -> None:
    first, second = (describe(ValueError("the password is 1234")) for _ in range(2))
    assert "1234" not in str(first)
    assert first["id"] in first["detail"]
    assert first["id"] != second["id"]


def test_members_without_a_value_are_left_out() -> None:
    assert "field" not in problems.document(404, "not-found", "nothing", field=None)


def test_a_long_id_is_cut_off() -> None:
    assert len(str(NoSuch("job", "x" * 10_000))) < 100
