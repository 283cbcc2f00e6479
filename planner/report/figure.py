"""One picture by itself: shows in a notebook, can be saved as a file that needs nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from planner.report.markup import asset, write


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
    def of(cls, name: str, drawing: str) -> Figure:
        """From a drawing of a page, with the styles that the page has for it."""
        opening, rest = drawing.split(">", 1)
        opening = opening.replace(
            '<svg class="', '<svg xmlns="http://www.w3.org/2000/svg" class="joulepath alone '
        )
        return cls(name, f"{opening}><style>{asset('charts.css')}</style>{rest}")

    def save(self, path: str | Path) -> None:
        """Write an SVG file."""
        write(self.svg + "\n", path)

    def _repr_svg_(self) -> str:
        return self.svg
