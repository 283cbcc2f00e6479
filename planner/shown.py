"""Results that show themselves: a card in a notebook, single figures, a page.

    class Comparison(Shown): ...

    comparison                                  # in a notebook
    comparison.figure("speed").save("speed.svg")
    comparison.write_report("comparison.html")

Pictures are drawn by planner.report, which knows all results and which no result knows: it is
looked up when a picture is asked for.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.report.figure import Figure


class Shown:
    """A result of the workbench, or a model, that planner.report can draw."""

    def figure(self, name: str) -> Figure:
        """One picture of the page: see ``figures`` for what there is.

        Raises:
            RequestError: there is no such picture of this result.
        """
        found: Figure = _report().figure(self, name)
        return found

    def figures(self) -> tuple[str, ...]:
        """Names of the pictures that this result has."""
        names: tuple[str, ...] = _report().figure_names(self)
        return names

    def write_report(self, path: str | Path, title: str = "") -> None:
        """Write a page with all pictures and tables that needs no network."""
        _report().write_telemetry_report(self, path, title)

    def _repr_html_(self) -> str:
        card: str = _report().fragment(self)
        return card


def _report() -> Any:
    return import_module("planner.report")
