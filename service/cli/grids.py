"""Tables for a terminal; rich is loaded when one is made.

console.print(grid(("run", "energy"), [("a", "12 J")]))
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


def grid(
    headings: Sequence[str],
    rows: Iterable[Sequence[str]] = (),
    *,
    left: Collection[int] = (0,),
    title: str | None = None,
) -> Table:
    """A table of text.

    Args:
        headings: one per column.
        rows: cells, one per column.
        left: numbers of the left-justified columns; all others are right-justified.
        title: above the table.
    """
    from rich.table import Table

    table = Table(title=title, title_justify="left", header_style="bold")
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="left" if number in left else "right")
    for row in rows:
        table.add_row(*row)
    return table
