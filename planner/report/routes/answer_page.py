"""The page about an answer: map, comparison, profiles, account; and its card for notebooks.

The page's script only moves a cursor over map and charts together; everything is there without it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from planner.amounts import coordinates, joules, metres, seconds
from planner.power.catalogue import all_effects
from planner.report.axes import thinned
from planner.report.drawing import beside, size_of
from planner.report.markup import (
    Attributes,
    Markup,
    bullets,
    dot,
    element,
    figure,
    joined,
    paragraph,
    section,
    table,
)
from planner.report.route_wording import (
    Document,
    account,
    called,
    compared,
    extra_cost,
    extra_share,
    remarks,
)
from planner.report.routes.effects import OTHER, colour_of, main_effects
from planner.report.routes.profiles import energy_bars, height_chart, power_chart
from planner.report.routes.route_map import (
    GIVEN_BACK,
    hexadecimal,
    map_svg,
    power_colour,
    power_range,
    routes_of,
    seen,
)
from planner.report.view import View
from planner.report.workbench_wording import model_name

if TYPE_CHECKING:
    from planner.report.routes.relief_image import Window
    from planner.search.results import Answer, Route


SHADES = 40
"""Steps of the drawn scale of power."""


def answer_view(answer: Answer, window: Window | None = None) -> View:
    """An answer with its map, profiles and account.

    Args:
        answer: with or without a route.
        window: part of the map that is drawn; by default that of the routes.
    """
    title, drawing = _title(answer), map_svg(answer, window)
    if not answer.routes:
        reason = paragraph(f"No route: {answer.reason or ''}", "reason")
        return View(title, {"map": drawing}, (section("", reason, drawing),), reason)
    document = answer.to_json()
    titles = {slug: effect.title for slug, effect in all_effects().items()} | {OTHER: OTHER}
    routes, route = routes_of(answer), answer.routes[0]
    effects = main_effects(list(routes.values()))
    height, power = height_chart(routes), power_chart(route, effects)
    energy = energy_bars(routes, effects, titles)
    lead = paragraph(_sentence(answer), "lead")
    shown = figure(drawing, _power_legend(route))
    comparison = _comparison(document)
    model = f"Model {model_name(answer.model)}, kind {answer.model['kind']}."
    notes = bullets([*remarks(document, titles), model])
    readout = "Move over the map or a chart."
    page = section(
        "",
        lead,
        element("div", shown, element("div", comparison, notes), kind="top"),
        element("h3", "Along the way"),
        element("p", readout, kind="readout", aria_live="polite"),
        f"{height}{power}{_legend([*effects, OTHER], titles)}",
        element("h3", "Where the energy goes"),
        f"{energy}{_account(document, titles)}",
        element("script", Markup(_poses(route)), kind="poses", type="application/json"),
    )
    pictures = {
        "overview": _overview(answer, drawing, effects),
        "map": drawing,
        "height": height,
        "power": power,
        "energy": energy,
    }
    return View(title, pictures, (page,), f"{lead}{shown}{comparison}", script="page.js")


def _overview(answer: Answer, drawing: str, effects: Sequence[str]) -> str:
    """Map, height and power as one picture."""
    high = max(190, (size_of(drawing)[1] - 30) // 2)
    profiles = (
        height_chart(routes_of(answer), width=560, height=high),
        power_chart(answer.routes[0], effects, width=560, height=high),
    )
    best = answer.routes[0]
    said = f"{joules(best.energy_j)}, {metres(best.length_m)}, {seconds(best.duration_s)}"
    return beside([(drawing,), profiles], f"Route over {answer.terrain.name}: {said}")


def _title(answer: Answer) -> str:
    if not answer.routes:
        return f"{answer.terrain.name}: no route"
    route = answer.routes[0].arrays
    start, goal = (f"({coordinates(route['x'][k], route['y'][k])})" for k in (0, -1))
    return f"{answer.terrain.name}: {start} to {goal}"


def _sentence(answer: Answer) -> Markup:
    best = answer.routes[0]
    others = [
        f"the {name} route {extra_cost(b.energy_j, best.energy_j)}"
        for name, b in answer.baselines.items()
    ]
    length = f" over {metres(best.length_m)} in {seconds(best.duration_s)}"
    compared = f"; {', '.join(others)}." if others else "."
    return joined(element("b", joules(best.energy_j)), length, compared)


def _comparison(document: Document) -> Markup:
    """Energy, how it compares, length and duration of every route."""
    routes = compared(document)
    best = routes["route"]["energy_j"]
    rows = [
        [
            joined(element("i", kind=f"line {name}"), called(name, document["planner"])),
            joules(route["energy_j"]),
            "" if name == "route" else extra_share(route["energy_j"], best),
            metres(route["length_m"]),
            seconds(route["duration_s"]),
        ]
        for name, route in routes.items()
    ]
    return table("", ["", "energy", "more", "length", "duration"], rows)


def _power_legend(route: Route) -> Markup:
    watts = seen(route.arrays["watts"])
    low, high = power_range(watts)
    shades = [hexadecimal(power_colour(k, 0, SHADES)) for k in range(SHADES + 1)]
    steps = [element("rect", x=k, width=1.1, height=1, fill=c) for k, c in enumerate(shades)]
    box: Attributes = {"viewBox": f"0 0 {SHADES + 1} 1", "preserveAspectRatio": "none"}
    scale = element("svg", *steps, kind="scale", aria_hidden="true", **box)
    back = [dot(hexadecimal(GIVEN_BACK)), " gives back "] if (watts < 0).any() else []
    where = f" {high:.3g} W · arrowheads: where the front points"
    return joined(*back, f"{low:.3g} W ", scale, where)


def _legend(effects: Sequence[str], titles: Mapping[str, str]) -> Markup:
    entries = [joined(dot(colour_of(e)), titles.get(e, e)) for e in effects]
    return bullets([*entries, joined(element("i", kind="line total"), "total")], "legend")


def _account(document: Document, titles: Mapping[str, str]) -> Markup:
    heads, rows, sums = account(document)
    cells = []
    for effect, exchanged, values in rows:
        kind = Markup(" <small>(exchange)</small>") if exchanged else ""
        name = joined(dot(colour_of(effect)), titles.get(effect, effect), kind)
        cells.append([name, *values])
    return table("", ["effect", *heads], cells, foot=["all", *sums], kind="account")


def _poses(route: Route) -> str:
    names = ("x", "y", "z", "t", "speed", "watts", "energy_j")
    arrays = {name: route.arrays[name] for name in names} | {"distance": route.distance_m}
    shown = thinned(len(route.distance_m))
    columns = {
        name: [float(f"{value:.5g}") for value in values[shown]] for name, values in arrays.items()
    }
    return json.dumps(columns, separators=(",", ":"))
