"""The page about planners side by side: their routes on the map, energies as dots, a table."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

import numpy as np

from planner.amounts import joules, seconds
from planner.report.axes import Axes, padded
from planner.report.drawing import beside, dot
from planner.report.markup import Markup, figure, paragraph, plain, section, table
from planner.report.routes.relief_map import ground_axes, outlined, relief_map, window_around
from planner.report.view import View

if TYPE_CHECKING:
    from planner.search.ompl.benchmark import PlannerComparison, PlannerRun

WIDTH, HEIGHT = 440, 330
COLOURS = ("#15803d", "#b91c1c", "#1d4ed8", "#a16207")
"""Of planners, in their order; the first is least-energy."""


def planner_view(found: PlannerComparison) -> View:
    """A comparison; planners without a route stand in the table alone."""
    title = f"{found.terrain.name}: planners in the {found.space} space"
    rows = section("", table("", ["planner", *HEADS.values()], _rows(found)))
    if not found.solved:
        reason = paragraph("No planner found a route.", "reason")
        return View(title, {}, (section("", reason), rows), reason, absent="there is no route")
    chart, ground = energy_chart(found), route_map(found)
    both = beside([(chart,), (ground,)], f"Planners and their routes on {found.terrain.name}")
    pair = Markup(f"<div class='pair'>{figure(chart)}{figure(ground)}</div>")
    pictures = {"planners": both, "energies": chart, "map": ground}
    return View(title, pictures, (section("", pair), rows), pair)


HEADS = {"runs": "runs", "solved": "with a route", "seconds": "time", "energy_j": "energy"}
"""Keys of a planner's row, and their headings."""


def _rows(found: PlannerComparison) -> list[list[Markup | str]]:
    rows: list[list[Markup | str]] = []
    for row in found.rows:
        energy = "" if row["energy_j"] is None else joules(row["energy_j"])
        extra = row["extra_share"]
        if extra is not None and row["planner"] != "least-energy":
            energy += f" ({100 * extra:+.2f} %)"
        counts = [str(row["runs"]), str(row["solved"]), seconds(row["seconds"])]
        square = dot(_colour(found, row["planner"]))
        rows.append([Markup(f"{square}{plain(row['planner'])}"), *counts, energy])
    return rows


def _colour(found: PlannerComparison, planner: str) -> str:
    names = list(dict.fromkeys(run.planner for run in found.runs))
    return COLOURS[names.index(planner) % len(COLOURS)]


def energy_chart(found: PlannerComparison) -> str:
    """Energy of every run's route, planner by planner."""
    names = list(dict.fromkeys(run.planner for run in found.runs))
    energies = [run.energy_j for run in found.solved if run.energy_j is not None]
    low, high = min(energies), max(energies)
    axes = Axes(
        WIDTH,
        HEIGHT,
        (-0.5, len(names) - 0.5),
        padded(low, high, least=max(1e-3 * abs(high), 1e-9)),
        names=dict(enumerate(names)),
    )
    parts = [axes.frame("", "energy (J)")]
    for run in found.solved:
        x, y = axes.x(float(names.index(run.planner))), axes.y(run.energy_j or 0.0)
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{_colour(found, run.planner)}" '
            f'fill-opacity="0.7" stroke="#fff"><title>{html.escape(_words(run))}</title></circle>'
        )
    said = "; ".join(_words(run) for run in found.solved) + "."
    return axes.svg("".join(parts), "Energy of the routes by planner", said)


def _words(run: PlannerRun) -> str:
    assert run.route is not None  # of a run that found one
    return f"{run.planner}: {joules(run.route.energy_j)} in {seconds(run.seconds)}"


def route_map(found: PlannerComparison) -> str:
    """The map with the routes of all runs, least-energy on top."""
    routes = [(run.planner, run.route) for run in found.solved if run.route is not None]
    xs, ys = (np.concatenate([route.arrays[k] for _, route in routes]) for k in ("x", "y"))
    ground = ground_axes(window_around(found.terrain, xs, ys), WIDTH)
    parts = [
        outlined(
            ground,
            route.arrays["x"],
            route.arrays["y"],
            f'stroke="{_colour(found, name)}"',
            2.5,
            4.5,
        )
        for name, route in reversed(routes)
    ]
    return relief_map(found.terrain, ground, "".join(parts), f"Routes on {found.terrain.name}")
