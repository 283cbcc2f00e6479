"""Progress of a job, from its worker to the service: a small file, replaced as a whole.

A killed worker leaves no incomplete file, and the service may read at any time.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

from service.documents import write_whole

_WRITE_EVERY_S = 0.1
"""Least time between two reports that are written."""


def reporter(path: Path) -> Callable[[float, str], None]:
    """Callback of a worker for the finished share, 0 to 1, and a sentence.

    Reports within 0.1 s of the last one are skipped, except the final one.
    """
    last = -_WRITE_EVERY_S

    def report(share: float, sentence: str) -> None:
        nonlocal last
        moment = time.monotonic()
        if moment - last < _WRITE_EVERY_S and share < 1.0:
            return
        last = moment
        write_whole(path, json.dumps([float(share), str(sentence)]))

    return report


def read(path: Path) -> tuple[float, str] | None:
    """The last report, or None."""
    try:
        share, sentence = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return min(max(float(share), 0.0), 1.0), str(sentence)
