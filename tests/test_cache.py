"""The cache keeps what was used last, within its bytes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from planner.cache import LEAST_BYTES, Cache


class Sheet:
    """Something of a size in kB."""

    def __init__(self, kilobytes: int) -> None:
        self.nbytes = 1000 * kilobytes


def test_the_least_recently_used_result_goes_first() -> None:
    cache = Cache(most_bytes=100_000)
    first = cache.get("a", lambda: Sheet(40))
    cache.get("b", lambda: Sheet(40))
    assert cache.get("a", lambda: Sheet(1)) is first
    cache.get("c", lambda: Sheet(40))
    assert cache.find("b") is None
    assert cache.find("a") is first
    assert cache.nbytes == 80_000


def test_a_result_larger_than_the_budget_is_not_kept() -> None:
    cache = Cache(most_bytes=100_000)
    cache.get("a", lambda: Sheet(60))
    assert cache.get("b", lambda: Sheet(101)).nbytes == 101_000
    assert cache.find("b") is None
    assert cache.find("a") is not None


def test_a_new_result_replaces_the_old_one_and_its_bytes() -> None:
    cache = Cache(most_bytes=100_000)
    cache.put("a", Sheet(60))
    cache.put("a", Sheet(20))
    assert cache.nbytes == 20_000
    cache.put("a", Sheet(101))
    assert cache.find("a") is None
    assert cache.nbytes == 0


@pytest.mark.parametrize("value", [None, 0.0, 1.5])
def test_small_results_are_built_once_and_count_as_well(value: float | None) -> None:
    cache = Cache(most_bytes=10 * LEAST_BYTES)
    built: list[int] = []

    def build() -> float | None:
        built.append(1)
        return value

    assert [cache.get("a", build) for _ in range(3)] == [value] * 3
    assert len(built) == 1
    for number in range(20):
        cache.put(number, value)
    assert cache.nbytes == 10 * LEAST_BYTES


def test_threads_share_a_cache_without_losing_count() -> None:
    cache = Cache(most_bytes=50_000)

    def work(number: int) -> int:
        return cache.get(number % 70, lambda: Sheet(1)).nbytes

    with ThreadPoolExecutor(max_workers=4) as pool:
        assert set(pool.map(work, range(5000))) == {1000}
    assert cache.nbytes == sum(1000 for key in range(70) if cache.find(key) is not None) == 50_000
    cache.clear()
    assert cache.nbytes == 0
    assert cache.find(0) is None
