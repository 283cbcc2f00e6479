"""What a terminal shows of something that rich can render."""

from __future__ import annotations

from io import StringIO

from rich.console import Console, RenderableType


def written(shown: RenderableType) -> str:
    """Its text, 200 columns wide."""
    page = StringIO()
    Console(file=page, width=200).print(shown)
    return page.getvalue()
