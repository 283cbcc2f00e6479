"""The page about an answer: map, comparison, profiles, account; and its card for notebooks.

The page's script only moves a cursor over map and charts together; everything is there without it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from planner.amounts import chance, joules, metres, seconds
from planner.power.catalogue import all_effects
from planner.report.axes import thinned
from planner.report.drawing import beside, dot, size_of
from planner.report.markup import plain
from planner.report.route_wording import (
    EXCHANGE,
    arrival,
    called,
    extra_cost,
    extra_share,
    width_from,
)
from planner.report.routes.effects import OTHER, colour_of, main_effects
from planner.report.routes.profiles import energy_bars, height_chart, power_chart
from planner.report.routes.route_map import (
    GIVEN_BACK,
    map_svg,
    power_colour,
    power_range,
    routes_of,
    seen,
)
from planner.report.view import View

if TYPE_CHECKING:
    from planner.report.routes.relief_image import Window
    from planner.search.results import Answer, Route


_SHADES = 40  # steps of the scale of power


def answer_view(answer: Answer, heading: str = "", window: Window | None = None) -> View:
    """An answer with its map, profiles and account.

    Args:
        answer: with or without a route.
        heading: of its part of the page; by default the map with start and goal.
        window: part of the map that is drawn; by default that of the routes.
    """
    title = heading or _title(answer)
    drawing = map_svg(answer, window)
    opening = f"<section><h2>{plain(title)}</h2>"
    if not answer.routes:
        reason = f'<p class="reason">No route: {plain(answer.reason or "")}</p>'
        return View(title, {"map": drawing}, (f"{opening}{reason}{drawing}</section>",), reason)
    titles = {slug: effect.title for slug, effect in all_effects().items()} | {OTHER: OTHER}
    routes = routes_of(answer)
    route = answer.routes[0]
    effects = main_effects(list(routes.values()))
    height, power = height_chart(routes), power_chart(route, effects)
    energy = energy_bars(routes, effects, titles)
    lead = f"<p class='lead'>{_sentence(answer)}</p>"
    figure = f"<figure>{drawing}{_power_legend(route)}</figure>"
    table = _comparison(answer)
    section = (
        f"{opening}{lead}"
        f'<div class="top">{figure}<div>{table}{_remarks(answer, titles)}</div></div>'
        "<h3>Along the way</h3>"
        f'<p class="readout" aria-live="polite">Move over the map or a chart.</p>'
        f"{height}{power}{_legend([*effects, OTHER], titles)}"
        "<h3>Where the energy goes</h3>"
        f"{energy}{_account(routes, titles)}"
        f'<script type="application/json" class="poses">{_poses(route)}</script></section>'
    )
    pictures = {
        "overview": _overview(answer, drawing, effects),
        "map": drawing,
        "height": height,
        "power": power,
        "energy": energy,
    }
    return View(title, pictures, (section,), f"{lead}{figure}{table}", script="page.js")


def _overview(answer: Answer, drawing: str, effects: Sequence[str]) -> str:
    """Map, height and power as one picture."""
    high = max(190, (size_of(drawing)[1] - 30) // 2)
    profiles = (
        height_chart(routes_of(answer), width=560, height=high),
        power_chart(answer.routes[0], effects, width=560, height=high),
    )
    return beside([(drawing,), profiles], f"Route over {answer.terrain.name}: {_plain(answer)}")


def _plain(answer: Answer) -> str:
    best = answer.routes[0]
    return f"{joules(best.energy_j)}, {metres(best.length_m)}, {seconds(best.duration_s)}"


def _title(answer: Answer) -> str:
    if not answer.routes:
        return f"{answer.terrain.name}: no route"
    route = answer.routes[0].arrays
    start, goal = (f"({route['x'][k]:.4g}, {route['y'][k]:.4g})" for k in (0, -1))
    return f"{answer.terrain.name}: {start} to {goal}"


def _sentence(answer: Answer) -> str:
    best = answer.routes[0]
    others = [
        f"the {name} route {extra_cost(b.energy_j, best.energy_j)}"
        for name, b in answer.baselines.items()
    ]
    first = (
        f"<b>{joules(best.energy_j)}</b> over {metres(best.length_m)} in {seconds(best.duration_s)}"
    )
    return f"{first}; {', '.join(others)}." if others else f"{first}."


def _comparison(answer: Answer) -> str:
    rows = "".join(
        f"<tr><th scope='row'><i class='line {row['name']}'></i>"
        f"{plain(called(row['name'], answer.planner.to_json()))}</th>"
        + "".join(f"<td>{plain(v)}</td>" for k, v in row.items() if k != "name")
        + "</tr>"
        for row in _rows(answer)
    )
    heads = "".join(
        f"<th scope='col'>{h}</th>" for h in ("", "energy", "more", "length", "duration")
    )
    return f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>"


def _rows(answer: Answer) -> list[Mapping[str, str]]:
    """Name, energy, how it compares, length and duration of every route, in words."""
    best = answer.routes[0].energy_j if answer.routes else 0.0
    return [
        {
            "name": name,
            "energy": joules(route.energy_j),
            "more": "" if name == "route" else extra_share(route.energy_j, best),
            "length": metres(route.length_m),
            "duration": seconds(route.duration_s),
        }
        for name, route in routes_of(answer).items()
    ]


def _remarks(answer: Answer, titles: Mapping[str, str]) -> str:
    route = answer.routes[0]
    low, high = route.energy_interval_j
    remarks = [
        *([] if answer.goal is None else [arrival(answer.goal)]),
        f"Energy of one drive: {joules(low)} … {joules(high)} (95 %).",
        *_width(route, titles),
        f"No feasible route of this motion model costs less than "
        f"{joules(route.lower_bound_j)} (gap {100 * route.gap:.1f} % of what is dissipated).",
    ]
    if route.battery is not None and route.battery_chance is not None:
        fits = "fits" if route.battery.fits else "does not fit"
        remarks.append(
            f"The battery holds {joules(route.battery.available_j)}: the route {fits} and takes "
            f"{100 * route.battery.share:.2g} % of it; the chance that it suffices is "
            f"{chance(route.battery_chance)}."
        )
    model = answer.model
    remarks.append(f"Model {model['name']}, version {model['version']}, kind {model['kind']}.")
    remarks += [f"Nothing to compare with as the {n}: {why}." for n, why in answer.absent.items()]
    remarks += answer.notes
    return "<ul>" + "".join(f"<li>{plain(r)}</li>" for r in remarks) + "</ul>"


def _width(route: Route, titles: Mapping[str, str]) -> list[str]:
    parts = [part.to_json() for part in route.sensitivity]
    return [f"The interval's width comes from {width_from(parts, titles)}."] if parts else []


def _power_legend(route: Route) -> str:
    watts = seen(route.arrays["watts"])
    low, high = power_range(watts)
    below = f"{dot(f'rgb{GIVEN_BACK}')} gives back" if (watts < 0).any() else ""
    scale = "".join(
        f"<rect x='{k}' width='1.1' height='1' fill='rgb{power_colour(k, 0, _SHADES)}'/>"
        for k in range(_SHADES + 1)
    )
    return (
        f"<figcaption>{below} {low:.3g} W <svg class='scale' preserveAspectRatio='none' "
        f"viewBox='0 0 {_SHADES + 1} 1' aria-hidden='true'>{scale}</svg> {high:.3g} W · "
        "arrowheads: where the front points</figcaption>"
    )


def _legend(effects: Sequence[str], titles: Mapping[str, str]) -> str:
    entries = "".join(f"<li>{dot(colour_of(e))}{plain(titles.get(e, e))}</li>" for e in effects)
    return f"<ul class='legend'>{entries}<li><i class='line total'></i>total</li></ul>"


def _account(routes: Mapping[str, Route], titles: Mapping[str, str]) -> str:
    best = routes["route"]
    ordered = sorted(best.breakdown_j, key=lambda e: (e in EXCHANGE, -abs(best.breakdown_j[e])))
    rows = []
    for effect in ordered:
        values = [route.breakdown_j.get(effect, 0.0) for route in routes.values()]
        if all(joules(value) == joules(0.0) for value in values):
            continue
        name = plain(titles.get(effect, effect)) + (
            " <small>(exchange)</small>" if effect in EXCHANGE else ""
        )
        share = 100 * values[0] / best.energy_j if best.energy_j else 0.0
        cells = [joules(values[0]), f"{share:z.1f} %", *map(joules, values[1:])]
        rows.append(
            f"<tr><th scope='row'>{dot(colour_of(effect))}{name}</th>"
            + "".join(f"<td>{cell}</td>" for cell in cells)
            + "</tr>"
        )
    heads = ["effect", "route", "share", *[name for name in routes if name != "route"]]
    head = "".join(f"<th scope='col'>{h}</th>" for h in heads)
    sums = [joules(best.energy_j), "100 %"]
    sums += [joules(route.energy_j) for name, route in routes.items() if name != "route"]
    foot = "<tr><th scope='row'>all</th>" + "".join(f"<td>{s}</td>" for s in sums) + "</tr>"
    return (
        f"<table class='account'><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
        f"<tfoot>{foot}</tfoot></table>"
    )


def _poses(route: Route) -> str:
    names = ("x", "y", "z", "t", "speed", "watts", "energy_j")
    arrays = {name: route.arrays[name] for name in names} | {"distance": route.distance_m}
    shown = thinned(len(route.distance_m))
    columns = {
        name: [float(f"{value:.5g}") for value in values[shown]] for name, values in arrays.items()
    }
    return json.dumps(columns, separators=(",", ":"))
