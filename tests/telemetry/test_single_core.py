"""One core for linear algebra inside, and as many as before outside."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from planner.errors import LogError
from planner.telemetry.comparison import compare
from planner.telemetry.diagnosis import diagnose


@pytest.fixture(autouse=True)
def _two_threads() -> Iterator[None]:
    with threadpool_limits(limits=2, user_api="blas"):
        yield


def threads() -> set[int]:
    """Threads of every library of linear algebra that is loaded."""
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.mark.parametrize("examine", [compare, diagnose])
def test_examining_a_log_takes_one_core_and_gives_back_the_others(examine) -> None:
    during = []
    with pytest.raises(LogError):
        examine("nowhere.csv", "minibalance", progress=lambda *said: during.append(threads()))
    assert during
    assert set.union(*during) == {1}
    assert threads() == {2}
