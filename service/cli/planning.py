"""The commands that plan: ``plan``, ``matrix``, ``reach`` and ``front``.

    joulepath plan REQUEST.json
    joulepath plan --map DEM.tif --start 2,3 --goal 40,25
    joulepath matrix | reach | front REQUEST.json

Each is a plain function; service.cli.program makes commands of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from planner.errors import RequestError
from planner.search.requests import SituationRequest
from service import documents
from service.cli.tables import as_tables
from service.cli.terminal import Json, Verbose, interruptible, progress_bar, show, tell_written

Asked = TypeVar("Asked", bound=SituationRequest)

RequestFile = Annotated[
    Path, typer.Argument(metavar="REQUEST.json", help="The request; - reads it from stdin.")
]
Out = Annotated[Path | None, typer.Option(help="Write the answer to this JSON file.")]


def plan(
    request: Annotated[
        Path | None,
        typer.Argument(metavar="[REQUEST.json]", help="The request; - reads it from stdin."),
    ] = None,
    map_: Annotated[
        str | None, typer.Option("--map", help="Name of a map, or a file of heights.")
    ] = None,
    vehicle: Annotated[str | None, typer.Option(help="Name of a vehicle, or its TOML.")] = None,
    model: Annotated[str | None, typer.Option(help="A saved model, instead of a vehicle.")] = None,
    start: Annotated[
        str | None, typer.Option(metavar="X,Y[,YAW]", help="Where the robot stands; m, rad.")
    ] = None,
    goal: Annotated[
        str | None, typer.Option(metavar="X,Y[,YAW]", help="Where it shall go; m, rad.")
    ] = None,
    objective: Annotated[str | None, typer.Option(help="energy, time or length.")] = None,
    seed: Annotated[int | None, typer.Option(help="Of the random numbers.")] = None,
    time_budget: Annotated[float | None, typer.Option(help="Seconds to search.")] = None,
    iterations: Annotated[
        int | None, typer.Option(help="Iterations to search instead: a reproducible answer.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the answer to this ROUTE.json.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page with pictures here.")] = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Plan the route that costs the least energy; options override the file's fields."""
    given = {
        "map": map_,
        "vehicle": vehicle,
        "model": model,
        "start": _pose("--start", start),
        "goal": _pose("--goal", goal),
        "objective": objective,
        "seed": seed,
        "time_budget_s": time_budget,
        "iterations": iterations,
    }
    asked = _read_request(request, {k: v for k, v in given.items() if v is not None})
    with interruptible() as cancelled, progress_bar() as progress:
        from planner import plan_route

        answer = plan_route(asked, progress=progress, cancelled=cancelled)
    document = answer.to_json()
    if out is not None:
        documents.write_whole(out, documents.route_text(document) + "\n")
    if report is not None:
        from planner.report import write_report

        write_report([answer], report, f"Route over {asked.map}")
    if json_:
        typer.echo(documents.route_text(document))
        return
    show(as_tables("plan", document))
    tell_written(out, report)


def matrix(
    request: RequestFile, out: Out = None, json_: Json = False, verbose: Verbose = False
) -> None:
    """Energies from each of some places to each of others."""
    from planner import energy_matrix
    from planner.search.requests import MatrixRequest

    asked = request_from(request, MatrixRequest)
    with interruptible() as cancelled, progress_bar() as progress:
        found = energy_matrix(asked, progress=progress, cancelled=cancelled)
    _tell(found.to_json(), out, json_, "matrix")


def reach(
    request: RequestFile, out: Out = None, json_: Json = False, verbose: Verbose = False
) -> None:
    """How far an energy takes the robot, there or there and back."""
    from planner import reachable_area
    from planner.search.requests import ReachRequest

    asked = request_from(request, ReachRequest)
    with interruptible() as cancelled, progress_bar() as progress:
        found = reachable_area(asked, progress=progress, cancelled=cancelled)
    _tell(found.to_json(), out, json_, "reach")


def front(
    request: RequestFile, out: Out = None, json_: Json = False, verbose: Verbose = False
) -> None:
    """What a second costs: routes from the fastest to that of least energy."""
    from planner import energy_time_front
    from planner.search.requests import FrontRequest

    asked = request_from(request, FrontRequest)
    with interruptible() as cancelled, progress_bar() as progress:
        found = energy_time_front(asked, progress=progress, cancelled=cancelled)
    _tell(found.to_json(), out, json_, "front")


VERBS: tuple[Callable[..., None], ...] = (plan, matrix, reach, front)


def _tell(document: dict[str, Any], out: Path | None, as_json: bool, command: str) -> None:
    if out is not None:
        documents.write_whole(out, documents.strict(document) + "\n")
    if as_json:
        typer.echo(documents.strict(document))
        return
    show(as_tables(command, document))
    tell_written(out, None)


def _read_request(path: Path | None, given: dict[str, Any]) -> Any:
    """The request out of a file or stdin, with the options laid over it."""
    from planner.search.requests import PlanRequest

    if path is None:
        if not given:
            raise RequestError(
                "request", "is missing", accepted="REQUEST.json, or --map, --start and --goal"
            )
        return PlanRequest.from_json(given)
    return request_from(path, PlanRequest, given)


def request_from(
    path: Path, kind: type[Asked], overrides: Mapping[str, Any] | None = None
) -> Asked:
    """A request out of a file, or from stdin where the path is ``-``.

    Raises:
        RequestError: the file cannot be read, or the first field that cannot be used.
    """
    if str(path) == "-":
        return kind.from_text(typer.get_binary_stream("stdin").read(), overrides)
    return kind.from_file(path, overrides)


def _pose(option: str, text: str | None) -> dict[str, float] | None:
    """``X,Y`` or ``X,Y,YAW`` as a request's pose."""
    if text is None:
        return None
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in (2, 3):
        raise RequestError(
            option,
            "is no position",
            value=text,
            accepted="X,Y or X,Y,YAW in metres and rad, such as 2.5,3 or 2.5,3,1.57",
        )
    return dict(zip(("x", "y", "yaw"), values, strict=False))
