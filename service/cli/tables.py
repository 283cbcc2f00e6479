"""The document of any command as tables for a terminal.

    console.print(as_tables("plan", answer.to_json()))

rich is loaded when tables are asked for: a program that reads JSON does not wait for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from service import documents
from service.cli.terminal import show

if TYPE_CHECKING:
    from rich.console import RenderableType


def as_tables(command: str, document: Mapping[str, Any]) -> RenderableType:
    """What a command shows to a person.

    Args:
        command: its name, such as "plan" or "diagnose".
        document: what it answers as JSON.

    Raises:
        KeyError: no command of that name has tables.
    """
    from service.cli import route_tables, workbench_tables

    if command == "plan":
        from planner.power.catalogue import all_effects

        titles = {slug: effect.title for slug, effect in all_effects().items()}
        return route_tables.report(document, titles)
    shown = {
        "graph": route_tables.graph,
        "matrix": route_tables.matrix,
        "reach": route_tables.reach,
        "front": route_tables.front,
        "compare-planners": route_tables.planners,
        "compare": workbench_tables.comparison,
        "diagnose": workbench_tables.diagnosis,
        "adopt": workbench_tables.adoption,
        "revert": workbench_tables.reversion,
        "history": workbench_tables.history,
        "bench": workbench_tables.timings,
    }
    return shown[command](document)


def tell(command: str, document: Mapping[str, Any], as_json: bool, *written: Path | None) -> None:
    """Print one JSON document, or tables; then the written files are listed on stderr."""
    if as_json:
        typer.echo(documents.strict(document))
        return
    show(as_tables(command, document))
    for path in filter(None, written):
        typer.echo(f"wrote {path}", err=True)
