"""How a caller stops long work, compiled code included.

    token = CancellationToken(cancelled)        # once, where the work enters
    token.check()                               # raises Cancelled
    watch = token.watched(progress)             # checks, then reports

    with token:                                 # a thread asks the caller meanwhile
        cost_to_go(field, lattice, goal, stop=token.flag)

Only compiled code needs the ``with``: it reads the flag and cannot ask.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

import numpy as np
from numpy.typing import NDArray

from planner.errors import Cancelled
from planner.progress import Progress, silent

POLL_SECONDS = 0.02
"""s between two questions of the thread whether the caller has cancelled."""


class CancellationToken:
    """The caller's wish to stop; once it is heard, it stays.

    Args:
        cancelled: asked often; True once the caller wants to stop. None never stops.

    Attributes:
        flag: (1,) True once the caller has cancelled; compiled searches look at it.
    """

    def __init__(self, cancelled: Callable[[], bool] | None = None) -> None:
        self.flag: NDArray[np.bool_] = np.zeros(1, np.bool_)
        self._ask = cancelled
        self._done = Event()
        self._watcher: Thread | None = None

    def __enter__(self) -> CancellationToken:
        if self._ask is not None:
            self._watcher = Thread(target=self._watch, daemon=True)
            self._watcher.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self._done.set()
        if self._watcher is not None:
            self._watcher.join()

    def _watch(self) -> None:
        while not self._done.wait(POLL_SECONDS):
            if self.cancelled():
                return

    def cancelled(self) -> bool:
        """Whether the caller has cancelled."""
        if self._ask is not None and not self.flag[0] and self._ask():
            self.flag[0] = True
        return bool(self.flag[0])

    def check(self) -> None:
        """Stop if the caller wants to.

        Raises:
            Cancelled: the caller wants to.
        """
        if self.cancelled():
            raise Cancelled("cancelled by the caller")

    def watched(self, progress: Progress | None = None) -> Progress:
        """Progress that raises Cancelled, before it reports, once the caller has cancelled."""
        report = progress or silent

        def watch(share: float, sentence: str) -> None:
            self.check()
            report(share, sentence)

        return watch
