"""The other core, while compiled code lets a second thread run.

    core = OtherCore()
    later = core.submit(search, run, "length")       # begins when the other core is free
    first, second = core.all([task, other_task])     # both, on whichever core is free
    answer = core.result(later)                      # worked out here if it has not begun
    first, second = CORE.all(halves)                 # the same where no request has its own

Who waits does not wait idly: a task that has not begun is taken back and done at once. So tasks may
ask for tasks, and one thread is enough.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Later(Generic[T]):
    """A task that was handed over."""

    task: Callable[[], T]
    future: Future[T]


class OtherCore:
    """One thread beside the caller's."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(max_workers=1)

    def submit(self, task: Callable[[], T]) -> Later[T]:
        """Hand a task over."""
        return Later(task, self._pool.submit(task))

    def result(self, later: Later[T]) -> T:
        """What a task came to; raises what it raised."""
        return later.task() if later.future.cancel() else later.future.result()

    def all(self, tasks: Sequence[Callable[[], T]]) -> list[T]:
        """What all of these tasks come to, in their order."""
        handed = [self.submit(task) for task in tasks[1:]]
        first = [task() for task in tasks[:1]]
        # From the last one: the thread has begun with the first.
        return first + [self.result(later) for later in reversed(handed)][::-1]


CORE = OtherCore()
"""The process's own, for loops that are cut in two."""


def in_halves(count: int, fill: Callable[[int, int], None]) -> None:
    """Call ``fill(first, last)`` for both halves of ``range(count)``, one on each core."""
    CORE.all([partial(fill, 0, count // 2), partial(fill, count // 2, count)])
