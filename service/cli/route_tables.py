"""A ROUTE.json document as tables for a terminal: the comparison and the energy account."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planner.amounts import coordinates, joules, metres, seconds
from planner.report import route_wording
from planner.report.route_wording import called, compared, extra_cost
from service.cli.terminal import grid

Document = Mapping[str, Any]


def comparison(document: Document) -> Table:
    """Energy, length and duration of every route in the document."""
    table = grid(("", "energy", "", "length", "duration", "mean power"))
    best = document["routes"][0]["energy_j"]
    for number, (name, route) in enumerate(compared(document).items()):
        table.add_row(
            called(name, document["planner"]),
            joules(route["energy_j"]),
            "" if number == 0 else extra_cost(route["energy_j"], best),
            metres(route["length_m"]),
            seconds(route["duration_s"]),
            _mean_power(route),
            style="bold" if number == 0 else "",
        )
    return table


def _mean_power(route: Document) -> str:
    duration = route["duration_s"]
    return f"{route['energy_j'] / duration:z.1f} W" if duration > 0 else ""


def account(document: Document, titles: Mapping[str, str]) -> Table:
    """Energy by physical effect, largest first, for the route and its baselines.

    Effects that round to zero in all routes are left out.

    Args:
        document: ROUTE.json.
        titles: what to call an effect, by slug; the slug itself where it is missing.
    """
    heads, rows, sums = route_wording.account(document)
    table = grid(("where the energy goes", *heads))
    table.show_footer = True
    for column, footer in zip(table.columns, ("all", *sums), strict=True):
        column.footer = footer
    for slug, exchanged, cells in rows:
        name = titles.get(slug, slug) + (" (exchange)" if exchanged else "")
        table.add_row(name, *cells, style="dim" if exchanged else "")
    return table


def report(document: Document, titles: Mapping[str, str]) -> RenderableType:
    """All that `joulepath plan` says about an answer."""
    if document["status"] != "ok":
        return Group(Text(f"No route: {document.get('reason')}"), *_notes(document))
    lines = [Text(remark) for remark in route_wording.remarks(document, titles)]
    return Group(comparison(document), account(document, titles), *lines)


def catalogue(entries: list[dict[str, Any]], columns: Mapping[str, str], title: str) -> Table:
    """A catalogue as a table.

    Args:
        entries: objects that have a ``name``.
        columns: key in an entry -> heading.
        title: above the table.
    """
    rows = [[_cell(entry.get(key)) for key in columns] for entry in entries]
    return grid(list(columns.values()), rows, left=range(len(columns)), title=title)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    if isinstance(value, list | tuple):
        return ", ".join(_cell(item) for item in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def matrix(document: Document) -> Group:
    """Energies between places, a row for each start."""
    table = grid(("from \\ to", *map(_place, document["goals"])))
    for place, row in zip(document["starts"], document["energy_j"], strict=True):
        cells = ("no route" if value is None else joules(value) for value in row)
        table.add_row(_place(place), *cells)
    pairs = sum(value is not None for row in document["energy_j"] for value in row)
    said = f"{document['driven']} of {pairs} motions computed in full"
    if document["error_share"]:
        said += f"; nine in ten of the others are within {document['error_share']:.1%}"
    return Group(table, Text(said), *_notes(document))


def _notes(document: Document) -> list[Text]:
    return [Text(note) for note in route_wording.notes(document)]


def _place(place: Document) -> str:
    return coordinates(place["x"], place["y"])


def graph(document: Document) -> Group:
    """What a graph's edges take, and those that cannot be driven."""
    summary = document["joulepath"]
    edges = [
        feature["properties"]["metadata"]
        for feature in document["features"]
        if "startid" in feature["properties"]
    ]
    lines = [
        f"{len(edges)} of {summary['edges'] + summary['added']} edges between "
        f"{summary['places']} places can be driven; {summary['added']} were added."
    ]
    if edges:
        energies = [edge["energy_j"] for edge in edges]
        lines.append(f"An edge takes {joules(min(energies))} to {joules(max(energies))}.")
    for one in summary["closed"]:
        edge = "no edge" if one["id"] is None else f"edge {one['id']}"
        lines.append(f"{edge}, {one['startid']} to {one['endid']}: {one['reason']}")
    return Group(*(Text(line) for line in lines), *_notes(summary))


def reach(document: Document) -> Group:
    """How far an energy takes the robot."""
    back = "there and back" if document["and_back"] else "there"
    lines = [
        f"{joules(document['energy_j'])} reach {document['area_m2']:,.0f} m², {back}.",
        f"{document['checked']} routes to the edge were computed in full.",
    ]
    return Group(*(Text(line) for line in lines), *_notes(document))


def front(document: Document) -> RenderableType:
    """Routes from the fastest to that of least energy, each with its time weight."""
    if document["status"] != "ok":
        return Group(Text(f"No route: {document.get('reason')}"), *_notes(document))
    headings = ("duration", "energy", "length", "mean power", "best at a price of time of")
    table = grid(headings, left=())
    for point in document["points"]:
        low, high = point["price_w"]
        table.add_row(
            seconds(point["duration_s"]),
            joules(point["energy_j"]),
            metres(point["length_m"]),
            _mean_power(point),
            f"{low:.3g} W and more" if high is None else f"{low:.3g} to {high:.3g} W",
        )
    said = Text("The price of time is the extra energy for each second saved.")
    return Group(table, said, *_notes(document))


def planners(document: Document) -> Group:
    """One row per planner."""
    table = grid(("planner", "runs", "with a route", "time", "energy", "over least-energy"))
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
