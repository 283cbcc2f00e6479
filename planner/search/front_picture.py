"""A front as a picture: energy over duration, and the map with all routes in the same colours."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING

import numpy as np

from planner.search.pictures import scale_bar
from planner.search.relief_image import as_data_url, relief_image, window_round
from planner.search.wording import joules, seconds

if TYPE_CHECKING:
    from planner.search.front import Front, FrontPoint

WIDTH, CHART = 380, 300
LEFT, RIGHT, TOP, BOTTOM = 64, 16, 16, 42
FAST, FRUGAL = (185, 28, 28), (21, 128, 61)
_TEXT = 'font-family="system-ui,sans-serif" font-size="11" fill="#374151"'


def colour_of(place: int, count: int) -> str:
    """Colour of a route by its place in the front, from the fastest, red, to the last, green."""
    share = place / max(count - 1, 1)
    mixed = (round(a + (b - a) * share) for a, b in zip(FAST, FRUGAL, strict=True))
    return "#{:02x}{:02x}{:02x}".format(*mixed)


def front_svg(front: Front) -> str:
    """The curve on the left and the map on the right, as one SVG element.

    Args:
        front: with at least one point.
    """
    ground, height = _map(front)
    whole = max(height, CHART)
    name = html.escape(front.terrain.name)
    return (
        f'<svg class="front" viewBox="0 0 {2 * WIDTH} {whole:.0f}" role="img" '
        'xmlns="http://www.w3.org/2000/svg">'
        f"<title>Energy over duration, and the routes on {name}</title>"
        f'{_curve(front.points)}<g transform="translate({WIDTH} 0)">{ground}</g></svg>'
    )


def _curve(points: tuple[FrontPoint, ...]) -> str:
    times = np.array([point.route.duration_s for point in points])
    energies = np.array([point.route.energy_j for point in points])
    x0, x1 = _padded(times)
    y0, y1 = _padded(energies)
    xs = LEFT + (times - x0) / (x1 - x0) * (WIDTH - LEFT - RIGHT)
    ys = TOP + (y1 - energies) / (y1 - y0) * (CHART - TOP - BOTTOM)
    parts = []
    for value in _ticks(x0, x1):
        x = LEFT + (value - x0) / (x1 - x0) * (WIDTH - LEFT - RIGHT)
        parts.append(
            f'<path d="M{x:.1f},{TOP}V{CHART - BOTTOM}" stroke="#e5e7eb"/>'
            f'<text x="{x:.1f}" y="{CHART - BOTTOM + 15}" text-anchor="middle" {_TEXT}>'
            f"{value:g}</text>"
        )
    for value in _ticks(y0, y1):
        y = TOP + (y1 - value) / (y1 - y0) * (CHART - TOP - BOTTOM)
        parts.append(
            f'<path d="M{LEFT},{y:.1f}H{WIDTH - RIGHT}" stroke="#e5e7eb"/>'
            f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end" {_TEXT}>{value:g}</text>'
        )
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(xs, ys, strict=True))
    parts.append(f'<polyline points="{line}" fill="none" stroke="#9ca3af" stroke-width="1.5"/>')
    for k, (point, x, y) in enumerate(zip(points, xs, ys, strict=True)):
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" fill="{colour_of(k, len(points))}" '
            f'stroke="#fff" stroke-width="1.5"><title>{html.escape(told(point))}</title></circle>'
        )
    parts.append(
        f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{CHART - 8}" text-anchor="middle" {_TEXT}>'
        "duration (s)</text>"
        f'<text transform="translate(13 {(TOP + CHART - BOTTOM) / 2:.0f}) rotate(-90)" '
        f'text-anchor="middle" {_TEXT}>energy (J)</text>'
    )
    return "".join(parts)


def told(point: FrontPoint) -> str:
    """A point in words: "845.2 J in 32.7 s, best from 20 W to 118 W"."""
    low, high = point.price_w
    prices = f"from {low:.3g} W" + (f" to {high:.3g} W" if math.isfinite(high) else "")
    return f"{joules(point.route.energy_j)} in {seconds(point.route.duration_s)}, best {prices}"


def _map(front: Front) -> tuple[str, float]:
    """Elements of the map and its height in pixels."""
    routes = [point.route for point in front.points]
    xs, ys = (np.concatenate([route.arrays[k] for route in routes]) for k in ("x", "y"))
    window = window_round(front.terrain, xs, ys)
    x0, _, x1, y1 = window
    scale = WIDTH / (x1 - x0)
    height = (window[3] - window[1]) * scale
    relief = as_data_url(relief_image(front.terrain, window, pixels=2 * WIDTH))
    parts = [
        f'<image href="{relief}" width="{WIDTH}" height="{height:.1f}" preserveAspectRatio="none"/>'
    ]
    for k, route in reversed([*enumerate(routes)]):
        line = " ".join(
            f"{(x - x0) * scale:.1f},{(y1 - y) * scale:.1f}"
            for x, y in zip(route.arrays["x"], route.arrays["y"], strict=True)
        )
        for colour, width in (("#fff", 4.5), (colour_of(k, len(routes)), 2.5)):
            parts.append(
                f'<polyline points="{line}" fill="none" stroke="{colour}" '
                f'stroke-width="{width}" stroke-linejoin="round"/>'
            )
    return "".join(parts) + scale_bar(x1 - x0, WIDTH, height), height


def _padded(values: np.ndarray) -> tuple[float, float]:
    room = max(0.08 * float(np.ptp(values)), 1e-3 * float(np.abs(values).max()), 1e-9)
    return float(values.min()) - room, float(values.max()) + room


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers between two, four or so."""
    raw = (high - low) / 4
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= raw)
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
