"""The commands that plan: ``plan``, ``graph``, ``matrix``, ``reach`` and ``front``.

    joulepath plan REQUEST.json
    joulepath plan --map DEM.tif --start 2,3 --goal 40,25
    joulepath graph warehouse nodes.geojson --out energies.geojson
    joulepath matrix | reach | front REQUEST.json

Each is a plain function; service.cli.program makes commands of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

import planner
from planner.errors import RequestError
from service import documents, formats
from service.cli.tables import tell
from service.cli.terminal import Json, Report, Verbose, check_places, working

if TYPE_CHECKING:
    from planner.search.requests import SituationRequest

Asked = TypeVar("Asked", bound="SituationRequest")

_STDIN = "The request; - reads it from stdin."
_POSE = "X,Y[,YAW]"
CERTIFY_S = 0.5
"""s for the lower bound where a request does not say: hardly noticed, and most of the gap."""
RequestFile = Annotated[Path, typer.Argument(metavar="REQUEST.json", help=_STDIN)]
Out = Annotated[Path | None, typer.Option(help="Write the answer to this JSON file.")]


def plan(
    request: Annotated[Path | None, typer.Argument(metavar="[REQUEST.json]", help=_STDIN)] = None,
    map_: Annotated[
        str | None, typer.Option("--map", help="Name of a map, or a file of heights.")
    ] = None,
    vehicle: Annotated[str | None, typer.Option(help="Name or TOML file of a vehicle.")] = None,
    model: Annotated[str | None, typer.Option(help="A saved model, instead of a vehicle.")] = None,
    start: Annotated[
        str | None, typer.Option(metavar=_POSE, help="Start pose in m and rad.")
    ] = None,
    goal: Annotated[str | None, typer.Option(metavar=_POSE, help="Goal pose in m and rad.")] = None,
    objective: Annotated[str | None, typer.Option(help="energy, time or length.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the random numbers.")] = None,
    time_budget: Annotated[float | None, typer.Option(help="Time to search, s.")] = None,
    iterations: Annotated[
        int | None, typer.Option(help="Iterations instead of a time: a reproducible answer.")
    ] = None,
    certify: Annotated[
        float | None,
        typer.Option(help="Time for a closer lower bound, s; 0.5, or none with --iterations."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the answer to this file.")] = None,
    format_: Annotated[
        str | None,
        typer.Option(
            "--format", help="json, geojson, csv or nav-path; else as --out ends, or json."
        ),
    ] = None,
    report: Report = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Plan the route of least energy; options override fields of the file.

    Example: joulepath plan --map warehouse --start 1.5,2 --goal 27,17 --report route.html
    """
    _check_format(format_, json_, out)
    check_places(out, report)
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
        "certify_s": certify,
    }
    asked = _plan_request(request, {k: v for k, v in given.items() if v is not None})
    # A bound that takes a time is not reproducible.
    if "certify_s" not in asked.model_fields_set and asked.iterations is None:
        asked = planner.PlanRequest.from_call(asked, {"certify_s": CERTIFY_S})
    with working() as how:
        answer = planner.plan_route(asked, **how)
    by_ending = formats.ENDINGS.get(out.suffix.lower(), "json") if out else "json"
    text = formats.written(answer, format_ or by_ending)
    if out is not None:
        documents.write_whole(out, text.rstrip("\n") + "\n")
    if report is not None:
        from planner.report import write_report

        write_report([answer], report, f"Route over {asked.map}")
    if format_ is not None and out is None:
        typer.echo(text.rstrip("\n"))
    else:
        document = documents.route_document(answer.to_json())
        tell("plan", document, json_, out, report)


def _check_format(name: str | None, as_json: bool, out: Path | None) -> None:
    """Refuse a format that there is not, or two formats for stdout, before planning."""
    if name is not None and name not in formats.FORMATS:
        accepted = ", ".join(formats.FORMATS)
        raise RequestError("--format", "is not a format of routes", value=name, accepted=accepted)
    if as_json and out is None and name not in (None, "json"):
        accepted = "one of both, or --out for the file"
        raise RequestError("--json", f"and --format {name} both write to stdout", accepted=accepted)


def graph(
    map_: Annotated[
        str, typer.Argument(metavar="MAP", help="Name of a map, or a file of heights.")
    ],
    nodes: Annotated[
        Path, typer.Argument(metavar="NODES.geojson", help="Places and edges, as for Nav2.")
    ],
    vehicle: Annotated[str | None, typer.Option(help="Name or TOML file of a vehicle.")] = None,
    model: Annotated[str | None, typer.Option(help="A saved model, instead of a vehicle.")] = None,
    corridor: Annotated[
        float | None,
        typer.Option(help="m from the edge within which its route runs; else anywhere."),
    ] = None,
    objective: Annotated[str, typer.Option(help="energy, time or length.")] = "energy",
    add_opposite: Annotated[
        bool, typer.Option("--add-opposite", help="Add the opposite of edges that have none.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Write the graph to this file; else to stdout.")
    ] = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Energy of every edge of a graph for Nav2's route server, in both directions.

    Example: joulepath graph warehouse nodes.geojson --corridor 1 --out energies.geojson
    """
    from planner.search.route_graph import GraphRequest, read_graph

    check_places(out)
    given = {
        "map": map_,
        "vehicle": vehicle,
        "model": model,
        "corridor_m": corridor,
        "objective": objective,
        "add_opposite": add_opposite,
        "graph": read_graph(nodes),
    }
    asked = GraphRequest.from_json({k: v for k, v in given.items() if v is not None})
    with working() as how:
        document = planner.energy_graph(asked, **how).to_json()
    write_document(document, out)
    if out is None and not json_:
        typer.echo(documents.strict(document))
        if closed := len(document["joulepath"]["closed"]):
            typer.echo(f"{closed} directions cannot be driven; see joulepath.closed", err=True)
    else:
        tell("graph", document, json_, out)


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
    asked = request_from(request, planner.PlanRequest)
    with working() as how:
        found = compare(asked, seconds=seconds_, runs=runs, **how)
    document = found.to_json()
    write_document(document, out)
    if report is not None:
        found.write_report(report)
    tell("compare-planners", document, json_, out, report)


def _command(name: str, function: str, kind: str, help_: str) -> Callable[..., None]:
    """A command that answers the request in a file by a function of the planner."""

    def ask(
        request: RequestFile, out: Out = None, json_: Json = False, verbose: Verbose = False
    ) -> None:
        from planner.search import requests

        check_places(out)
        asked = request_from(request, getattr(requests, kind))
        with working() as how:
            document = getattr(planner, function)(asked, **how).to_json()
        write_document(document, out)
        tell(name, document, json_, out)

    ask.__name__ = name
    ask.__doc__ = f"{help_}\n\nExample: joulepath {name} REQUEST.json --out answer.json"
    return ask


VERBS: tuple[Callable[..., None], ...] = (
    plan,
    graph,
    _command("matrix", "energy_matrix", "MatrixRequest", "Energies from each start to each goal."),
    _command("reach", "reachable_area", "ReachRequest", "Area within range of an energy."),
    _command("front", "energy_time_front", "FrontRequest", "Pareto front of duration and energy."),
    compare_planners,
)


def write_document(document: Mapping[str, Any], path: Path | None) -> None:
    """Write an answer as JSON, if a file is given."""
    if path is not None:
        documents.write_whole(path, documents.strict(document) + "\n")


def _plan_request(path: Path | None, given: dict[str, Any]) -> planner.PlanRequest:
    """The request from a file or stdin, overridden by the options."""
    if path is not None:
        return request_from(path, planner.PlanRequest, given)
    if given:
        return planner.PlanRequest.from_json(given)
    accepted = "REQUEST.json, or --map, --start and --goal"
    raise RequestError("request", "is missing", accepted=accepted)


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
            "is not a position",
            value=text,
            accepted="X,Y or X,Y,YAW in metres and rad, such as 2.5,3 or 2.5,3,1.57",
        )
    return dict(zip(("x", "y", "yaw"), values, strict=False))
