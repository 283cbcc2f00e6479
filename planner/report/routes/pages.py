"""Pages and cards about fronts, planners side by side, areas in reach and matrices of energies."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.amounts import joules, metres, seconds, share
from planner.report.drawing import beside
from planner.report.markup import dot, figure, joined, pair, paragraph, section, table
from planner.report.routes.answer_page import answer_view
from planner.report.routes.coloured_routes import Drawn, energy_chart, routes_map
from planner.report.routes.matrix_chart import energy_words, matrix_chart, place_words
from planner.report.routes.reach_map import reach_map
from planner.report.routes.route_map import hexadecimal, mixed
from planner.report.view import View

if TYPE_CHECKING:
    from planner.search.front import Front, FrontPoint
    from planner.search.matrix import Matrix
    from planner.search.ompl.benchmark import PlannerComparison, PlannerRun
    from planner.search.reach import Reach
    from planner.search.results import Route

FASTEST_COLOUR, FRUGAL_COLOUR = (185, 28, 28), (21, 128, 61)
"""Red, green and blue of the first and of the last route of a front."""
COLOURS = ("#15803d", "#b91c1c", "#1d4ed8", "#a16207")
"""Of planners, in their order; the first is least-energy."""


def front_view(front: Front) -> View:
    """Energy over duration, the map with the routes in the same colours, and their table."""
    name = front.terrain.name
    title = f"{name}: energy and duration"
    if not front.points:
        return _without_route(title, f"No route. {front.reason or ''}")
    drawn = [
        Drawn(point.route, _between(k, len(front.points)), _point(point), point.route.duration_s)
        for k, point in enumerate(front.points)
    ]
    curve = energy_chart(drawn, "duration (s)", "Energy over duration")
    ground = routes_map(
        front.terrain, drawn, f"Routes from the fastest to the most frugal on {name}"
    )
    both = beside([(curve,), (ground,)], f"Energy over duration, and the routes on {name}")
    ends = dict.fromkeys(_spent(one.route) for one in (drawn[0], drawn[-1]))
    content = paragraph(f"{' to '.join(ends)}.", "lead") + pair(figure(curve), figure(ground))
    heads = ["route", "duration", "energy", "length", "best from a time weight of", "to"]
    rows = [
        [
            joined(dot(one.colour), k + 1),
            seconds(one.route.duration_s),
            joules(one.route.energy_j),
            metres(one.route.length_m),
            f"{point.price_w[0]:.3g} W",
            f"{point.price_w[1]:.3g} W" if math.isfinite(point.price_w[1]) else "",
        ]
        for k, (one, point) in enumerate(zip(drawn, front.points, strict=True))
    ]
    sections = (section("", content), section("Routes, fastest first", table("", heads, rows)))
    return View(title, {"front": both, "curve": curve, "map": ground}, sections, content)


def _without_route(title: str, reason: str, *further: str) -> View:
    said = paragraph(reason, "reason")
    return View(title, {}, (section("", said), *further), said, absent="there is no route")


def _between(place: int, count: int) -> str:
    """Colour of a route by its place in the front, from the fastest to the last."""
    return hexadecimal(mixed(FASTEST_COLOUR, FRUGAL_COLOUR, place / max(count - 1, 1)))


def _spent(route: Route) -> str:
    return f"{joules(route.energy_j)} in {seconds(route.duration_s)}"


def _point(point: FrontPoint) -> str:
    """A point in words: "845.2 J in 32.7 s, best from 20 W to 118 W"."""
    low, high = point.price_w
    prices = f"from {low:.3g} W" + (f" to {high:.3g} W" if math.isfinite(high) else "")
    return f"{_spent(point.route)}, best {prices}"


def planner_view(found: PlannerComparison) -> View:
    """Energies of the runs and their routes; planners without a route stand in the table alone."""
    name = found.terrain.name
    title = f"{name}: planners in the {found.space} space"
    planners = list(dict.fromkeys(run.planner for run in found.runs))
    colours = {planner: COLOURS[k % len(COLOURS)] for k, planner in enumerate(planners)}
    heads = ["planner", "runs", "with a route", "time", "energy"]
    rows = [
        [
            joined(dot(colours[row["planner"]]), row["planner"]),
            row["runs"],
            row["solved"],
            seconds(row["seconds"]),
            _energy(row),
        ]
        for row in found.rows
    ]
    listed = section("", table("", heads, rows))
    drawn = [
        Drawn(run.route, colours[run.planner], _run(run), planners.index(run.planner))
        for run in found.solved
        if run.route is not None
    ]
    if not drawn:
        return _without_route(title, "No planner found a route.", listed)
    chart = energy_chart(drawn, "", "Energy of the routes by planner", dict(enumerate(planners)))
    ground = routes_map(found.terrain, drawn, f"Routes on {name}")
    both = beside([(chart,), (ground,)], f"Planners and their routes on {name}")
    content = pair(figure(chart), figure(ground))
    pictures = {"planners": both, "energies": chart, "map": ground}
    return View(title, pictures, (section("", content), listed), content)


def _run(run: PlannerRun) -> str:
    return f"{run.planner}: {joules(run.energy_j or 0.0)} in {seconds(run.seconds)}"


def _energy(row: dict[str, Any]) -> str:
    energy = "" if row["energy_j"] is None else joules(row["energy_j"])
    if row["extra_share"] is None or row["planner"] == "least-energy":
        return energy
    return f"{energy} ({100 * row['extra_share']:+.2f} %)"


def reach_view(reach: Reach) -> View:
    """The area that an energy reaches."""
    drawing = reach_map(reach)
    x, y = reach.start
    trip = "there and back" if reach.and_back else "one way"
    area = reach.area_m2
    size = f"{area / 1e6:,.2f} km²" if area >= 1e6 else f"{area:,.0f} m²"
    said = f"{joules(reach.energy_j)} from ({x:.4g}, {y:.4g}) reach {size}, {trip}."
    checked = f"{reach.checked} routes to the edge were driven in full"
    if not math.isnan(reach.error_share):
        checked += f"; the last round was off by at most {share(reach.error_share)}"
    content = paragraph(said, "lead") + figure(drawing, f"{checked}.")
    title = f"{reach.terrain.name}: reach of {joules(reach.energy_j)}"
    return View(title, {"map": drawing}, (section("", content),), content)


def matrix_view(matrix: Matrix) -> View:
    """Energies between places."""
    drawing = matrix_chart(matrix)
    rows, columns = matrix.energy_j.shape
    found = int(np.isfinite(matrix.energy_j).sum())
    said = (
        f"Energy from {_counted(rows, 'start')} to {_counted(columns, 'goal')}; "
        f"{found} of {rows * columns} pairs have a route."
    )
    driven = f"{int(matrix.driven.sum())} pairs were driven in full"
    if matrix.error_share > 0.0:
        driven += f"; nine of ten others are within {share(matrix.error_share)}"
    content = paragraph(said, "lead") + figure(drawing, f"{driven}.")
    heads = ["start", *map(place_words, matrix.goals)]
    cells = [
        [place_words(start), *map(energy_words, row)]
        for start, row in zip(matrix.starts, matrix.energy_j.tolist(), strict=True)
    ]
    sections = (section("", content), section("Energies", table("", heads, cells)))
    return View("Energy matrix", {"energies": drawing}, sections, content)


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


VIEWS: dict[str, Callable[[Any], View]] = {
    "Answer": answer_view,
    "Front": front_view,
    "Matrix": matrix_view,
    "PlannerComparison": planner_view,
    "Reach": reach_view,
}
"""Kind of a result → what makes its view."""
