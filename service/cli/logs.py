"""Files of drives: ``joulepath logs join FILE…`` reads them, ``joulepath experiment`` writes them.

The first makes one log of several files. The second makes velocity commands of the drives that a
diagnosis recommends.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from planner.errors import RequestError
from planner.reading import finite_number
from service import documents
from service.cli.terminal import Json, Verbose, check_places

_ACCEPTED = "what `joulepath diagnose --json` writes"
_MOST_BYTES = 64_000_000
"""Of a saved diagnosis that is held in memory."""
_LEAST_RATE, _MOST_RATE = 1.0, 1000.0
"""Commands per second that a robot's base takes."""
_MOST = {"vx": 50.0, "vy": 50.0, "wz": 50.0, "ramp": 3600.0, "hold": 3600.0}
"""m/s, rad/s and s; what is larger is no leg of a robot."""
_MOST_LEGS, _MOST_ROUNDS = 1000, 10_000
"""Of one drive; longer files are mistakes."""


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


def experiment(
    diagnosis: Annotated[
        Path, typer.Argument(metavar="DIAGNOSIS.json", help="Written by diagnose --json.")
    ],
    out: Annotated[
        Path, typer.Option(metavar="DRIVE.csv", help="Write the first drive here, others beside.")
    ],
    area: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTHxWIDTH", help="Free area in m, along and across the first heading."
        ),
    ] = None,
    rate: Annotated[float, typer.Option(help="Commands per second.")] = 20.0,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """Write recommended drives as commands: t (s), vx, vy (m/s), wz (rad/s) in the body frame.

    Example: joulepath experiment diagnosis.json --out drive.csv --area 4x3
    """
    from planner.telemetry.diagnosis import fitted_into, sampled

    if not _LEAST_RATE <= rate <= _MOST_RATE:
        accepted = f"{_LEAST_RATE:g} to {_MOST_RATE:g} commands per second"
        raise RequestError("--rate", "is out of range", value=rate, accepted=accepted)
    room = None if area is None else _area(area)
    drives = [(entry["run"], entry["settings"]) for entry in _drives(diagnosis)]
    if room is not None:
        drives = [(run, fitted_into(settings, room)) for run, settings in drives]
    written = []
    for number, (run, settings) in enumerate(drives, start=1):
        path = out if number == 1 else out.with_name(f"{out.stem}-{number}{out.suffix}")
        rows = sampled(settings, 1.0 / rate)
        lines = [",".join(f"{value:.6g}" for value in row) for row in rows.tolist()]
        documents.write_whole(path, "\n".join(["t,vx,vy,wz", *lines, ""]))
        written.append(
            {
                "file": str(path),
                "run": run,
                "runs": settings["runs"],
                "slope": settings["slope"],
                "uphill": settings["uphill"],
                "area": settings["area"],
                "seconds": float(rows[-1, 0]),
                "minutes": round(len(settings["runs"]) * float(rows[-1, 0]) / 60.0, 1),
            }
        )
    if json_:
        typer.echo(documents.strict({"drives": written}))
        return
    for drive in written:
        typer.echo(f"{drive['file']}: {drive['run']}")
        length, width = drive["area"]
        typer.echo(
            f"  {drive['seconds']:.0f} s of commands, to be driven as {len(drive['runs'])} runs, "
            f"{drive['minutes']:g} minutes in all; needs {length:g} m by {width:g} m."
        )
        for count, run in enumerate(drive["runs"], start=1):
            typer.echo(f"  run {count}: {_conditions(run)}")


VERBS: tuple[Callable[..., None], ...] = (logs, experiment)


def _shift(given: str) -> tuple[str, float]:
    name, _, text = given.rpartition("=")
    try:
        seconds = finite_number(float(text))
    except ValueError:
        seconds = None
    if not name or seconds is None:
        raise RequestError("--shift", "is no shift", value=given, accepted="FILE=SECONDS")
    return name, seconds


def _conditions(run: Mapping[str, Any]) -> str:
    load = f"{run['payload']:g} kg of load" if run["payload"] else "no load"
    heat = "" if run["motor_temp"] is None else f", motors at {run['motor_temp']:g} °C"
    return load + heat


def _area(text: str) -> tuple[float, float]:
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*[xX×]\s*(\d+(?:\.\d+)?)", text.strip())
    if found is None:
        raise RequestError(
            "--area", "cannot be read", value=text, accepted="length x width in m, such as 4x3"
        )
    return float(found[1]), float(found[2])


def _drives(path: Path) -> list[Mapping[str, Any]]:
    """Entries of ``experiments`` that are drives, checked."""
    try:
        with path.open("rb") as file:
            document = json.loads(file.read(_MOST_BYTES))
        entries = list(document["experiments"])
        drives = [entry for entry in entries if entry["settings"]]
        for entry in drives:
            _check(entry["settings"])
            str(entry["run"])
    except OSError as error:
        problem = f"cannot be read: {error.strerror}"
        raise RequestError(str(path), problem, accepted=_ACCEPTED) from None
    except (ValueError, KeyError, TypeError, RecursionError):
        raise RequestError(str(path), "is no diagnosis", accepted=_ACCEPTED) from None
    if not drives:
        said = " ".join(str(entry.get("run", "")) for entry in entries)
        raise RequestError(
            str(path),
            "recommends no drive" + (f"; it recommends: {said}" if said else ""),
            accepted="a diagnosis whose `experiments` have settings",
        )
    return drives


def _check(settings: Mapping[str, Any]) -> None:
    """Refuse settings of a drive that did not come from a diagnosis.

    Raises:
        ValueError, KeyError, TypeError: a key is missing or holds something else.
    """
    legs, runs, rounds = settings["legs"], settings["runs"], settings["rounds"]
    if not (0 < len(legs) <= _MOST_LEGS and runs and rounds == int(rounds)):
        raise ValueError("no legs, runs or rounds")
    numbers = [abs(leg[name]) / most for leg in legs for name, most in _MOST.items()]
    if not all(number <= 1.0 for number in numbers):
        raise ValueError("a leg is out of range")
    if (
        not 1 <= rounds <= _MOST_ROUNDS
        or min(leg[name] for leg in legs for name in ("ramp", "hold")) < 0
    ):
        raise ValueError("a duration is out of range")
    pairs = [*settings["robot"], *settings["area"], settings["slope"], settings["uphill"]]
    if len(pairs) != 6 or not all(map(math.isfinite, pairs)):
        raise ValueError("a size is out of range")
    for run in runs:
        if not all(v is None or math.isfinite(v) for v in (run["payload"], run["motor_temp"])):
            raise ValueError("a load or temperature is no number")
