"""A ROUTE.json document as tables for a terminal: the comparison and the energy account."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planner.amounts import joules, metres, seconds
from planner.report import route_wording
from planner.report.route_wording import called, compared, extra_cost

Document = Mapping[str, Any]


def comparison(document: Document, title: str | None = None) -> Table:
    """Energy, length and duration of every route in the document."""
    table = Table(title=title, title_justify="left", header_style="bold")
    table.add_column("")
    for heading in ("energy", "", "length", "duration", "mean power"):
        table.add_column(heading, justify="right")
    best = document["routes"][0]["energy_j"]
    for number, (name, route) in enumerate(compared(document).items()):
        energy, duration = route["energy_j"], route["duration_s"]
        table.add_row(
            called(name, document["planner"]),
            joules(energy),
            "" if number == 0 else extra_cost(energy, best),
            metres(route["length_m"]),
            seconds(duration),
            f"{energy / duration:z.1f} W" if duration > 0 else "",
            style="bold" if number == 0 else "",
        )
    return table


def account(document: Document, titles: Mapping[str, str]) -> Table:
    """Energy by physical effect for the route and its baselines.

    Args:
        document: ROUTE.json.
        titles: what to call an effect, by slug; the slug itself where it is missing.
    """
    heads, rows, sums = route_wording.account(document)
    table = Table(header_style="bold", show_footer=True)
    table.add_column("where the energy goes", footer="all")
    for heading, total in zip(heads, sums, strict=True):
        table.add_column(heading, footer=total, justify="right")
    for slug, exchanged, cells in rows:
        name = titles.get(slug, slug) + (" (exchange)" if exchanged else "")
        table.add_row(name, *cells, style="dim" if exchanged else "")
    return table


def report(document: Document, titles: Mapping[str, str]) -> RenderableType:
    """All that `joulepath plan` says about an answer."""
    if document["status"] != "ok":
        return Text(f"No route: {document.get('reason')}")
    lines = [Text(remark) for remark in route_wording.remarks(document, titles)]
    return Group(comparison(document), account(document, titles), *lines)


def catalogue(entries: list[dict[str, Any]], columns: Mapping[str, str], title: str) -> Table:
    """A catalogue as a table.

    Args:
        entries: objects that have a ``name``.
        columns: key in an entry -> heading.
        title: above the table.
    """
    table = Table(title=title, title_justify="left", header_style="bold")
    for heading in columns.values():
        table.add_column(heading)
    for entry in entries:
        table.add_row(*(_cell(entry.get(key)) for key in columns))
    return table


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
    table = Table(header_style="bold")
    table.add_column("from \\ to")
    for place in document["goals"]:
        table.add_column(f"{place['x']:g}, {place['y']:g}", justify="right")
    for place, row in zip(document["starts"], document["energy_j"], strict=True):
        cells = ["no way" if value is None else joules(value) for value in row]
        table.add_row(f"{place['x']:g}, {place['y']:g}", *cells)
    pairs = sum(value is not None for row in document["energy_j"] for value in row)
    said = f"{document['driven']} of {pairs} motions worked out in full"
    if document["error_share"]:
        said += f"; the others are right within {document['error_share']:.1%} in nine of ten"
    return Group(table, Text(said))


def reach(document: Document) -> Group:
    """How far an energy takes the robot."""
    back = "there and back" if document["and_back"] else "there"
    lines = [
        f"{joules(document['energy_j'])} reach {document['area_m2']:,.0f} m², {back}.",
        f"{document['checked']} routes to the edge were worked out in full.",
    ]
    return Group(*(Text(line) for line in lines))


def front(document: Document) -> RenderableType:
    """Routes from the fastest to that of least energy, and what a second costs between them."""
    if document["status"] != "ok":
        return Text(f"No route: {document.get('reason')}")
    table = Table(header_style="bold")
    for heading in ("duration", "energy", "length", "mean power", "best at a price of time of"):
        table.add_column(heading, justify="right")
    for point in document["points"]:
        (low, high), duration = point["price_w"], point["duration_s"]
        table.add_row(
            seconds(duration),
            joules(point["energy_j"]),
            metres(point["length_m"]),
            f"{point['energy_j'] / duration:z.1f} W" if duration > 0 else "",
            f"{low:.3g} W and more" if high is None else f"{low:.3g} to {high:.3g} W",
        )
    said = (
        "Each second that is saved costs the joules by which the row below gives way to the next."
    )
    return Group(table, Text(said))
