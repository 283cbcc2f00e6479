"""Runs the notebooks in docs/notebooks and writes their outputs into them.

    python -m docs.run_notebooks [NAME…]       # `make notebooks`; needs the extra `notebooks`

A notebook runs in an empty folder. Its outputs are checked: no error, and no more than
``MOST_BYTES``, so that a change of a notebook stays readable in the history.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

FOLDER = Path(__file__).resolve().parent / "notebooks"
MOST_BYTES = 400_000
"""Bytes of an executed notebook: some tables and one or two drawings."""


def run(path: Path) -> float:
    """Execute a notebook in place; returns its seconds.

    Raises:
        CellExecutionError: a cell failed.
        ValueError: its outputs are too large.
    """
    import nbformat
    from nbclient import NotebookClient

    book = nbformat.read(path, as_version=4)
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(book, timeout=900, resources={"metadata": {"path": folder}})
        client.execute()
    for cell in book.cells:
        # When and where it ran would change with every run.
        cell.metadata.clear()
    book.metadata.pop("language_info", None)
    text = nbformat.writes(book)
    if len(text.encode()) > MOST_BYTES:
        raise ValueError(f"{path.name} has {len(text.encode())} bytes, more than {MOST_BYTES}")
    path.write_text(text + "\n", "utf-8")
    return time.perf_counter() - begun


def main(names: list[str]) -> None:
    """Run all notebooks, or some by name."""
    for path in sorted(FOLDER.glob("*.ipynb")):
        if not names or path.stem in names:
            sys.stdout.write(f"{path.stem}: {run(path):.0f} s\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
