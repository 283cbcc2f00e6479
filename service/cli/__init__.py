"""The command line ``joulepath``; see service.cli.program."""

from service.cli.grids import grid
from service.cli.program import app, main, run
from service.cli.tables import as_tables

__all__ = ["app", "as_tables", "grid", "main", "run"]
