"""Several routes in colours of their own: their energies as dots, their paths on the map.

drawn = [Drawn(point.route, "#b91c1c", "the fastest", point.route.duration_s) for point in points]
energy_chart(drawn, "duration (s)", "Energy over duration")
routes_map(terrain, drawn, "Routes")
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.arrays import Array
from planner.report.axes import Axes, Range, padded
from planner.report.drawing import circle
from planner.report.markup import Attributes, Markup, joined
from planner.report.routes.relief_map import ground_axes, outlined, relief_map
from planner.report.routes.route_map import window_of
from planner.terrain.heightmap import Terrain

if TYPE_CHECKING:
    from planner.search.results import Route

WIDTH, HEIGHT = 440, 330
"""Pixels of a chart."""


class Drawn(NamedTuple):
    """A route, its colour, the words under the pointer, and its place on the level axis."""

    route: Route
    colour: str
    words: str
    place: float


def energy_chart(
    drawn: Sequence[Drawn], label: str, title: str, names: Mapping[float, str] | None = None
) -> Markup:
    """Energy of every route as a dot.

    Args:
        drawn: at least one.
        label: of the level axis.
        title: for those who cannot see it.
        names: of the places; where they are numbers instead, a line joins the dots.
    """
    places = np.array([one.place for one in drawn])
    energies = np.array([one.route.energy_j for one in drawn])
    across = _room(places) if names is None else (-0.5, len(names) - 0.5)
    axes = Axes(WIDTH, HEIGHT, across, _room(energies), names)
    parts = [axes.frame(label, "energy (J)")]
    if names is None:
        parts.append(axes.line(places, energies, "noise thin"))
    rim: Attributes = {"stroke": "#fff", "stroke_width": 1.5, "fill_opacity": 0.85}
    for one, x, y in zip(drawn, axes.x(places), axes.y(energies), strict=True):
        parts.append(circle(x, y, 5.5, tooltip=one.words, fill=one.colour, **rim))
    return axes.svg(joined(*parts), title, "; ".join(one.words for one in drawn) + ".")


def _room(values: Array) -> Range:
    least = max(1e-3 * float(np.abs(values).max()), 1e-9)
    return padded(float(values.min()), float(values.max()), least=least)


def routes_map(terrain: Terrain, drawn: Sequence[Drawn], title: str) -> Markup:
    """The map with all routes, the first one on top."""
    ground = ground_axes(window_of(terrain, [one.route for one in drawn]), WIDTH)
    lines = [
        outlined(ground, one.route.arrays["x"], one.route.arrays["y"], one.colour)
        for one in reversed(drawn)
    ]
    return relief_map(terrain, ground, joined(*lines), title)
