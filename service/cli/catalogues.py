"""The commands about what is installed: ``maps``, ``vehicles``, ``effects`` and ``doctor``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from planner.amounts import span
from planner.errors import MapError, RequestError
from service import documents
from service.cli.terminal import Json, Verbose, check_places, show


def maps(
    what: Annotated[
        str | None,
        typer.Argument(metavar="[check]", help="What to do; without it all maps are listed."),
    ] = None,
    file: Annotated[
        str | None, typer.Argument(metavar="[FILE]", help="For check: a name, file or folder.")
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option(help="Also print where it can go: a name, or a TOML file.")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="PAGE.html", help="Draw where the vehicle can go, and in which directions."
        ),
    ] = None,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """List the maps of the catalogue, or check one.

    Example: joulepath maps check hall/map.toml --vehicle my-robot.toml --report hall.html
    """
    from planner.terrain.catalogue import list_maps, open_map

    if what is None:
        columns = {"name": "name", "title": "what", "size": "size (m)", "cell": "cell (m)"}
        return _list(list_maps(), columns, "Maps", json_)
    if what != "check" or file is None:
        raise RequestError("maps", "no such command", value=what, accepted="maps check FILE")
    from planner.terrain.map_files import describe_map

    check_places(report)

    terrain = open_map(file)
    found = describe_map(terrain)
    if report is not None or vehicle is not None:
        from planner.power.vehicles import load_vehicle
        from planner.report.routes import drive_page

        name = vehicle or "minibalance"
        try:
            page, shares = drive_page(terrain, load_vehicle(name))
        except MapError as error:
            if report is not None:
                raise
            # The figures of the map are worth telling without those of the vehicle.
            found["odd"].append(f"nothing is said of {name}: {error}")
        else:
            if report is not None:
                report.write_text(page, encoding="utf-8")
            found["for_vehicle"] = {"name": name, "shares": shares}
    typer.echo(documents.strict(documents.finite(found)) if json_ else _map_report(found))
    return None


def _map_report(report: dict[str, Any]) -> str:
    """The figures of a map in lines."""
    xmin, ymin, xmax, ymax = report["extent_m"]
    (nx, ny), (dx, dy) = report["cells"], report["cell_m"]
    slopes, heights = report["slopes"], report["heights_m"]
    lines = [
        f"{report['name']}: {report['source']}",
        f"extent     x {span(xmin, xmax)} m, y {span(ymin, ymax)} m"
        f" ({report['crs'] or 'local frame'})",
        f"cells      {nx} by {ny}, each {dx:.4g} m by {dy:.4g} m",
    ]
    if heights:
        steeper = slopes["share_steeper_than_deg"].items()
        lines += [
            f"heights    {heights[0]:.4g} to {heights[1]:.4g} m",
            f"slopes     up to {slopes['steepest_deg']:.1f}°; "
            + ", ".join(f"{share:.1%} above {limit}°" for limit, share in steeper),
        ]
    shares = (f"{name} {share:.1%}" for name, share in report["ground_shares"].items())
    return "\n".join(
        [
            *lines,
            f"obstacles  {report['obstacles_share']:.1%} of the cells",
            f"unknown    {report['unknown_share']:.1%} of the cells",
            f"ground     {', '.join(shares)}",
            *_for_vehicle(report.get("for_vehicle")),
            *(f"odd        {sentence}" for sentence in report["odd"]),
        ]
    )


def _for_vehicle(found: dict[str, Any] | None) -> list[str]:
    if found is None:
        return []
    shares = ", ".join(f"{name} {share:.1%}" for name, share in found["shares"].items())
    return [f"{found['name']}: {shares}"]


def vehicles(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME|check|new]", help="A vehicle, or what to do; without it all are listed."
        ),
    ] = None,
    file: Annotated[
        str | None, typer.Argument(metavar="[FILE]", help="For check: a name or a TOML file.")
    ] = None,
    toml: Annotated[
        bool, typer.Option("--toml", help="Print the vehicle's file with a comment for each key.")
    ] = False,
    json_: Json = False,
    verbose: Verbose = False,
) -> None:
    """List the vehicles, check one, or write a file to fill in.

    Examples: joulepath vehicles new > my-robot.toml; joulepath vehicles check my-robot.toml;
    joulepath vehicles minibalance --toml
    """
    from planner.power.vehicles import commented_toml, list_vehicles, load_vehicle, template

    if what is None:
        columns = {"name": "name", "title": "what", "mass_kg": "kg", "wheels": "wheels"}
        _list(list_vehicles(), columns, "Vehicles", json_)
    elif what == "new":
        typer.echo(template(), nl=False)
    elif (what == "check") == (file is None):
        problem = "is missing" if what == "check" else "is one argument too many"
        raise RequestError("FILE", problem, accepted="vehicles check FILE, or vehicles NAME")
    elif toml:
        typer.echo(commented_toml(file or what), nl=False)
    else:
        _check_vehicle(load_vehicle(file or what), json_)


def effects(json_: Json = False, verbose: Verbose = False) -> None:
    """List the physical effects that a power model can hold.

    Example: joulepath effects --json
    """
    from planner.power.catalogue import list_effects

    columns = {"name": "name", "title": "what", "stages": "acts on", "base": "in every model"}
    _list(list_effects(), columns, "Effects", json_)


def doctor(json_: Json = False, verbose: Verbose = False) -> None:
    """Check this installation, and say what would fix it; status 1 where something is broken.

    Example: joulepath doctor
    """
    from service.doctor import examine

    findings = [finding.to_json() for finding in examine()]
    broken = any(finding["status"] == "broken" for finding in findings)
    if json_:
        typer.echo(documents.strict({"status": "broken" if broken else "ok", "checks": findings}))
    else:
        from service.cli.terminal import grid

        rows = [
            [finding[key] for key in ("name", "status", "found", "fix")] for finding in findings
        ]
        show(grid(("check", "status", "found", "what would help"), rows, left=range(4)))
    if broken:
        raise typer.Exit(1)


VERBS: tuple[Callable[..., None], ...] = (maps, vehicles, effects, doctor)


def _check_vehicle(vehicle: Any, as_json: bool) -> None:
    from planner.power.sanity import check_vehicle

    report = check_vehicle(vehicle).document()
    if as_json:
        typer.echo(documents.strict(documents.finite(report)))
    else:
        show(_vehicle_report(report))


def _vehicle_report(report: dict[str, Any]) -> Any:
    """The report of planner.power.sanity as a table and lists."""
    from rich.console import Group, RenderableType
    from rich.text import Text

    from service.cli.terminal import grid

    parts: list[RenderableType] = [Text(f"{report['name']}: {report['title']}", "bold")]
    table = grid(
        ("motion", "at", "power", "in windings", "current", "torque", "voltage", "reaches", "lasts")
    )
    for motion in report["motions"]:
        share, hours = motion["torque_share"], motion["hours"]
        table.add_row(
            motion["name"],
            f"{motion['speed_m_s']:.2f} m/s",
            f"{motion['power_w']:z.1f} W",
            f"{motion['winding_w']:.1f} W",
            f"{motion['current_a']:.2f} A",
            "no limit" if share is None else f"{share:.0%}",
            f"{motion['voltage_v']:.1f} V",
            f"{motion['reachable_m_s']:.2f} m/s",
            "" if hours is None else f"{hours:.1f} h",
        )
    parts += ["", table]
    for title, lines in (
        ("odd", report["odd"] or ["nothing"]),
        ("derived or by default", report["derived"]),
        ("assumed", report["assumed"]),
        ("without a source", filter(None, [", ".join(report["without_source"])])),
    ):
        if lines := list(lines):
            parts += ["", Text(title, "bold"), *(Text(f"  {line}") for line in lines)]
    return Group(*parts)


def _list(
    entries: Sequence[dict[str, Any]], columns: dict[str, str], title: str, as_json: bool
) -> None:
    plain = documents.finite(list(entries))
    if as_json:
        typer.echo(documents.strict(plain))
    else:
        from service.cli.route_tables import catalogue

        show(catalogue(plain, columns, title))
