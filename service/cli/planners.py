"""The command ``compare-planners``: OMPL's planners side by side on one request."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planner.amounts import joules, seconds
from service import documents
from service.cli.terminal import Json, Verbose, interruptible, progress_bar, show, tell_written


def compare_planners(
    request: Annotated[
        Path, typer.Argument(metavar="REQUEST.json", help="The request; - reads it from stdin.")
    ],
    seconds_: Annotated[
        float, typer.Option("--seconds", min=0.01, max=600.0, help="Time limit of a sampler's run.")
    ] = 2.0,
    runs: Annotated[int, typer.Option(min=1, max=1000, help="Runs of each sampler.")] = 3,
    out: Annotated[
        Path | None, typer.Option(help="Write the comparison to this JSON file.")
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page with pictures here.")] = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Run least-energy and OMPL's samplers on one request, by OMPL's Benchmark.

    The energy is that of the best route along each planner's path.
    """
    from planner.search.ompl import compare_planners as compare
    from planner.search.requests import PlanRequest
    from service.cli.planning import request_from

    asked = request_from(request, PlanRequest)
    with interruptible() as cancelled, progress_bar() as progress:
        found = compare(asked, seconds=seconds_, runs=runs, progress=progress, cancelled=cancelled)
    document = found.to_json()
    if out is not None:
        documents.write_whole(out, documents.strict(document) + "\n")
    if report is not None:
        found.write_report(report)
    if json_:
        typer.echo(documents.strict(document))
        return
    show(as_table(document))
    tell_written(out, report)


VERBS: tuple[Callable[..., None], ...] = (compare_planners,)


def as_table(document: dict[str, Any]) -> RenderableType:
    """One row for each planner."""
    table = Table(header_style="bold")
    table.add_column("planner")
    for heading in ("runs", "with a route", "time", "energy", "over least-energy"):
        table.add_column(heading, justify="right")
    for row in document["planners"]:
        extra = row["extra_share"]
        table.add_row(
            row["planner"],
            str(row["runs"]),
            str(row["solved"]),
            seconds(row["seconds"]),
            "" if row["energy_j"] is None else joules(row["energy_j"]),
            "" if extra is None else f"{100 * extra:+.2f} %",
        )
    said = f"Medians, in the {document['space']} space; samplers had {document['seconds']:g} s."
    return Group(table, Text(said))
