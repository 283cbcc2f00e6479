"""Results that are asked for again, bounded in bytes.

    cache = Cache(most_bytes=1 << 30)
    lattice = cache.get(("lattice", key), lambda: build_lattice(field))

The least recently used result goes first. Each process has one cache, ``CACHE``, for all results
of size; its threads share it, and the first part of a key says what the result is.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, Protocol, TypeVar

LEAST_BYTES = 512
"""Bytes that a result counts at least, for its key and its place."""


class Sized(Protocol):
    """Anything that knows how much memory it takes."""

    @property
    def nbytes(self) -> int:
        """Bytes."""


Item = TypeVar("Item", bound=Sized | float | None)


class Cache:
    """Results by key, the least recently used ones dropped first.

    Args:
        most_bytes: all results together; a larger one is not kept.
    """

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes = most_bytes
        self._lock = Lock()
        self._items: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._bytes = 0

    @property
    def nbytes(self) -> int:
        """Bytes of all results."""
        return self._bytes

    def find(self, key: Hashable) -> Any | None:
        """The result under a key, or None."""
        return self._found(key)[0]

    def put(self, key: Hashable, item: Sized | float | None) -> None:
        """Keep a result, in place of the one under this key."""
        # Some results grow while they are used; their size is taken as it is now.
        size = max(LEAST_BYTES, getattr(item, "nbytes", 0))
        with self._lock:
            if key in self._items:
                self._bytes -= self._items.pop(key)[1]
            if size > self.most_bytes:
                return
            self._items[key] = (item, size)
            self._bytes += size
            while self._bytes > self.most_bytes:
                _, (_, freed) = self._items.popitem(last=False)
                self._bytes -= freed

    def get(self, key: Hashable, build: Callable[[], Item]) -> Item:
        """The result under a key, None included; ``build`` makes one that is not there.

        Two threads that ask for the same at once may both build it; one of the two is kept.
        """
        found, there = self._found(key)
        if there:
            result: Item = found
            return result
        result = build()
        self.put(key, result)
        return result

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._items.clear()
            self._bytes = 0

    def _found(self, key: Hashable) -> tuple[Any, bool]:
        """The result under a key, and whether there is one."""
        with self._lock:
            if key not in self._items:
                return None, False
            self._items.move_to_end(key)
            return self._items[key][0], True


CACHE = Cache(most_bytes=5 << 29)
