"""The command line ``joulepath``; see service.cli.program."""

from service.cli.program import app, main, run
from service.cli.tables import as_tables

__all__ = ["app", "as_tables", "main", "run"]
