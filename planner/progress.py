"""How long work reports its progress.

    work(progress=lambda share, sentence: print(f"{share:.0%} {sentence}"))

Every ``progress`` of joulepath has this signature. ``CancellationToken.watched`` makes one that
stops the work when the caller cancels.
"""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float, str], None]
"""Called with the share done, 0 to 1, and a sentence."""


def silent(share: float, sentence: str) -> None:
    """Progress that nobody asked for."""
