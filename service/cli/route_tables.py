"""A ROUTE.json document as tables for a terminal: the comparison and the energy account."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planner.amounts import chance, joules, metres, seconds
from planner.report.route_wording import EXCHANGE, arrival, called, extra_cost, width_from

Document = Mapping[str, Any]


def compared(document: Document) -> Iterator[tuple[str, Document]]:
    """The best route, its alternatives and the baselines, each with what to call it."""
    for number, route in enumerate(document["routes"]):
        yield ("route" if number == 0 else f"alternative {number}"), route
    for name, route in document.get("baselines", {}).items():
        yield name, route


def comparison(document: Document, title: str | None = None) -> Table:
    """Energy, length and duration of every route in the document."""
    table = Table(title=title, title_justify="left", header_style="bold")
    table.add_column("")
    for heading in ("energy", "", "length", "duration", "mean power"):
        table.add_column(heading, justify="right")
    best = document["routes"][0]["energy_j"]
    for number, (name, route) in enumerate(compared(document)):
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


def account(document: Document, titles: Mapping[str, str] | None = None) -> Table:
    """Energy by physical effect, largest first, for the route and its baselines.

    What rounds to nothing everywhere is left out.

    Args:
        document: ROUTE.json.
        titles: what to call an effect, by slug; the slug itself where it is missing.
    """
    routes = [(n, r) for n, r in compared(document) if r.get("breakdown_j")]
    table = Table(header_style="bold", show_footer=True)
    table.add_column("where the energy goes", footer="all")
    best = routes[0][1]
    total = best["energy_j"]
    table.add_column("route", footer=joules(total), justify="right")
    table.add_column("share", footer="100 %", justify="right")
    for name, route in routes[1:]:
        table.add_column(name, footer=joules(route["energy_j"]), justify="right")
    slugs = sorted(best["breakdown_j"], key=lambda s: -abs(best["breakdown_j"][s]))
    for slug in sorted(slugs, key=lambda s: s in EXCHANGE):
        name = (titles or {}).get(slug, slug)
        value = best["breakdown_j"][slug]
        if all(joules(route["breakdown_j"].get(slug, 0.0)) == joules(0.0) for _, route in routes):
            continue
        cells = [joules(value), f"{100 * value / total:z.1f} %" if total else ""]
        cells += [joules(route["breakdown_j"].get(slug, 0.0)) for _, route in routes[1:]]
        exchange = slug in EXCHANGE
        table.add_row(
            f"{name} (exchange)" if exchange else name, *cells, style="dim" if exchange else ""
        )
    return table


def remarks(document: Document, titles: Mapping[str, str] | None = None) -> Iterator[str]:
    """The battery, how good the route is known to be, what the model leaves open.

    Args:
        document: ROUTE.json.
        titles: what to call an effect, by slug.
    """
    best = document["routes"][0]
    low, high = best["energy_interval_j"]
    if goal := document.get("goal"):
        yield arrival(goal)
    yield f"One drive takes {joules(low)} … {joules(high)} in 95 of 100 cases."
    if parts := best.get("sensitivity"):
        yield f"The interval's width comes from {width_from(parts, titles or {})}."
    yield (
        f"No feasible route of this motion model costs less than {joules(best['lower_bound_j'])}; "
        f"the gap is {100 * best['gap']:.1f} % of the dissipated energy."
    )
    if battery := best.get("battery"):
        share = f"{100 * battery['share']:.2g} % of the {joules(battery['available_j'])}"
        fits = "fits the battery" if battery["fits"] else "DOES NOT FIT the battery"
        likely = f"; chance {chance(battery['chance'])}" if "chance" in battery else ""
        yield f"It {fits}: {share} that are in it{likely}."
    for name, reason in document.get("baselines_absent", {}).items():
        yield f"Nothing to compare with as the {name}: {reason}."
    for note in document.get("notes", ()):
        yield f"Note: {note}."


def report(document: Document, titles: Mapping[str, str] | None = None) -> RenderableType:
    """All that `joulepath plan` says about an answer."""
    if document["status"] != "ok":
        return Text(f"No route: {document.get('reason')}")
    lines = [Text(remark) for remark in remarks(document, titles)]
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
