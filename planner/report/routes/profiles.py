"""Charts of a route: height and power along it, energy by effect side by side.

Power and energy are stacked with what is drawn above zero and what is given back below it, so that
the difference of both is the total. Effects that never matter are drawn together as "other".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.amounts import joules
from planner.arrays import Array
from planner.report.axes import Axes, padded, thinned
from planner.report.drawing import chart, text, width_of
from planner.report.markup import Markup, joined
from planner.report.routes.effects import colour_of, grouped

if TYPE_CHECKING:
    from planner.search.results import Route

_BARS = 13.0  # pixels, size of the letters beside bars


def height_chart(routes: Mapping[str, Route], *, width: int = 1000, height: int = 190) -> Markup:
    """Height along the way, of the route and of the others."""
    z = np.concatenate([route.arrays["z"] for route in routes.values()])
    low, high = float(z.min()), float(z.max())
    # Flat ground shall look flat, not like a mountain of rounding errors.
    room = max(0.0, 0.1 - (high - low)) / 2
    longest = max(float(route.distance_m[-1]) for route in routes.values())
    axes = Axes(width, height, (0.0, longest), padded(low - room, high + room))
    parts = [axes.frame("distance (m)", "height (m)")]
    for name, route in reversed([*routes.items()]):
        shown = thinned(len(route.distance_m))
        xs, ys = route.distance_m[shown], route.arrays["z"][shown]
        if name == "route":
            floor = np.full(len(ys), axes.y_range[0])
            parts += [axes.area(xs, floor, ys, "ground"), axes.line(xs, ys, "route")]
        else:
            parts.append(axes.line(xs, ys, f"other {name}"))
    return axes.svg(joined(*parts), "Height along the routes")


def mean_power(route: Route, *, most: int = 360) -> tuple[Array, dict[str, Array]]:
    """Power by effect over even pieces of the route, so that a long route can be drawn.

    Args:
        route: the route.
        most: largest number of pieces.

    Returns:
        (n + 1,) m where the pieces begin and end, and W by effect, each (n,): the energy spent on
        a piece divided by the time spent on it, standing and turning included.
    """
    along, t = route.distance_m, route.arrays["t"]
    edges = np.linspace(0.0, along[-1], min(most, max(1, len(along) - 1)) + 1)
    # Where the robot turns on the spot several moments share a place; the last one counts.
    last = np.append(np.diff(along) > 0, True)
    last[0] = True

    def at_edges(values: Array) -> Array:
        result: Array = np.interp(edges, along[last], values[last])
        return result

    times = np.diff(at_edges(t))
    steps = np.diff(t, prepend=t[0])
    return edges, {
        effect: np.diff(at_edges(np.cumsum(watts * steps))) / np.where(times > 0, times, 1.0)
        for effect, watts in route.watts_by_effect.items()
    }


def power_chart(
    route: Route, effects: Sequence[str], *, width: int = 1000, height: int = 270
) -> Markup:
    """Power along the route, stacked by effect, and its total as a line."""
    along, watts = mean_power(route, most=round(0.36 * width))
    shares = grouped(watts, effects)
    total = np.sum([*shares.values()], axis=0)
    drawn, returned = (
        np.sum([f(v, 0.0) for v in shares.values()], axis=0) for f in (np.maximum, np.minimum)
    )
    high = float(max(np.quantile(drawn, 0.995), total.max() * 0.8, 1e-6))
    low = float(np.quantile(returned, 0.005))
    axes = Axes(width, height, (0.0, float(along[-1])), padded(low, high, 0.04))
    parts = [axes.frame("distance (m)", "power (W)")]
    # A step line: each edge between two pieces is the place of both their values.
    edges = np.repeat(along, 2)[1:-1]
    for signed_part in (np.maximum, np.minimum):
        base = np.zeros(len(edges))
        for effect, values in shares.items():
            top = base + np.repeat(signed_part(values, 0.0), 2)
            if np.any(top != base):
                colour = colour_of(effect)
                parts.append(axes.area(edges, base, top, fill=colour, tooltip=effect))
            base = top
    parts.append(axes.line(edges, np.repeat(total, 2), "total"))
    return axes.svg(joined(*parts), "Power along the route by effect")


def energy_bars(
    routes: Mapping[str, Route], effects: Sequence[str], titles: Mapping[str, str]
) -> Markup:
    """Energy of every route as a bar of its effects; what is given back lies left of zero."""
    width, bar, gap = 1000, 34, 16
    left = max(110.0, 20.0 + max(width_of(name, _BARS) for name in routes))
    stacks = {n: grouped(r.breakdown_j, effects) for n, r in routes.items()}
    most = max(sum(max(float(v), 0.0) for v in s.values()) for s in stacks.values())
    least = min(sum(min(float(v), 0.0) for v in s.values()) for s in stacks.values())
    right_room = max(90.0, 16.0 + max(width_of(joules(r.energy_j), _BARS) for r in routes.values()))
    height = len(routes) * (bar + gap) + 8
    inner = (left, 0.0, width - right_room, float(height))
    axes = Axes(width, height, (least, most), inner=inner)
    parts = [axes.mark(0.0, 0.0, height, "zero")]
    for row, (name, stack) in enumerate(stacks.items()):
        y = 6 + row * (bar + gap)
        parts.append(text(left - 12, y + bar / 2 + 4, name, anchor="end"))
        drawn = returned = 0.0
        for effect, amount in stack.items():
            value = float(amount)
            start = drawn if value > 0 else returned
            drawn, returned = drawn + max(value, 0.0), returned + min(value, 0.0)
            if abs(axes.x(start + value) - axes.x(start)) >= 0.05:
                said, fill = f"{titles.get(effect, effect)}: {joules(value)}", colour_of(effect)
                parts.append(
                    axes.bar(start, start + value, y, bar, "band", rx=0, fill=fill, tooltip=said)
                )
        label = joules(routes[name].energy_j)
        parts.append(text(axes.x(drawn) + 8, y + bar / 2 + 4, label, "strong"))
    return chart(width, height, joined(*parts), "Energy by effect", kind="chart bars")
