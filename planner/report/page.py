"""The page itself: one section for each answer, with style and script inside.

The script only moves a cursor over map and charts together; without it everything is still there.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from planner.power.catalogue import all_effects
from planner.report.drawing import (
    OTHER,
    colour_of,
    energy_bars,
    height_chart,
    main_effects,
    power_chart,
    thinned,
)
from planner.report.markup import document, plain, write
from planner.search.pictures import (
    GIVEN_BACK,
    POWER_COLOURS,
    comparison_rows,
    map_svg,
    power_range,
    routes_of,
    seen,
)
from planner.search.route import Answer, Route
from planner.search.wording import (
    EXCHANGE,
    arrival,
    called,
    chance,
    extra_cost,
    joules,
    metres,
    seconds,
    width_from,
)


def write_report(
    answers: Sequence[Answer] | Mapping[str, Answer], path: str | Path, title: str
) -> None:
    """Write a self-contained HTML page.

    Args:
        answers: what to show, in this order; a mapping gives each a heading.
        path: where to; its folder is made.
        title: of the page.
    """
    if not isinstance(answers, Mapping):
        answers = {_heading(answer): answer for answer in answers}
    titles = {slug: effect.title for slug, effect in all_effects().items()} | {OTHER: OTHER}
    sections = "".join(
        _section(number, heading, answer, titles)
        for number, (heading, answer) in enumerate(answers.items())
    )
    write(document(title, sections, script="page.js"), path)


def _heading(answer: Answer) -> str:
    if not answer.routes:
        return f"{answer.terrain.name}: no route"
    route = answer.routes[0].arrays
    start, goal = (f"({route['x'][k]:.4g}, {route['y'][k]:.4g})" for k in (0, -1))
    return f"{answer.terrain.name}: {start} to {goal}"


def _section(number: int, heading: str, answer: Answer, titles: Mapping[str, str]) -> str:
    identity = f"answer{number}"
    opening = f'<section id="{identity}"><h2>{plain(heading)}</h2>'
    if not answer.routes:
        reason = plain(answer.reason or "")
        picture = map_svg(answer, identity=f"{identity}-map")
        return f'{opening}<p class="reason">No route: {reason}</p>{picture}</section>'
    routes = routes_of(answer)
    route = answer.routes[0]
    effects = main_effects(list(routes.values()))
    return (
        f"{opening}<p class='lead'>{_sentence(answer)}</p>"
        f'<div class="top"><figure>{map_svg(answer, identity=f"{identity}-map")}'
        f"{_power_legend(route)}</figure>"
        f"<div>{_comparison(answer)}{_remarks(answer, titles)}</div></div>"
        "<h3>Along the way</h3>"
        f'<p class="readout" aria-live="polite">Move over the map or a chart.</p>'
        f"{height_chart(routes)}{power_chart(route, effects)}"
        f"{_legend([*effects, OTHER], titles)}"
        "<h3>Where the energy goes</h3>"
        f"{energy_bars(routes, effects, titles)}{_account(routes, titles)}"
        f'<script type="application/json" class="poses">{_poses(route)}</script></section>'
    )


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
        f"{plain(called(row['name'], answer.planner))}</th>"
        + "".join(f"<td>{plain(v)}</td>" for k, v in row.items() if k != "name")
        + "</tr>"
        for row in comparison_rows(answer)
    )
    heads = "".join(
        f"<th scope='col'>{h}</th>" for h in ("", "energy", "more", "length", "duration")
    )
    return f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>"


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
    stops = ", ".join("rgb({}, {}, {})".format(*colour) for colour in POWER_COLOURS)
    back = "rgb({}, {}, {})".format(*GIVEN_BACK)
    below = f"<i class='dot' style='background:{back}'></i> gives back" if (watts < 0).any() else ""
    return (
        f"<figcaption>{below} {low:.3g} W <i class='scale' style='background:"
        f"linear-gradient(90deg, {stops})'></i> {high:.3g} W · arrowheads: where the front "
        "points</figcaption>"
    )


def _legend(effects: Sequence[str], titles: Mapping[str, str]) -> str:
    entries = "".join(
        f"<li><i class='dot' style='background:{colour_of(e)}'></i>{plain(titles.get(e, e))}</li>"
        for e in effects
    )
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
            f"<tr><th scope='row'><i class='dot' style='background:{colour_of(effect)}'></i>"
            f"{name}</th>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"
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
