"""Drawings of a page as SVG elements: their frame, their words, several of them as one.

    chart(560, 200, text(4, 12, "held-out error"), "Errors")

``Figure.of`` makes a file of a drawing, with the style sheet that its classes refer to.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from planner.report.markup import Markup, element

_GAP = 12
"""Pixels between drawings that stand side by side."""


def chart(
    width: float,
    height: float,
    content: str,
    title: str,
    description: str = "",
    *,
    kind: str = "chart",
    **placed: Any,
) -> Markup:
    """A drawing as SVG, not drawn much larger than its numbers can be read.

    Args:
        width, height: in pixels.
        content: elements.
        title, description: for those who cannot see it; the title shows under the pointer too.
        kind: classes of the style sheet.
        placed: further attributes of the element.
    """
    return element(
        "svg",
        element("title", title),
        element("desc", description) if description else "",
        Markup(content),
        kind=kind,
        viewBox=f"0 0 {width:.0f} {height:.0f}",
        role="img",
        width=f"{1.2 * width:.0f}",
        **placed,
    )


def size_of(drawing: str) -> tuple[int, int]:
    """Width and height of a drawing, in pixels."""
    found = re.search(r'viewBox="0 0 (\d+) (\d+)"', drawing)
    assert found is not None  # as ``chart`` writes it
    return int(found[1]), int(found[2])


def beside(columns: Sequence[Sequence[str]], title: str) -> Markup:
    """Several drawings as one: columns from left to right, each from top to bottom."""
    parts, x, bottom = [], 0, 0
    for column in columns:
        y, wide = 0, 0
        for drawing in column:
            width, height = size_of(drawing)
            inner = Markup(drawing.split(">", 1)[1].removesuffix("</svg>"))
            parts.append(element("g", inner, transform=f"translate({x} {y})"))
            y, wide = y + height + _GAP, max(wide, width)
        x, bottom = x + wide + _GAP, max(bottom, y)
    return chart(x - _GAP, bottom - _GAP, "".join(parts), title)


def text(
    x: float, y: float, words: str, kind: str = "", anchor: str = "", **further: Any
) -> Markup:
    """Words of a drawing; they begin at x, or are anchored there by their "middle" or "end"."""
    return element("text", words, x=x, y=y, kind=kind, text_anchor=anchor, **further)


def line(x0: float, y0: float, x1: float, y1: float, kind: str) -> Markup:
    """A straight line between two places."""
    return element("line", x1=x0, x2=x1, y1=y0, y2=y1, kind=kind)


def rectangle(
    x: float, y: float, width: float, height: float, kind: str = "", **further: Any
) -> Markup:
    """A rectangle by its upper left corner."""
    return element("rect", x=x, y=y, width=width, height=height, kind=kind, **further)


def circle(x: float, y: float, radius: float, kind: str = "", **further: Any) -> Markup:
    """A circle around a place."""
    return element("circle", cx=x, cy=y, r=radius, kind=kind, **further)


def short(words: str, most: int) -> str:
    """Words cut off at a number of letters."""
    return words if len(words) <= most else words[: most - 1].rstrip() + "…"


def shortened(words: str, room: float, size: float = 11.0) -> str:
    """Words cut off where the room, in pixels, ends."""
    kept = words
    while kept and width_of(kept if kept == words else kept + "…", size) > room:
        kept = kept[:-1]
    return words if kept == words else f"{kept.rstrip()}…"


def width_of(words: str, size: float = 11.0) -> float:
    """Pixels of words in a drawing, rather too many: those of DejaVu Sans, the widest font."""
    narrow = sum(letter in " .,:;'|ijl-−" for letter in words)
    broad = sum(letter in "+%mwMW…" for letter in words)
    return size * (0.38 * narrow + 0.64 * (len(words) - narrow - broad) + 1.0 * broad)
