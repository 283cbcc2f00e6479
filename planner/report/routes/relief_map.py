"""A part of a map from above: its relief, marks upon it in metres, and a bar with a length.

ground = ground_axes(window_around(terrain, xs, ys), 720)
relief_map(terrain, ground, ground.line(xs, ys, "route"), "Relief with a route")
"""

from __future__ import annotations

import html
import math

import numpy as np

from planner.arrays import Array
from planner.report.axes import Axes
from planner.report.drawing import chart
from planner.report.routes.relief_image import Window, as_data_url, relief_image
from planner.terrain.heightmap import Terrain


def window_around(terrain: Terrain, xs: Array, ys: Array) -> Window:
    """The part of a map worth showing: points with room around them, no flatter than 1 : 2.

    Args:
        terrain: the map.
        xs, ys: (n,) m, what must be seen.

    Returns:
        xmin, ymin, xmax, ymax in m, inside the map.
    """
    west, south, east, north = terrain.extent
    room = 0.12 * max(np.ptp(xs), np.ptp(ys)) + 6 * max(terrain.cell)
    wide, high = np.ptp(xs) + 2 * room, np.ptp(ys) + 2 * room
    wide, high = max(wide, high / 2), max(high, wide / 2)
    x, y = (xs.min() + xs.max()) / 2, (ys.min() + ys.max()) / 2
    return (
        float(max(west, x - wide / 2)),
        float(max(south, y - high / 2)),
        float(min(east, x + wide / 2)),
        float(min(north, y + high / 2)),
    )


def ground_axes(window: Window, width: int) -> Axes:
    """Metres of a map to pixels, as long in both directions.

    Args:
        window: xmin, ymin, xmax, ymax in m.
        width: pixels.
    """
    x0, y0, x1, y1 = window
    height = (y1 - y0) * width / (x1 - x0)
    return Axes(width, height, (x0, x1), (y0, y1), inner=(0.0, 0.0, float(width), height))


def relief_map(terrain: Terrain, ground: Axes, content: str, title: str) -> str:
    """The part of a map that axes show, with marks upon it.

    Args:
        terrain: the map.
        ground: from ``ground_axes``.
        content: marks as SVG elements.
        title: for those who cannot see it.
    """
    (x0, x1), (y0, y1) = ground.x_range, ground.y_range
    width, height = ground.width, ground.height
    pixels = int(min(1000, 2 * width))
    relief = as_data_url(relief_image(terrain, (x0, y0, x1, y1), pixels=pixels))
    image = (
        f'<image href="{relief}" width="{width}" height="{height:.1f}" preserveAspectRatio="none"/>'
    )
    placed = f'data-x0="{x0}" data-y1="{y1}" data-scale="{width / (x1 - x0)}"'
    return chart(
        width, height, image + content + _scale_bar(ground), title, kind="map", placed=placed
    )


def whole_map(terrain: Terrain, *, width: int = 720) -> str:
    """A map's relief as SVG, with nothing upon it; ``width`` in pixels."""
    return relief_map(terrain, ground_axes(terrain.extent, width), "", f"Relief of {terrain.name}")


def outlined(ground: Axes, xs: Array, ys: Array, stroke: str, width: float, rim: float) -> str:
    """A line on the ground with a white rim that parts it from the relief.

    Args:
        ground: from ``ground_axes``.
        xs, ys: (n,) m.
        stroke: attributes of the line's stroke.
        width, rim: pixels, of the line and of the line with its rim.
    """
    points = ground.points(xs, ys)
    opaque = "" if rim - width > 2.5 else ' stroke-opacity=".55"'
    return (
        f'<polyline points="{points}" fill="none" stroke="#fff"{opaque} stroke-width="{rim}" '
        'stroke-linejoin="round" stroke-linecap="round"/>'
        f'<polyline points="{points}" fill="none" {stroke} stroke-width="{width}" '
        'stroke-linejoin="round"/>'
    )


def place_mark(ground: Axes, x: float, y: float, colour: str, words: str) -> str:
    """A dot at a place with words under the pointer."""
    return (
        f'<g><title>{html.escape(words)}</title><circle cx="{float(ground.x(x)):.1f}" '
        f'cy="{float(ground.y(y)):.1f}" r="6.5" fill="{colour}" stroke="#fff" '
        'stroke-width="2"/></g>'
    )


def _scale_bar(ground: Axes) -> str:
    """A bar with its length, for the lower left corner."""
    x0, x1 = ground.x_range
    target = (x1 - x0) / 5
    power = 10 ** math.floor(math.log10(target))
    length = max(m * power for m in (1, 2, 5) if m * power <= target)
    size = length / (x1 - x0) * ground.width
    words = f"{length:g} m" if length < 1000 else f"{length / 1000:g} km"
    y = ground.height - 14
    return (
        f'<g><rect x="10" y="{y - 16:.1f}" width="{size + 16:.1f}" height="24" rx="4" '
        'fill="#fff" fill-opacity=".8"/>'
        f'<path d="M18,{y - 4:.1f}v6h{size:.1f}v-6" fill="none" stroke="#111827" '
        'stroke-width="1.5"/>'
        f'<text x="{18 + size / 2:.1f}" y="{y - 3:.1f}" text-anchor="middle" font-size="11" '
        f'font-family="system-ui,sans-serif" fill="#111827">{words}</text></g>'
    )
