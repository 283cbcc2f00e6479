"""How a caller stops long work, while compiled code runs as well.

with Stop(cancelled) as stop:               # a thread looks out for the caller's wish
    cost_to_go(field, lattice, goal, stop=stop.flag)
    stop.check()                            # raises Cancelled
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

import numpy as np
from numpy.typing import NDArray

from planner.errors import Cancelled

WATCHED = 0.02
"""s between two looks at whether the caller has cancelled."""


class Stop:
    """The caller's wish to stop.

    Attributes:
        flag: (1,) True once the caller has cancelled; compiled searches look at it.
    """

    def __init__(self, cancelled: Callable[[], bool] | None = None) -> None:
        self.flag: NDArray[np.bool_] = np.zeros(1, np.bool_)
        self._cancelled = cancelled
        self._done = Event()
        self._watcher: Thread | None = None

    def __enter__(self) -> Stop:
        if self._cancelled is not None:
            self._watcher = Thread(target=self._watch, daemon=True)
            self._watcher.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self._done.set()
        if self._watcher is not None:
            self._watcher.join()

    def _watch(self) -> None:
        while not self._done.wait(WATCHED):
            if self.asked():
                return

    def asked(self) -> bool:
        """Whether the caller has cancelled."""
        if self._cancelled is not None and not self.flag[0] and self._cancelled():
            self.flag[0] = True
        return bool(self.flag[0])

    def check(self) -> None:
        """Stop if the caller wants to.

        Raises:
            Cancelled: the caller wants to.
        """
        if self.asked():
            raise Cancelled("cancelled by the caller")
