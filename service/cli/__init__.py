"""The command line ``joulepath``; see service.cli.program."""

from service.cli.program import app, main, run
from service.cli.tables import as_tables
from service.cli.terminal import grid

__all__ = ["app", "as_tables", "grid", "main", "run"]
