"""The workbench on the command line: compare, diagnose, adopt, revert, history, bench.

    joulepath compare LOG --vehicle V | --model M.json
    joulepath diagnose LOG --vehicle V | --model M.json
    joulepath adopt EFFECT[,EFFECT] LOG --vehicle V | --model M.json --out M2.json
    joulepath revert M3.json --to VERSION --out M4.json
    joulepath history M.json
    joulepath bench

Each is a plain function; service.cli.program makes commands of them. Output and exit status are
as there.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

import planner
from service import documents
from service.cli.model_files import read_definition
from service.cli.tables import tell
from service.cli.terminal import Json, Report, Verbose, check_places, working
from service.compiling import compile_for_planning
from service.workbench import effects_to_adopt, starting_model

Log = Annotated[
    Path, typer.Argument(metavar="LOG", help="CSV (also gzipped), Parquet or rosbag2 recording.")
]
Vehicle = Annotated[
    str | None,
    typer.Option(help="Start from this vehicle's fitted base model; a name or TOML file."),
]
Model = Annotated[str | None, typer.Option(metavar="M.json", help="Start from this saved model.")]
Mapping = Annotated[
    Path | None, typer.Option(metavar="F.toml", help="Mapping of the log's columns to quantities.")
]
ModelFile = Annotated[Path, typer.Argument(metavar="M.json", help="A saved model.")]
Out = Annotated[Path, typer.Option(metavar="M.json", help="Write the new version to this file.")]


def _examining(verb: str, title: str, help_: str) -> Callable[..., None]:
    """A command that examines a log and changes nothing."""

    def examine(
        log: Log,
        vehicle: Vehicle = None,
        model: Model = None,
        mapping: Mapping = None,
        report: Report = None,
        json_: Json = False,
        verbose: Verbose = False,
    ) -> None:
        from planner.report.workbench_wording import proposed

        check_places(report)
        found = _found(verb, log, vehicle=vehicle, model=model, mapping=mapping)
        _write_report(found, report, f"{title} {log.name}")
        document = found.to_json()
        tell(verb, document, json_, report)
        if verb == "diagnose" and not json_:
            start = f"--model {model}" if model else f"--vehicle {vehicle}"
            if any(entry["settings"] for entry in document["experiments"]):
                typer.echo(
                    f"Drives as commands: joulepath diagnose {log} {start} --json > D.json, then "
                    "joulepath experiment D.json --out DRIVE.csv"
                )
            if proposed(document):
                typer.echo(f"Next: joulepath adopt diagnosed {log} {start} --out M2.json")

    examine.__name__ = verb
    examine.__doc__ = f"{help_}\n\nExample: joulepath {verb} drive.csv --vehicle minibalance"
    return examine


compare = _examining(
    "compare",
    "Comparison with",
    "Compare measured with predicted power: error, where it occurs, and share of noise.",
)
diagnose = _examining(
    "diagnose",
    "Diagnosis of",
    "Name the physical effects missing from a model, or say that they cannot be identified.",
)


def adopt(
    effect: Annotated[
        str,
        typer.Argument(
            metavar="EFFECT[,EFFECT]",
            help="Names of effects, or `diagnosed` for all that the diagnosis selects.",
        ),
    ],
    log: Log,
    out: Out,
    vehicle: Vehicle = None,
    model: Model = None,
    mapping: Mapping = None,
    formula: Annotated[
        Path | None, typer.Option(metavar="F.json", help="Custom effect in a JSON or TOML file.")
    ] = None,
    report: Report = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Add effects to the model, fit it to the log, and write it as a new version.

    Example: joulepath adopt diagnosed drive.csv --vehicle minibalance --out robot-2.json
    """
    check_places(out, report)
    definition = None if formula is None else read_definition(formula)
    effects = effects_to_adopt([name.strip() for name in effect.split(",")], definition)
    found = _found("adopt", effects, log, vehicle=vehicle, model=model, mapping=mapping)
    documents.write_whole(out, documents.model_text(found.model))
    _write_report(found, report, f"Adopted from {log.name}")
    tell("adopt", found.to_json(), json_, out, report)


def revert(
    model: ModelFile,
    to: Annotated[int, typer.Option(metavar="VERSION", help="The version to revert to.")],
    out: Out,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Revert a model to an earlier version; the result is a new version.

    Example: joulepath revert robot-2.json --to 1 --out robot-3.json
    """
    check_places(out)
    after = planner.revert(planner.PowerModel.load(model), to)
    documents.write_whole(out, documents.model_text(after))
    tell("revert", _with_history(after), json_, out)


def history(
    model: ModelFile, report: Report = None, json_: Json = False, verbose: Verbose = False
) -> None:
    """Show a model's history: adopted effects, their logs, and the change in error.

    Example: joulepath history robot-2.json
    """
    check_places(report)
    loaded = planner.PowerModel.load(model)
    document = _with_history(loaded)
    _write_report(loaded, report, f"History of {model.name}")
    tell("history", document, json_, report)


def _with_history(model: planner.PowerModel) -> dict[str, Any]:
    from planner.telemetry.adoption import history as versions_of

    return {"model": model.describe(), "history": versions_of(model)}


def bench(
    rows: Annotated[
        int, typer.Option(min=1_000, max=5_000_000, help="Length of the log to diagnose.")
    ] = 20_000,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Time the power model, a plan and a diagnosis on this machine.

    Example: joulepath bench --rows 20000
    """
    from service.cli.bench import measure

    with working() as how:
        document = measure(rows, **how)
    tell("bench", document, json_)


VERBS: tuple[Callable[..., None], ...] = (compare, diagnose, adopt, revert, history, bench)


def _found(
    verb: str, *given: Any, vehicle: str | None, model: str | None, mapping: Path | None
) -> Any:
    """Result of a function of the planner that starts from a vehicle or a saved model."""
    with working() as how:
        start = starting_model(vehicle, model, prefix="--")
        found = getattr(planner, verb)(*given, start, mapping=mapping, **how)
        if verb == "adopt":
            compile_for_planning(found.model, **how)
        return found


def _write_report(found: Any, report: Path | None, title: str) -> None:
    if report is not None:
        from planner.report import write_report

        write_report(found, report, title)
