"""Results that show themselves: a card in a notebook, single figures, a page.

    class Comparison(Shown): ...

    comparison                                  # in a notebook
    comparison.figure("speed").save("speed.svg")
    comparison.write_report("comparison.html")
    comparison.to_frame()                       # a DataFrame of pandas

A result knows no renderer. The public face ``planner`` registers one, and any import of a
submodule passes through that face.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from planner.errors import MissingPackage

if TYPE_CHECKING:
    import pandas


class Picture(Protocol):
    """A picture as SVG: a notebook shows it, ``save`` writes it as a file."""

    @property
    def name(self) -> str:
        """Name within its result."""

    @property
    def svg(self) -> str:
        """The whole document."""

    def save(self, path: str | Path) -> None:
        """Write an SVG file; its folder is made."""


class Renderer(Protocol):
    """Draws every kind of result."""

    def figure(self, result: Any, name: str) -> Picture:
        """One picture of a result; raises RequestError where the result has none of this name."""

    def figure_names(self, result: Any) -> tuple[str, ...]:
        """Names of the pictures of a result."""

    def write_report(self, result: Any, path: str | Path, title: str = "") -> None:
        """Write a page about a result; an empty title is replaced by one that names the result."""

    def card(self, result: Any) -> str:
        """HTML for a notebook."""


_open: Callable[[], Renderer] | None = None


def register(opener: Callable[[], Renderer]) -> None:
    """Choose the renderer of all results.

    Args:
        opener: gives the renderer. It is called whenever a result is shown, not before.
    """
    global _open
    _open = opener


def _renderer() -> Renderer:
    if _open is None:
        raise RuntimeError("no renderer is registered; import planner registers one")
    return _open()


def frame(
    rows: Mapping[Any, Any] | Iterable[Mapping[str, Any]], columns: Sequence[str] = ()
) -> pandas.DataFrame:
    """A DataFrame of pandas, which is loaded here and nowhere else.

    Args:
        rows: columns by name, or one mapping for each row.
        columns: those of a table that may have no row; by default those of the rows.

    Raises:
        MissingPackage: pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise MissingPackage("pandas", "pandas") from None
    table = rows if isinstance(rows, Mapping) else list(rows)
    return pandas.DataFrame(table, columns=list(columns) or None)


class Shown:
    """A result that a renderer can draw."""

    def figure(self, name: str) -> Picture:
        """One picture of this result: ``figures`` names them.

        Raises:
            RequestError: there is no such picture of this result.
        """
        return _renderer().figure(self, name)

    def figures(self) -> tuple[str, ...]:
        """Names of the pictures that this result has."""
        return _renderer().figure_names(self)

    def write_report(self, path: str | Path, title: str = "") -> None:
        """Write a page with all pictures and tables that needs no network.

        Args:
            path: of the page; its folder is made.
            title: of the page; by default one that names the result.
        """
        _renderer().write_report(self, path, title)

    def _repr_html_(self) -> str:
        return _renderer().card(self)
