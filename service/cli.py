"""The command line: every verb of joulepath, for people and for programs.

    joulepath plan REQUEST.json            joulepath maps | vehicles | effects
    joulepath plan --map DEM.tif --start 2,3 --goal 40,25
    joulepath matrix | reach | front REQUEST.json see service.cli_areas
    joulepath compare | diagnose | adopt … LOG    see service.cli_telemetry
    joulepath serve

``--json`` puts exactly one JSON document on stdout; everything else goes to stderr. Exit status: 0
done (a well-formed question whose answer is "no route" is done), 2 input that cannot be used, with
one sentence that says what would be, 1 anything else.

Heavy packages are imported inside the commands, so that listing maps does not wait for a compiler.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from planner.errors import Cancelled, InputError, RequestError
from service import cli_areas, cli_telemetry
from service.terminal import Json, Verbose, interruptible, progress_bar, show, tell_written

app = typer.Typer(
    name="joulepath",
    help="Lowest-energy routes on real terrain, with the energy accounted for by physical effect.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

VERBOSE = "--verbose"
# Typer turns an interrupt into this exit status.
_INTERRUPTED = 130


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"joulepath {version('joulepath')}")
        raise typer.Exit


@app.callback()
def _common(
    _: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


@app.command()
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
    from service import documents

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
    from planner.power.catalogue import all_effects
    from service import tables

    tables_ = tables.report(document, {slug: e.title for slug, e in all_effects().items()})
    show(tables_)
    tell_written(out, report)


@app.command()
def maps(json_: Json = False, verbose: Verbose = False) -> None:
    """List the maps of the catalogue."""
    from planner.terrain.catalogue import list_maps

    columns = {"name": "name", "title": "what", "size": "size (m)", "cell": "cell (m)"}
    _list(list_maps(), columns, "Maps", json_)


@app.command()
def vehicles(json_: Json = False, verbose: Verbose = False) -> None:
    """List the vehicles."""
    from planner.power.vehicle import list_vehicles

    columns = {"name": "name", "title": "what", "mass_kg": "kg", "wheels": "wheels"}
    _list(list_vehicles(), columns, "Vehicles", json_)


@app.command()
def effects(json_: Json = False, verbose: Verbose = False) -> None:
    """List the physical effects that a power model can hold."""
    from planner.power.catalogue import list_effects

    columns = {"name": "name", "title": "what", "stages": "acts on", "base": "in every model"}
    _list(list_effects(), columns, "Effects", json_)


@app.command()
def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on.")] = None,
    verbose: Verbose = False,
) -> None:
    """Serve HTTP and the page."""
    from service.serving import serve as run

    run(host=host, port=port)


for verb in (*cli_areas.VERBS, *cli_telemetry.VERBS):
    app.command()(verb)


def _list(
    entries: Sequence[dict[str, Any]], columns: dict[str, str], title: str, as_json: bool
) -> None:
    from service import documents, tables

    plain = documents.finite(list(entries))
    if as_json:
        typer.echo(documents.strict(plain))
    else:
        show(tables.catalogue(plain, columns, title))


def _read_request(path: Path | None, given: dict[str, Any]) -> Any:
    """The request out of a file or stdin, with the options laid over it."""
    from planner.search.request import PlanRequest

    if path is None:
        if not given:
            raise RequestError(
                "request", "is missing", accepted="REQUEST.json, or --map, --start and --goal"
            )
        return PlanRequest.from_json(given)
    return cli_areas.read_request(path, PlanRequest, given)


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


def run(arguments: Sequence[str]) -> int:
    """Carry out a command line.

    Returns:
        the exit status; every failure was said on stderr.
    """
    try:
        status = app(list(arguments), prog_name="joulepath", standalone_mode=False)
        if status == _INTERRUPTED:
            raise KeyboardInterrupt
        return status if isinstance(status, int) else 0
    except typer.TyperException as error:
        # A bare `joulepath` raises this with the help text that was already shown.
        if message := error.format_message():
            _say(message.rstrip(".") + "; see joulepath --help")
        return 2
    except InputError as error:
        _say(str(error))
        return 2
    except (Cancelled, KeyboardInterrupt, typer.Abort):
        _say("cancelled; nothing was written")
        return 1
    except BrokenPipeError:
        # The reader, such as `head`, has enough. Python would complain again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if VERBOSE in arguments:
            raise
        what = f"{type(error).__name__}: {error}".splitlines()[0]
        _say(f"unexpected failure: {what} (run again with {VERBOSE} to see where)")
        return 1


def _say(sentence: str) -> None:
    print(f"joulepath: {sentence}", file=sys.stderr)  # noqa: T201


def main() -> None:
    """Entry point of the ``joulepath`` command."""
    status = 1
    try:
        status = run(sys.argv[1:])
    except Exception:
        import traceback

        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    if "ompl" in sys.modules:
        # OMPL's bindings list objects that they leak on stderr when the interpreter shuts down.
        os._exit(status)
    sys.exit(status)
