"""Charts of a route as SVG: height and power along the way, energy by effect side by side.

Power and energy are stacked with what is drawn above zero and what is given back below it, so that
the difference of both is the total. Effects that never matter are drawn together as "other".
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.report.markup import plain
from planner.search.route import Route
from planner.search.wording import joules

Array = NDArray[np.float64]

# Related effects have related colours: electronics grey to blue, resistance of the wheels green,
# drive orange to red, exchange violet, wind and ground teal.
COLOURS = {
    "electronics": "#64748b",
    "sensor_rate": "#94a3b8",
    "converter_efficiency": "#475569",
    "driver_loss": "#3b82c4",
    "wheel_rolling": "#4d9a51",
    "roller_drag": "#8cc152",
    "load_dependent_rolling": "#2f7d4f",
    "surface_rolling": "#b5cc6a",
    "gear_loss": "#f0a63c",
    "copper_loss": "#d9622b",
    "coulomb_drag": "#c2413b",
    "viscous_drag": "#e58a6f",
    "regeneration_limit": "#9c2f6b",
    "gravity": "#7c5cc4",
    "inertia": "#b39ddb",
    "air_drag": "#2a9d8f",
    "com_offset": "#a1887f",
}
_SPARE = ("#8d6e63", "#26a69a", "#ab47bc", "#78909c", "#d4a017", "#5c6bc0")
OTHER = "other"
_OTHER_COLOUR = "#cbd5e1"

LEFT, RIGHT, TOP, BOTTOM = 52, 12, 10, 26  # pixels round a frame, more where figures are long
_BARS = 13.0  # pixels, size of the letters beside bars
_LABEL = 17  # pixels of the upright axis's label


def colour_of(effect: str) -> str:
    """Colour of an effect, the same in every chart."""
    if effect == OTHER:
        return _OTHER_COLOUR
    spare = _SPARE[sum(map(ord, effect)) % len(_SPARE)]
    return COLOURS.get(effect, spare)


def main_effects(routes: Sequence[Route], *, least_share: float = 0.012) -> list[str]:
    """Effects that move a visible share of any of the routes' energy, largest first.

    Energy that comes back counts too, so that speeding up and slowing down are seen although they
    cancel over the whole route.
    """
    share: dict[str, float] = {}
    for route in routes:
        steps = np.diff(route.arrays["t"], prepend=0.0)
        moved = {e: float(np.abs(w) @ steps) for e, w in route.watts_by_effect.items()}
        whole = sum(moved.values()) or 1.0
        for effect, value in moved.items():
            share[effect] = max(share.get(effect, 0.0), value / whole)
    return [e for e in sorted(share, key=lambda e: -share[e]) if share[e] >= least_share]


def grouped(values: Mapping[str, Array], effects: Sequence[str]) -> dict[str, Array]:
    """The chosen effects' values, and the sum of all others as "other" where it is not zero."""
    result = {effect: np.asarray(values[effect], float) for effect in effects if effect in values}
    rest = [np.asarray(value, float) for effect, value in values.items() if effect not in result]
    other = np.sum(rest, axis=0) if rest else np.zeros(1)
    if np.any(np.abs(other) > 1e-9):
        result[OTHER] = other
    return result


def nice_ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round numbers from low to high, about ``count`` of them."""
    span = high - low
    if not span > 0:
        return [low]
    raw = span / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def tick_words(ticks: Sequence[float]) -> list[str]:
    """Ticks written with the digits of their step, so that neighbours differ; zero has no sign."""
    step = min((b - a for a, b in itertools.pairwise(ticks)), default=0.0)
    if step <= 0:
        return [f"{value:zg}" for value in ticks]
    power = math.floor(math.log10(step) + 1e-9)
    # Steps of 2.5 have a digit more.
    digits = max(0, -power + (abs(step / 10.0**power - 2.5) < 1e-6))
    return [f"{value:z.{digits}f}" for value in ticks]


def width_of(words: str, size: float = 11.0) -> float:
    """Pixels of words in a chart, rather too many: those of DejaVu Sans, the widest of its kind."""
    narrow = sum(letter in " .,:;'|ijl-−" for letter in words)
    broad = sum(letter in "+%mwMW…" for letter in words)
    return size * (0.38 * narrow + 0.64 * (len(words) - narrow - broad) + 1.0 * broad)


def shortened(words: str, room: float) -> str:
    """Words cut off where the room, in pixels, ends."""
    kept = words
    while kept and width_of(kept if kept == words else kept + "…") > room:
        kept = kept[:-1]
    return words if kept == words else f"{kept.rstrip()}…"


@dataclass(frozen=True)
class Axes:
    """Maps a chart's numbers to its pixels.

    Attributes:
        width, height: pixels, without what stands below.
        x_range, y_range: the numbers at the ends.
        names: stand at their places instead of numbers on the level axis.
    """

    width: int
    height: int
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    names: Mapping[float, str] | None = None

    @cached_property
    def _upright(self) -> dict[float, str]:
        ticks = nice_ticks(*self.y_range, count=4)
        return dict(zip(ticks, tick_words(ticks), strict=True))

    @cached_property
    def _level(self) -> dict[float, str]:
        if self.names is not None:
            room = (self.width - LEFT - RIGHT) / max(len(self.names), 1)
            return {place: shortened(name, room) for place, name in self.names.items()}
        ticks = nice_ticks(*self.x_range, count=max(3, min(8, self.width // 70)))
        return dict(zip(ticks, tick_words(ticks), strict=True))

    @cached_property
    def left(self) -> float:
        """Pixels left of the frame: the label, which stands upright, and the numbers."""
        widest = max(map(width_of, self._upright.values()), default=0.0)
        return max(float(LEFT), _LABEL + widest + 6.0)

    @cached_property
    def right(self) -> float:
        """Pixels right of the frame: half of a number that stands under its end."""
        last = [*self._level.values()][-1:]
        named = self.names is not None and max(self.names, default=0.0) < self.x_range[1]
        return float(RIGHT) if named else max([RIGHT, *(0.5 * width_of(words) for words in last)])

    def x(self, value: Array | float) -> Array:
        """Pixels from the left."""
        low, high = self.x_range
        inner = self.width - self.left - self.right
        return self.left + (np.asarray(value, float) - low) / (high - low or 1.0) * inner

    def y(self, value: Array | float) -> Array:
        """Pixels from the top."""
        low, high = self.y_range
        inner = self.height - TOP - BOTTOM
        return TOP + (high - np.asarray(value, float)) / (high - low or 1.0) * inner

    def points(self, xs: Array, ys: Array) -> str:
        """A polyline's points."""
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(self.x(xs), self.y(ys), strict=True))

    def frame(self, x_label: str, y_label: str) -> str:
        """Grid, numbers and labels."""
        parts = []
        end = self.width - self.right
        for value, words in self._upright.items():
            y = float(self.y(value))
            parts.append(
                f'<line x1="{self.left:.1f}" x2="{end:.1f}" y1="{y:.1f}" y2="{y:.1f}" '
                f'class="{"zero" if value == 0 else "grid"}"/>'
                f'<text x="{self.left - 6:.1f}" y="{y + 3.5:.1f}" text-anchor="end">{words}</text>'
            )
        for value, words in self._level.items():
            x = float(self.x(value))
            parts.append(
                f'<text x="{x:.1f}" y="{self.height - 10}" text-anchor="middle">'
                f"{plain(words)}</text>"
            )
        middle = TOP + (self.height - TOP - BOTTOM) / 2
        parts.append(
            f'<text class="label" transform="translate(11 {middle:.0f}) rotate(-90)" '
            f'text-anchor="middle">{plain(y_label)}</text>'
            f'<text class="label" x="{end:.1f}" y="{self.height + 3}" '
            f'text-anchor="end">{plain(x_label)}</text>'
        )
        return "".join(parts)

    def svg(self, content: str, title: str, description: str = "") -> str:
        """The finished chart; the description is for those who cannot see it."""
        (x0, x1), (y0, y1) = self.x_range, self.y_range
        inner = f"{self.left:.1f},{TOP},{self.width - self.right:.1f},{self.height - BOTTOM}"
        placed = f'data-range="{x0},{x1},{y0},{y1}" data-inner="{inner}"'
        return chart(self.width, self.height + 7, content, title, description, placed=placed)


def chart(
    width: int,
    height: float,
    content: str,
    title: str,
    description: str = "",
    *,
    kind: str = "chart",
    placed: str = "",
) -> str:
    """A drawing of a page as SVG, not drawn much larger than its numbers can be read.

    Args:
        width, height: in pixels.
        content: elements.
        title, description: for those who cannot see it; the title shows under the pointer too.
        kind: classes of the style sheet.
        placed: further attributes.
    """
    told = f"<desc>{plain(description)}</desc>" if description else ""
    return (
        f'<svg class="{kind}" viewBox="0 0 {width} {height:.0f}" role="img" '
        f'style="max-width:{1.2 * width:.0f}px" {placed}>'
        f"<title>{plain(title)}</title>{told}{content}</svg>"
    )


def padded(low: float, high: float, share: float = 0.08) -> tuple[float, float]:
    """A range with some room at both ends."""
    room = max(share * (high - low), 1e-6)
    return low - room, high + room


def thinned(count: int, most: int = 1200) -> NDArray[np.int64]:
    """At most ``most`` of ``count`` indices, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


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
            floor = height - BOTTOM
            first, last = axes.x(0.0), axes.x(route.distance_m[-1])
            area = f"{first:.1f},{floor} {line} {last:.1f},{floor}"
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


def power_chart(route: Route, effects: Sequence[str], *, width: int = 1000) -> str:
    """Power along the way, stacked by effect, and its total as a line."""
    height = 270
    along, watts = mean_power(route)
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
    scale = (width - left - right_room) / ((most - least) or 1.0)
    zero = left - least * scale
    height = len(routes) * (bar + gap) + 8
    parts = [f'<line x1="{zero:.1f}" x2="{zero:.1f}" y1="0" y2="{height}" class="zero"/>']
    for row, (name, stack) in enumerate(stacks.items()):
        y = 6 + row * (bar + gap)
        parts.append(
            f'<text x="{left - 12}" y="{y + bar / 2 + 4:.1f}" text-anchor="end">{name}</text>'
        )
        right = left_end = zero
        for effect, value in stack.items():
            size = abs(float(value)) * scale
            if size < 0.05:
                continue
            x = right if value > 0 else left_end - size
            right, left_end = (right + size, left_end) if value > 0 else (right, left_end - size)
            what = plain(f"{titles.get(effect, effect)}: {joules(float(value))}")
            parts.append(
                f'<rect x="{x:.1f}" y="{y}" width="{size:.1f}" height="{bar}" '
                f'fill="{colour_of(effect)}" class="band"><title>{what}</title></rect>'
            )
        parts.append(
            f'<text x="{right + 8:.1f}" y="{y + bar / 2 + 4:.1f}" class="strong">'
            f"{joules(routes[name].energy_j)}</text>"
        )
    return chart(width, height, "".join(parts), "Energy by effect", kind="chart bars")


def _as_arrays(values: Mapping[str, float]) -> dict[str, Array]:
    return {name: np.asarray(value, float) for name, value in values.items()}
