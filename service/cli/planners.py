"""The command ``compare-planners``: OMPL's planners side by side on one request."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from planner.search.requests import PlanRequest
from service.cli.planning import Out, RequestFile, request_from, write_document
from service.cli.tables import tell
from service.cli.terminal import Json, Report, Verbose, check_places, working


def compare_planners(
    request: RequestFile,
    seconds_: Annotated[
        float, typer.Option("--seconds", min=0.01, max=600.0, help="Time limit of a sampler's run.")
    ] = 2.0,
    runs: Annotated[int, typer.Option(min=1, max=1000, help="Runs of each sampler.")] = 3,
    out: Out = None,
    report: Report = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Compare least-energy with OMPL's samplers on one request, using OMPL's Benchmark.

    Energies are those of the best route along each planner's path.

    Example: joulepath compare-planners REQUEST.json --seconds 5
    """
    from planner.search.ompl import compare_planners as compare

    check_places(out, report)
    asked = request_from(request, PlanRequest)
    with working() as how:
        found = compare(asked, seconds=seconds_, runs=runs, **how)
    document = found.to_json()
    write_document(document, out)
    if report is not None:
        found.write_report(report)
    tell("compare-planners", document, json_, out, report)


VERBS: tuple[Callable[..., None], ...] = (compare_planners,)
