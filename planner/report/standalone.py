"""One picture by itself: shows in a notebook, can be saved as a file that needs nothing else."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from planner.report.drawing import rectangle, size_of, text
from planner.report.markup import asset, element, write

_MARGIN, _LINE = 12, 17
"""Pixels around a picture, and from one line of its heading to the next."""


@dataclass(frozen=True)
class Figure:
    """A picture as SVG, light or dark as its reader's screen is.

    Attributes:
        name: which picture.
        svg: the whole document.
    """

    name: str
    svg: str

    @classmethod
    def of(cls, name: str, drawing: str, legend: Mapping[str, str]) -> Figure:
        """From a drawing of a page, with the styles and the legend that the page has for it.

        Args:
            name: of the picture.
            drawing: an SVG element as planner.report.drawing.chart makes it.
            legend: class of the style sheet → what it stands for.
        """
        opening, rest = drawing.split(">", 1)
        kinds = re.search(r'class="([^"]+)"', opening)
        assert kinds is not None  # as ``chart`` writes it
        others = re.sub(r'(class|viewBox|width|role)="[^"]*"', "", opening.removeprefix("<svg"))
        above = _LINE * len(legend)
        width, height = size_of(drawing)
        width, height = width + 2 * _MARGIN, height + 2 * _MARGIN + above
        shown = [element("style", asset("charts.css"))]
        for k, (kind, words) in enumerate(legend.items()):
            y, fill = _LINE * k - above, "area" if kind == "measured" else "solid"
            shown.append(rectangle(0, y - 3, 22, 9, f"{kind} {fill}", rx=2))
            shown.append(text(30, y + 6, words, "ink"))
        return cls(
            name,
            '<svg xmlns="http://www.w3.org/2000/svg" role="img" '
            f'class="joulepath alone {kinds[1]}" width="{width}" height="{height}" '
            f'viewBox="{-_MARGIN} {-_MARGIN - above} {width} {height}" {others.strip()}>'
            + rest.replace("</title>", f"</title>{''.join(shown)}", 1),
        )

    def save(self, path: str | Path) -> None:
        """Write an SVG file."""
        write(self.svg + "\n", path)

    def _repr_svg_(self) -> str:
        return self.svg
