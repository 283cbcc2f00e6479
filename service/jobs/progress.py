"""How far a job is, from its worker to the service: a small file, replaced as a whole.

A worker that is killed leaves nothing half written, and the service reads whenever it likes.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

from service.documents import write_whole

_PAUSE_S = 0.1


def reporter(path: Path) -> Callable[[float, str], None]:
    """What a worker calls with the share done, 0 to 1, and a sentence.

    Reports that follow the last one within a tenth of a second are left out, but for the end.
    """
    last = -_PAUSE_S

    def report(share: float, sentence: str) -> None:
        nonlocal last
        moment = time.monotonic()
        if moment - last < _PAUSE_S and share < 1.0:
            return
        last = moment
        write_whole(path, json.dumps([float(share), str(sentence)]))

    return report


def read(path: Path) -> tuple[float, str] | None:
    """The last report, or None when there is none."""
    try:
        share, sentence = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return min(max(float(share), 0.0), 1.0), str(sentence)
