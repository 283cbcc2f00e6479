"""``joulepath logs join FILE…``: several files of one drive as one log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from planner.errors import RequestError
from planner.reading import finite_number
from service import documents
from service.cli.terminal import Json, Verbose, check_places


def logs(
    what: Annotated[str, typer.Argument(metavar="join", help="What to do: join.")],
    files: Annotated[list[str], typer.Argument(metavar="FILE…", help="Logs of one drive.")],
    out: Annotated[Path, typer.Option(metavar="LOG.csv", help="Write the joined log here.")],
    vehicle: Annotated[
        str | None, typer.Option(help="Whose wheel speeds the files have: a name or a TOML file.")
    ] = None,
    mapping: Annotated[
        Path | None, typer.Option(metavar="MAP.toml", help="Names, units and signs of columns.")
    ] = None,
    interval: Annotated[
        float | None, typer.Option(help="Length of a row, s; default: the slowest channel's.")
    ] = None,
    shift: Annotated[
        list[str] | None, typer.Option(metavar="FILE=S", help="Seconds to add to a file's times.")
    ] = None,
    run: Annotated[str, typer.Option(help="Label of the drive.")] = "",
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Join files with their own clocks and rates to one log.

    Example: joulepath logs join odom.csv power.csv imu.csv --out drive.csv
    """
    from planner.power.vehicles import load_vehicle
    from planner.telemetry.logs import join_logs

    if what != "join":
        raise RequestError("logs", "no such command", value=what, accepted="logs join FILE…")
    check_places(out)
    joined = join_logs(
        files,
        vehicle=None if vehicle is None else load_vehicle(vehicle),
        mapping=mapping,
        interval=interval,
        shifts=dict(map(_shift, shift or [])),
        run=run,
    )
    joined.write(out)
    if json_:
        report = {
            "rows": len(joined.columns["time"]),
            "interval_s": joined.interval,
            "columns": list(joined.columns),
            "said": list(joined.said),
            "findings": list(joined.findings),
            "out": str(out),
        }
        typer.echo(documents.strict(report))
        return
    for sentence in joined.said:
        typer.echo(sentence)
    for sentence in joined.findings:
        typer.echo(f"finding: {sentence}")
    typer.echo(f"wrote {out}: {len(joined.columns['time'])} rows", err=True)


VERBS: tuple[Callable[..., None], ...] = (logs,)


def _shift(given: str) -> tuple[str, float]:
    name, _, text = given.rpartition("=")
    try:
        seconds = finite_number(float(text))
    except ValueError:
        seconds = None
    if not name or seconds is None:
        raise RequestError("--shift", "is no shift", value=given, accepted="FILE=SECONDS")
    return name, seconds
