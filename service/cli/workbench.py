"""The workbench on the command line: where the model fails, what is missing, and what comes of it.

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

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from planner.errors import RequestError
from service import documents
from service.cli.model_files import read_definition, save_model
from service.cli.tables import as_tables
from service.cli.terminal import Json, Verbose, interruptible, progress_bar, show, tell_written
from service.workbench import effects_to_adopt, starting_model

Log = Annotated[
    Path, typer.Argument(metavar="LOG", help="CSV (also gzipped), Parquet or rosbag2 recording.")
]
Vehicle = Annotated[
    str | None,
    typer.Option(help="Start from this vehicle's base model, fitted; a name or a TOML file."),
]
Model = Annotated[str | None, typer.Option(metavar="M.json", help="Start from this saved model.")]
Mapping = Annotated[
    Path | None,
    typer.Option(metavar="F.toml", help="Says which columns of the log are which quantities."),
]
Report = Annotated[
    Path | None, typer.Option(metavar="PAGE.html", help="Write a page with pictures here.")
]
ModelFile = Annotated[Path, typer.Argument(metavar="M.json", help="A saved model.")]
Out = Annotated[Path, typer.Option(metavar="M.json", help="Write the new version of the model.")]


def compare(
    log: Log,
    vehicle: Vehicle = None,
    model: Model = None,
    mapping: Mapping = None,
    report: Report = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Compare measured power with a model's: how far apart, where, and how much is noise."""
    _check_places(report)
    with _working() as (start, how):
        from planner import compare as compare_log

        found = compare_log(log, start(vehicle, model), mapping=mapping, **how)
    _give(found, json_, report, f"Comparison with {log.name}", "compare")


def diagnose(
    log: Log,
    vehicle: Vehicle = None,
    model: Model = None,
    mapping: Mapping = None,
    report: Report = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Name the physical effects that a model lacks, or say honestly that it cannot be told."""
    from planner.report.workbench_wording import proposed

    _check_places(report)
    with _working() as (start, how):
        from planner import diagnose as diagnose_log

        found = diagnose_log(log, start(vehicle, model), mapping=mapping, **how)
    _give(found, json_, report, f"Diagnosis of {log.name}", "diagnose")
    if not json_ and proposed(found.to_json()):
        start_with = f"--model {model}" if model else f"--vehicle {vehicle}"
        typer.echo(f"Next: joulepath adopt diagnosed {log} {start_with} --out M2.json")


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
        Path | None,
        typer.Option(metavar="F.json", help="A custom effect's definition, JSON or TOML."),
    ] = None,
    report: Report = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Take effects into the model, fit it to the log, and write it as a new version."""
    _check_places(out, report)
    definition = None if formula is None else read_definition(formula)
    named = [name.strip() for name in effect.split(",")]
    with _working() as (start, how):
        from planner import adopt as adopt_effects

        model_before = start(vehicle, model)
        effects = effects_to_adopt(named, definition)
        found = adopt_effects(effects, log, model_before, mapping=mapping, **how)
    save_model(found.model, out)
    _give(found, json_, report, f"Adopted from {log.name}", "adopt", out)


def revert(
    model: ModelFile,
    to: Annotated[int, typer.Option(metavar="VERSION", help="The version to go back to.")],
    out: Out,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Go back to an earlier version of a model; that is a new version too."""
    _check_places(out)
    before = _load(model)
    from planner import revert as revert_model
    from planner.telemetry.adoption import history as versions_of

    after = revert_model(before, to)
    save_model(after, out)
    document = {"model": after.describe(), "history": versions_of(after)}
    _print(document, json_, "revert")
    if not json_:
        tell_written(out)


def history(
    model: ModelFile, report: Report = None, json_: Json = False, verbose: Verbose = False
) -> None:
    """Show how a model came about: what was adopted, from which log, and what it was worth."""
    _check_places(report)
    loaded = _load(model)
    from planner.telemetry.adoption import history as versions_of

    document = {"model": loaded.describe(), "history": versions_of(loaded)}
    _write_report(loaded, report, f"History of {model.name}")
    _print(document, json_, "history")
    if not json_:
        tell_written(report)


def bench(
    rows: Annotated[
        int, typer.Option(min=1_000, max=5_000_000, help="Length of the log to diagnose.")
    ] = 20_000,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Time the power model, a plan and a diagnosis on this machine."""
    with interruptible() as cancelled, progress_bar() as progress:
        from service.cli.bench import measure

        document = measure(rows, progress=progress, cancelled=cancelled)
    _print(document, json_, "bench")


VERBS: tuple[Callable[..., None], ...] = (compare, diagnose, adopt, revert, history, bench)


@contextmanager
def _working() -> Iterator[tuple[Callable[[str | None, str | None], Any], dict[str, Any]]]:
    """What a long verb needs: how to load the model to start from, and progress and cancel."""

    def start(vehicle: str | None, model: str | None) -> Any:
        return starting_model(vehicle, model, prefix="--")

    with interruptible() as cancelled, progress_bar() as progress:
        yield start, {"progress": progress, "cancelled": cancelled}


def _give(
    found: Any,
    as_json: bool,
    report: Path | None,
    title: str,
    command: str,
    *written: Path,
) -> None:
    """Answer with a result of the workbench: page first, then document or tables."""
    _write_report(found, report, title)
    _print(found.to_json(), as_json, command)
    if not as_json:
        tell_written(*written, report)


def _print(document: Any, as_json: bool, command: str) -> None:
    if as_json:
        typer.echo(documents.strict(document))
    else:
        show(as_tables(command, document))


def _write_report(found: Any, report: Path | None, title: str) -> None:
    if report is not None:
        from planner.report import write_report

        write_report(found, report, title)


def _load(path: Path) -> Any:
    from planner.power.model import PowerModel

    return PowerModel.load(path)


def _check_places(*paths: Path | None) -> None:
    """Refuse now what could not be written after minutes of work."""
    for path in paths:
        if path is None:
            continue
        folder = next(p for p in path.absolute().parents if p.exists())
        if path.is_dir() or not folder.is_dir() or not os.access(folder, os.W_OK):
            raise RequestError(
                str(path), "cannot be written", accepted="a file in a folder that can be written"
            )
