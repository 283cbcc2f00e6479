"""A ROUTE.json document as tables for a terminal: the comparison and the energy account."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planner.amounts import chance, joules, metres, seconds
from planner.report.route_wording import EXCHANGE, arrival, called, extra_cost, width_from
from service.cli.grids import grid

Document = Mapping[str, Any]


def compared(document: Document) -> Iterator[tuple[str, Document]]:
    """The best route, its alternatives and the baselines, each with what to call it."""
    for number, route in enumerate(document["routes"]):
        yield ("route" if number == 0 else f"alternative {number}"), route
    for name, route in document.get("baselines", {}).items():
        yield name, route


def comparison(document: Document) -> Table:
    """Energy, length and duration of every route in the document."""
    table = grid(("", "energy", "", "length", "duration", "mean power"))
    best = document["routes"][0]["energy_j"]
    for number, (name, route) in enumerate(compared(document)):
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


def account(document: Document, titles: Mapping[str, str] | None = None) -> Table:
    """Energy by physical effect, largest first, for the route and its baselines.

    Effects that round to zero in all routes are left out.

    Args:
        document: ROUTE.json.
        titles: what to call an effect, by slug; the slug itself where it is missing.
    """
    routes = {name: route for name, route in compared(document) if route.get("breakdown_j")}
    totals = [route["energy_j"] for route in routes.values()]
    best, *others = routes
    table = grid(("where the energy goes", best, "share", *others))
    table.show_footer = True
    footers = ("all", joules(totals[0]), "100 %", *map(joules, totals[1:]))
    for column, footer in zip(table.columns, footers, strict=True):
        column.footer = footer
    energies = routes[best]["breakdown_j"]
    for slug in sorted(energies, key=lambda slug: (slug in EXCHANGE, -abs(energies[slug]))):
        cells = [joules(route["breakdown_j"].get(slug, 0.0)) for route in routes.values()]
        if set(cells) == {joules(0.0)}:
            continue
        name = (titles or {}).get(slug, slug)
        exchange = slug in EXCHANGE
        table.add_row(
            f"{name} (exchange)" if exchange else name,
            cells[0],
            f"{100 * energies[slug] / totals[0]:z.1f} %" if totals[0] else "",
            *cells[1:],
            style="dim" if exchange else "",
        )
    return table


def remarks(document: Document, titles: Mapping[str, str] | None = None) -> Iterator[str]:
    """Sentences on the battery, the optimality of the route, and the uncertainty of its energy.

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
        yield f"It {fits}: {share} available{likely}."
    for name, reason in document.get("baselines_absent", {}).items():
        yield f"No {name} route for comparison: {reason}."
    for note in document.get("notes", ()):
        yield f"Note: {note}."


def report(document: Document, titles: Mapping[str, str] | None = None) -> RenderableType:
    """Output of `joulepath plan`."""
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
    return Group(table, Text(said))


def _place(place: Document) -> str:
    return f"{place['x']:g}, {place['y']:g}"


def reach(document: Document) -> Group:
    """How far an energy takes the robot."""
    back = "there and back" if document["and_back"] else "there"
    lines = [
        f"{joules(document['energy_j'])} reach {document['area_m2']:,.0f} m², {back}.",
        f"{document['checked']} routes to the edge were computed in full.",
    ]
    return Group(*(Text(line) for line in lines))


def front(document: Document) -> RenderableType:
    """Routes from the fastest to that of least energy, each with its price of time."""
    if document["status"] != "ok":
        return Text(f"No route: {document.get('reason')}")
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
    return Group(table, Text("The price of time is the extra energy for each second saved."))


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
