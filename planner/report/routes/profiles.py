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
from planner.report.markup import plain
from planner.report.routes.effects import colour_of, grouped

if TYPE_CHECKING:
    from planner.search.results import Route

_BARS = 13.0  # pixels, size of the letters beside bars


def height_chart(routes: Mapping[str, Route], *, width: int = 1000, height: int = 190) -> str:
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
        line = axes.points(route.distance_m[shown], route.arrays["z"][shown])
        if name == "route":
            first, last = axes.x(0.0), axes.x(route.distance_m[-1])
            floor = axes.bottom
            area = f"{first:.1f},{floor:.0f} {line} {last:.1f},{floor:.0f}"
            parts.append(f'<polygon points="{area}" class="ground"/>')
            parts.append(f'<polyline points="{line}" class="route"/>')
        else:
            parts.append(f'<polyline points="{line}" class="other {name}"/>')
    return axes.svg("".join(parts), "Height along the routes")


def mean_power(route: Route, *, most: int = 360) -> tuple[Array, dict[str, Array]]:
    """Power by effect over even pieces of the way, so that a long route can be drawn.

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
) -> str:
    """Power along the way, stacked by effect, and its total as a line."""
    along, watts = mean_power(route, most=round(0.36 * width))
    shares = grouped(watts, effects)
    above = {e: np.maximum(v, 0.0) for e, v in shares.items()}
    below = {e: np.minimum(v, 0.0) for e, v in shares.items()}
    total = np.sum([*shares.values()], axis=0)
    drawn, returned = (np.sum([*layer.values()], axis=0) for layer in (above, below))
    high = float(max(np.quantile(drawn, 0.995), total.max() * 0.8, 1e-6))
    low = float(np.quantile(returned, 0.005))
    axes = Axes(width, height, (0.0, float(along[-1])), padded(low, high, 0.04))
    parts = [axes.frame("distance (m)", "power (W)")]
    for layers in (above, below):
        base = np.zeros(len(total))
        for effect, values in layers.items():
            if not np.any(values):
                continue
            top = base + values
            band = f"{_steps(axes, along, top)} {_steps(axes, along, base, backwards=True)}"
            parts.append(
                f'<polygon points="{band}" fill="{colour_of(effect)}">'
                f"<title>{plain(effect)}</title></polygon>"
            )
            base = top
    parts.append(f'<polyline points="{_steps(axes, along, total)}" class="total"/>')
    return axes.svg("".join(parts), "Power along the route by effect")


def _steps(axes: Axes, edges: Array, values: Array, *, backwards: bool = False) -> str:
    """A step line of values between edges."""
    xs = np.repeat(edges, 2)[1:-1]
    ys = np.clip(np.repeat(values, 2), *axes.y_range)
    return axes.points(xs[::-1], ys[::-1]) if backwards else axes.points(xs, ys)


def energy_bars(
    routes: Mapping[str, Route], effects: Sequence[str], titles: Mapping[str, str]
) -> str:
    """Energy of every route as a bar of its effects; what is given back lies left of zero."""
    width, bar, gap = 1000, 34, 16
    left = max(110.0, 20.0 + max(width_of(name, _BARS) for name in routes))
    stacks = {n: grouped(_as_arrays(r.breakdown_j), effects) for n, r in routes.items()}
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
            x, end = sorted(float(axes.x(v)) for v in (start, start + value))
            if end - x < 0.05:
                continue
            what = plain(f"{titles.get(effect, effect)}: {joules(value)}")
            parts.append(
                f'<rect x="{x:.1f}" y="{y}" width="{end - x:.1f}" height="{bar}" '
                f'fill="{colour_of(effect)}" class="band"><title>{what}</title></rect>'
            )
        end = float(axes.x(drawn)) + 8
        parts.append(text(end, y + bar / 2 + 4, joules(routes[name].energy_j), "strong"))
    return chart(width, height, "".join(parts), "Energy by effect", kind="chart bars")


def _as_arrays(values: Mapping[str, float]) -> dict[str, Array]:
    return {name: np.asarray(value, float) for name, value in values.items()}
