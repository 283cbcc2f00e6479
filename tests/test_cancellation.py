"""One token stops Python and compiled code alike."""

from __future__ import annotations

import threading

import pytest

from planner.cancellation import CancellationToken
from planner.errors import Cancelled


def test_wish_to_stop_is_seen_while_nobody_asks() -> None:
    asked = threading.Event()

    def cancelled() -> bool:
        asked.set()
        return True

    with CancellationToken(cancelled) as token:
        assert asked.wait(10.0)
    assert token.flag[0]  # compiled searches look at this
    with pytest.raises(Cancelled):
        token.check()


def test_the_thread_ends_with_the_work() -> None:
    before = threading.active_count()
    with CancellationToken(lambda: False) as token:
        assert threading.active_count() == before + 1
    assert threading.active_count() == before
    assert not token.flag[0]


def test_no_thread_runs_where_nobody_can_cancel() -> None:
    before = threading.active_count()
    with CancellationToken() as token:
        assert threading.active_count() == before
        token.check()
    assert not token.cancelled()


def test_a_wish_that_was_heard_stays() -> None:
    answers = iter([False, True])
    token = CancellationToken(lambda: next(answers))
    assert [token.cancelled() for _ in range(4)] == [False, True, True, True]


def test_progress_is_not_reported_once_the_caller_has_cancelled() -> None:
    told: list[tuple[float, str]] = []
    watch = CancellationToken(lambda: len(told) == 1).watched(
        lambda share, sentence: told.append((share, sentence))
    )
    watch(0.25, "a quarter")
    with pytest.raises(Cancelled):
        watch(0.5, "half way")
    assert told == [(0.25, "a quarter")]
