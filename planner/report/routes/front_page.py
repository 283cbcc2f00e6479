"""The page about a front: its curve, its map and a table of its routes; its card."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.amounts import joules, metres, seconds
from planner.report.drawing import beside, dot
from planner.report.markup import Markup, figure, paragraph, plain, section, table
from planner.report.routes.front_chart import colour_of, front_curve, front_map
from planner.report.view import View

if TYPE_CHECKING:
    from planner.search.front import Front


def front_view(front: Front) -> View:
    """A front with or without points."""
    name = front.terrain.name
    title = f"{name}: energy and duration"
    if not front.points:
        reason = paragraph(f"No route. {front.reason or ''}", "reason")
        return View(title, {}, (section("", reason),), reason, absent="there is no route")
    curve, ground = front_curve(front), front_map(front)
    both = beside([(curve,), (ground,)], f"Energy over duration, and the routes on {name}")
    fastest, last = front.points[0], front.points[-1]
    ends = dict.fromkeys(
        f"{joules(p.route.energy_j)} in {seconds(p.route.duration_s)}" for p in (fastest, last)
    )
    lead = paragraph(f"{' to '.join(ends)}.", "lead")
    pair = Markup(f"<div class='pair'>{figure(curve)}{figure(ground)}</div>")
    sections = (
        section("", lead, pair),
        section("Routes, fastest first", _table(front)),
    )
    return View(title, {"front": both, "curve": curve, "map": ground}, sections, lead + pair)


def _table(front: Front) -> Markup:
    rows = []
    for k, point in enumerate(front.points):
        low, high = point.price_w
        rows.append(
            [
                Markup(f"{dot(colour_of(k, len(front.points)))}{plain(k + 1)}"),
                seconds(point.route.duration_s),
                joules(point.route.energy_j),
                metres(point.route.length_m),
                f"{low:.3g} W",
                f"{high:.3g} W" if math.isfinite(high) else "",
            ]
        )
    heads = ["route", "duration", "energy", "length", "best from a time weight of", "to"]
    return table("", heads, rows)
