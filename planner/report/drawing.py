"""Drawings of a page as SVG elements: their frame, their words, several of them as one.

    chart(560, 200, text(4, 12, "held-out error"), "Errors")

``Figure.of`` makes a file of a drawing, with the style sheet that its classes refer to.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from planner.report.markup import Markup, plain

_GAP = 12


def chart(
    width: float,
    height: float,
    content: str,
    title: str,
    description: str = "",
    *,
    kind: str = "chart",
    placed: str = "",
) -> str:
    """A drawing as SVG, not drawn much larger than its numbers can be read.

    Args:
        width, height: in pixels.
        content: elements.
        title, description: for those who cannot see it; the title shows under the pointer too.
        kind: classes of the style sheet.
        placed: further attributes.
    """
    told = f"<desc>{plain(description)}</desc>" if description else ""
    return (
        f'<svg class="{kind}" viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'width="{1.2 * width:.0f}" {placed}>'
        f"<title>{plain(title)}</title>{told}{content}</svg>"
    )


def dot(colour: str) -> Markup:
    """A square of a colour for legends; without a style attribute, which strict policies forbid."""
    square = f"<rect width='1' height='1' fill='{colour}'/>"
    return Markup(f"<svg class='dot' viewBox='0 0 1 1' aria-hidden='true'>{square}</svg>")


def size_of(drawing: str) -> tuple[int, int]:
    """Width and height of a drawing, in pixels."""
    found = re.search(r'viewBox="0 0 (\d+) (\d+)"', drawing)
    assert found is not None  # as ``chart`` writes it
    return int(found[1]), int(found[2])


def beside(columns: Sequence[Sequence[str]], title: str) -> str:
    """Several drawings as one: columns from left to right, each from top to bottom."""
    parts, x, bottom = [], 0, 0
    for column in columns:
        y, wide = 0, 0
        for drawing in column:
            width, height = size_of(drawing)
            inner = drawing.split(">", 1)[1].removesuffix("</svg>")
            parts.append(f'<g transform="translate({x} {y})">{inner}</g>')
            y, wide = y + height + _GAP, max(wide, width)
        x, bottom = x + wide + _GAP, max(bottom, y)
    return chart(x - _GAP, bottom - _GAP, "".join(parts), title)


def text(x: float, y: float, words: str, kind: str = "", anchor: str = "start") -> str:
    """Words of a drawing."""
    of = f' class="{kind}"' if kind else ""
    turned = "" if anchor == "start" else f' text-anchor="{anchor}"'
    return f'<text x="{x:.1f}" y="{y:.1f}"{of}{turned}>{plain(words)}</text>'


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
