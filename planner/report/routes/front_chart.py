"""A front as pictures: energy over duration, and the map with its routes in the same colours."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING

import numpy as np

from planner.amounts import joules, seconds
from planner.report.axes import Axes, padded
from planner.report.routes.relief_map import ground_axes, outlined, relief_map, window_around

if TYPE_CHECKING:
    from planner.search.front import Front, FrontPoint

WIDTH, HEIGHT = 440, 330
FAST, FRUGAL = (185, 28, 28), (21, 128, 61)


def colour_of(place: int, count: int) -> str:
    """Colour of a route by its place in the front, from the fastest, red, to the last, green."""
    share = place / max(count - 1, 1)
    mixed = (round(a + (b - a) * share) for a, b in zip(FAST, FRUGAL, strict=True))
    return "#{:02x}{:02x}{:02x}".format(*mixed)


def point_words(point: FrontPoint) -> str:
    """A point in words: "845.2 J in 32.7 s, best from 20 W to 118 W"."""
    low, high = point.price_w
    prices = f"from {low:.3g} W" + (f" to {high:.3g} W" if math.isfinite(high) else "")
    return f"{joules(point.route.energy_j)} in {seconds(point.route.duration_s)}, best {prices}"


def front_curve(front: Front) -> str:
    """Energy over duration.

    Args:
        front: with at least one point.
    """
    times = np.array([point.route.duration_s for point in front.points])
    energies = np.array([point.route.energy_j for point in front.points])
    ranges = [
        padded(float(v.min()), float(v.max()), least=max(1e-3 * float(np.abs(v).max()), 1e-9))
        for v in (times, energies)
    ]
    axes = Axes(WIDTH, HEIGHT, ranges[0], ranges[1])
    parts = [axes.frame("duration (s)", "energy (J)"), axes.line(times, energies, "noise thin")]
    for k, (point, x, y) in enumerate(
        zip(front.points, axes.x(times), axes.y(energies), strict=True)
    ):
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" fill="{colour_of(k, len(times))}" '
            f'stroke="#fff" stroke-width="1.5"><title>{html.escape(point_words(point))}</title>'
            "</circle>"
        )
    said = "; ".join(point_words(point) for point in front.points) + "."
    return axes.svg("".join(parts), "Energy over duration", said)


def front_map(front: Front) -> str:
    """The map with the routes of all points.

    Args:
        front: with at least one point.
    """
    routes = [point.route for point in front.points]
    xs, ys = (np.concatenate([route.arrays[k] for route in routes]) for k in ("x", "y"))
    ground = ground_axes(window_around(front.terrain, xs, ys), WIDTH)
    parts = [
        outlined(
            ground,
            route.arrays["x"],
            route.arrays["y"],
            f'stroke="{colour_of(k, len(routes))}"',
            2.5,
            4.5,
        )
        for k, route in reversed([*enumerate(routes)])
    ]
    title = f"Routes from the fastest to the most frugal on {front.terrain.name}"
    return relief_map(front.terrain, ground, "".join(parts), title)
