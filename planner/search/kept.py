"""What was worked out once and is asked for again, within a budget of memory.

    kept = Kept(most_bytes=1 << 30)
    lattice = kept.get(("lattice", key), lambda: build_lattice(field))

What was not asked for longest goes first. A process has one of its own, ``KEPT``; threads share it.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, Protocol, TypeVar


class Sized(Protocol):
    """Anything that knows how much memory it takes."""

    @property
    def nbytes(self) -> int:
        """Bytes."""


Item = TypeVar("Item", bound=Sized)


class Kept:
    """A memory of results, the least recently used ones dropped first.

    Args:
        most_bytes: what all of them together may take; a larger one is not kept at all.
    """

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes = most_bytes
        self._lock = Lock()
        self._items: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._bytes = 0

    @property
    def nbytes(self) -> int:
        """What is kept takes."""
        return self._bytes

    def find(self, key: Hashable) -> Any | None:
        """What is kept under a key, or None."""
        with self._lock:
            if key not in self._items:
                return None
            self._items.move_to_end(key)
            return self._items[key][0]

    def put(self, key: Hashable, item: Sized) -> None:
        """Keep this, in place of what was there."""
        # Some results grow while they are used; their size is taken as it is now.
        size = item.nbytes
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
        """What is kept under a key, or else what ``build`` makes of it now.

        Two threads that ask for the same at once may both build it; one of the two is kept.
        """
        found: Item | None = self.find(key)
        if found is None:
            found = build()
            self.put(key, found)
        return found

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._items.clear()
            self._bytes = 0


KEPT = Kept(most_bytes=5 << 29)
