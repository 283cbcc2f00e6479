"""The map of an answer: relief, all routes, the best one coloured by its power.

Colours of power: blue gives energy back, then yellow, orange, red to violet for the most power.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from planner.arrays import Array
from planner.report.axes import Axes
from planner.report.markup import Markup, element
from planner.report.routes.relief_image import Window
from planner.report.routes.relief_map import (
    ground_axes,
    outlined,
    place_mark,
    relief_map,
    window_around,
)
from planner.terrain.heightmap import Terrain

if TYPE_CHECKING:
    from planner.search.results import Answer, Route

Colour = tuple[int, int, int]
"""Red, green, blue, each 0 to 255."""
POWER_COLOURS = ((255, 224, 138), (249, 142, 60), (214, 48, 79), (107, 26, 123))
"""From the least to the most power taken."""
GIVEN_BACK = (38, 110, 220)
"""Where the robot gives energy back."""
START, GOAL = "#15803d", "#b91c1c"
BASELINE_COLOURS = {"shortest": "#10747a", "fastest": "#374151"}
_STEPS = 32
"""Shades of power; pieces of one shade are one line, which keeps the picture small."""


def seen(watts: Array) -> Array:
    """W as far as three digits of the largest show them.

    Power is a sum of effects: what is less is the rounding of that sum, and gives nothing back.
    """
    most = float(np.abs(watts).max(initial=0.0))
    shown: Array = watts if most == 0 else np.round(watts, max(0, 2 - math.floor(math.log10(most))))
    return shown


def power_range(watts: Array) -> tuple[float, float]:
    """W at both ends of the colours: zero, or what is nearly the least and the most."""
    if len(watts) < 2:
        return 0.0, 1.0
    low, high = np.quantile(watts[1:], [0.02, 0.98])
    return max(0.0, float(low)), max(float(high), max(0.0, float(low)) + 1e-9)


def mixed(first: Colour, last: Colour, share: float) -> Colour:
    """The colour at a share between two others."""
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(first, last, strict=True))
    return red, green, blue


def hexadecimal(colour: Colour) -> str:
    """A colour as a page writes it."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def power_colour(watts: float, low: float, high: float) -> Colour:
    """Colour of a power between ``low`` and ``high`` W."""
    if watts < 0:
        return GIVEN_BACK
    place = min(max((watts - low) / (high - low), 0.0), 1.0) * (len(POWER_COLOURS) - 1)
    k = min(int(place), len(POWER_COLOURS) - 2)
    return mixed(POWER_COLOURS[k], POWER_COLOURS[k + 1], place - k)


def routes_of(answer: Answer) -> dict[str, Route]:
    """The route, its alternatives and the baselines, each by its name."""
    named = {
        "route" if k == 0 else f"alternative {k}": route for k, route in enumerate(answer.routes)
    }
    return named | {name: baseline.route for name, baseline in answer.baselines.items()}


def window_of(terrain: Terrain, routes: Iterable[Route]) -> Window:
    """The part of a map that shows all of some routes; the whole map where there are none."""
    arrays = [route.arrays for route in routes]
    if not arrays:
        return terrain.extent
    xs, ys = (np.concatenate([each[k] for each in arrays]) for k in ("x", "y"))
    return window_around(terrain, xs, ys)


def coloured_pieces(route: Route) -> Iterator[tuple[str, list[int]]]:
    """Runs of poses that share a colour of power, each with its colour; runs meet in a pose."""
    watts = seen(route.arrays["watts"])
    low, high = power_range(watts)

    steps = np.where(watts < 0, -1.0, np.rint((watts - low) / (high - low) * _STEPS))
    changes = np.flatnonzero(np.diff(steps[1:])) + 2
    for first, end in itertools.pairwise(np.unique([1, *changes, len(watts)]).tolist()):
        middle = float(np.median(watts[first:end]))
        yield hexadecimal(power_colour(middle, low, high)), [*range(first - 1, end)]


def map_svg(answer: Answer, window: Window | None = None, *, width: int = 720) -> Markup:
    """The map with all routes as SVG, the best one coloured by its power.

    Args:
        answer: with or without a route.
        window: part of the map that is drawn; by default that of the routes.
        width: in pixels.
    """
    named = routes_of(answer)
    ground = ground_axes(window or window_of(answer.terrain, named.values()), width)
    parts = []
    for name, route in reversed(named.items()):
        xs, ys = route.arrays["x"], route.arrays["y"]
        if name == "route":
            parts += _route_parts(route, ground)
        else:
            colour = BASELINE_COLOURS.get(name, "#5b3a8c")
            dashes = "7 5" if name == "shortest" else "2 4"
            parts.append(outlined(ground, xs, ys, colour, width=2, dashes=dashes))
    title = f"Relief of {answer.terrain.name} with the routes"
    return relief_map(answer.terrain, ground, element("g", *parts, kind="routes"), title)


def _route_parts(route: Route, ground: Axes) -> list[Markup]:
    xs, ys, yaw = (route.arrays[k] for k in ("x", "y", "yaw"))
    round_ends = {"stroke_linejoin": "round", "stroke_linecap": "round", "fill": "none"}
    lines = [("#fff", 7.5, [*range(len(xs))])]
    lines += [(colour, 4.5, run) for colour, run in coloured_pieces(route)]
    parts = [
        element(
            "polyline",
            points=ground.points(xs[run], ys[run]),
            stroke=colour,
            stroke_width=width,
            **round_ends,
        )
        for colour, width, run in lines
    ]
    # Where the front of the robot points: it need not be where it goes.
    arrow = {"d": "M7,0L-3.5,-3.6L-1.5,0L-3.5,3.6Z", "fill": "#111827", "stroke": "#fff"}
    along = route.distance_m
    for k in np.searchsorted(along, np.linspace(0, along[-1], 14)[1:-1]):
        place = f"translate({ground.x(xs[k]):.1f} {ground.y(ys[k]):.1f})"
        turn = f"rotate({-math.degrees(yaw[k]):.1f})"
        parts.append(element("path", **arrow, stroke_width=0.8, transform=f"{place} {turn}"))
    for k, colour, what in ((0, START, "start"), (-1, GOAL, "goal")):
        parts.append(place_mark(ground, xs[k], ys[k], colour, what))
    return parts
