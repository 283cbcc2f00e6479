"""The map of an answer: relief, all routes, the best one coloured by its power.

Colours of power: blue gives energy back, then yellow, orange, red to violet for the most power.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from planner.arrays import Array
from planner.report.axes import Axes
from planner.report.routes.relief_image import Window
from planner.report.routes.relief_map import (
    ground_axes,
    outlined,
    place_mark,
    relief_map,
    window_around,
)

if TYPE_CHECKING:
    from planner.search.results import Answer, Route


POWER_COLOURS = ((255, 224, 138), (249, 142, 60), (214, 48, 79), (107, 26, 123))
GIVEN_BACK = (38, 110, 220)
START, GOAL = "#15803d", "#b91c1c"
BASELINE_COLOURS = {"shortest": "#10747a", "fastest": "#374151"}
_STEPS = 32


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


def power_colour(watts: float, low: float, high: float) -> tuple[int, int, int]:
    """Red, green, blue of a power between ``low`` and ``high`` W."""
    if watts < 0:
        return GIVEN_BACK
    place = min(max((watts - low) / (high - low), 0.0), 1.0) * (len(POWER_COLOURS) - 1)
    k = min(int(place), len(POWER_COLOURS) - 2)
    a, b = POWER_COLOURS[k], POWER_COLOURS[k + 1]
    red, green, blue = (round(p + (q - p) * (place - k)) for p, q in zip(a, b, strict=True))
    return red, green, blue


def routes_of(answer: Answer) -> dict[str, Route]:
    """The route, its alternatives and the baselines, each by its name."""
    named = {
        "route" if k == 0 else f"alternative {k}": route for k, route in enumerate(answer.routes)
    }
    return named | {name: baseline.route for name, baseline in answer.baselines.items()}


def window_of(answer: Answer) -> Window:
    """The part of the map that shows all routes of an answer."""
    routes = routes_of(answer).values()
    if not routes:
        return answer.terrain.extent
    xs, ys = (np.concatenate([route.arrays[k] for route in routes]) for k in ("x", "y"))
    return window_around(answer.terrain, xs, ys)


def coloured_pieces(route: Route) -> Iterator[tuple[str, list[int]]]:
    """Runs of poses that share a colour of power, each with its colour; runs meet in a pose."""
    watts = seen(route.arrays["watts"])
    low, high = power_range(watts)

    def step(k: int) -> int:
        return -1 if watts[k] < 0 else round((watts[k] - low) / (high - low) * _STEPS)

    first = 1
    for k in range(2, len(watts) + 1):
        if k == len(watts) or step(k) != step(first):
            middle = float(np.median(watts[first:k]))
            yield (
                "#{:02x}{:02x}{:02x}".format(*power_colour(middle, low, high)),
                [*range(first - 1, k)],
            )
            first = k


def map_svg(answer: Answer, window: Window | None = None, *, width: int = 720) -> str:
    """The map with all routes as SVG, the best one coloured by its power.

    Args:
        answer: with or without a route.
        window: part of the map that is drawn; by default that of the routes.
        width: in pixels.
    """
    ground = ground_axes(window or window_of(answer), width)
    named = routes_of(answer)
    parts = []
    for name, route in reversed(named.items()):
        if name == "route":
            continue
        dashes = "7 5" if name == "shortest" else "2 4"
        stroke = f'stroke="{BASELINE_COLOURS.get(name, "#5b3a8c")}" stroke-dasharray="{dashes}"'
        parts.append(outlined(ground, route.arrays["x"], route.arrays["y"], stroke, 2, 4))
    if "route" in named:
        parts += _route_parts(named["route"], ground)
    title = f"Relief of {answer.terrain.name} with the routes"
    routes = f'<g class="routes">{"".join(parts)}</g>'
    return relief_map(answer.terrain, ground, routes, title)


def _route_parts(route: Route, ground: Axes) -> list[str]:
    xs, ys, yaw = (route.arrays[k] for k in ("x", "y", "yaw"))
    parts = [
        f'<polyline points="{ground.points(xs, ys)}" fill="none" stroke="#fff" '
        'stroke-width="7.5" stroke-linejoin="round" stroke-linecap="round"/>'
    ]
    for colour, run in coloured_pieces(route):
        parts.append(
            f'<polyline points="{ground.points(xs[run], ys[run])}" fill="none" '
            f'stroke="{colour}" stroke-width="4.5" stroke-linejoin="round" '
            'stroke-linecap="round"/>'
        )
    # Where the front of the robot points: it need not be where it goes.
    along = route.distance_m
    for k in np.searchsorted(along, np.linspace(0, along[-1], 14)[1:-1]):
        x, y = float(ground.x(xs[k])), float(ground.y(ys[k]))
        parts.append(
            '<path d="M7,0L-3.5,-3.6L-1.5,0L-3.5,3.6Z" fill="#111827" stroke="#fff" '
            f'stroke-width=".8" transform="translate({x:.1f} {y:.1f}) '
            f'rotate({-math.degrees(float(yaw[k])):.1f})"/>'
        )
    for k, colour, what in ((0, START, "start"), (-1, GOAL, "goal")):
        parts.append(place_mark(ground, float(xs[k]), float(ys[k]), colour, what))
    return parts
