"""Parts that commands share: options, interruptible work, a line of progress, tables, output."""

from __future__ import annotations

import signal
import sys
import tempfile
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.errors import RequestError

if TYPE_CHECKING:
    from rich.table import Table

Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON document to stdout and nothing else.")
]
Report = Annotated[
    Path | None, typer.Option(metavar="PAGE.html", help="Write a page with pictures to this file.")
]
Verbose = Annotated[
    bool, typer.Option("--verbose", help="Show the traceback of an unexpected error.")
]


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


def show(renderable: Any) -> None:
    """Print a table or a text of rich on stdout."""
    from rich.console import Console

    console = Console()
    # Into a file or a pipe a table must not be squeezed to a terminal's width.
    Console(width=None if console.is_terminal else 140).print(renderable)


@contextmanager
def working() -> Iterator[dict[str, Any]]:
    """Keyword arguments for long work: its progress is shown, and Ctrl-C cancels it.

    On a new machine everything is compiled first.
    """
    from service.compiling import compile_once, show_on_stderr

    compile_once(show_on_stderr)
    with interruptible() as cancelled, progress_bar() as progress:
        yield {"progress": progress, "cancelled": cancelled}


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Ctrl-C asks the work to stop; a second one stops at once."""
    asked: list[int] = []

    def ask(number: int, frame: Any) -> None:
        if asked:
            raise KeyboardInterrupt
        asked.append(number)

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: bool(asked)
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def progress_bar() -> Iterator[Callable[[float, str], None] | None]:
    """A line of progress on stderr when a person looks at it."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<24}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda share, what: bar.update(task, description=what, completed=share)


def check_places(*paths: Path | None) -> None:
    """Refuse now what could not be written after minutes of work.

    Raises:
        RequestError: a file that could not be written.
    """
    for path in paths:
        if path is None:
            continue
        folder = next(p for p in path.absolute().parents if p.exists())
        if path.is_dir() or not _can_be_written(folder):
            raise RequestError(
                str(path), "cannot be written", accepted="a file in a folder that can be written"
            )


def _can_be_written(folder: Path) -> bool:
    # Permissions alone do not tell: some file systems take no files from anybody.
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
