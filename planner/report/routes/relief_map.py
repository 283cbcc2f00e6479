"""A part of a map from above: its relief, marks upon it in metres, and a bar with a length.

ground = ground_axes(window_around(terrain, xs, ys), 720)
relief_map(terrain, ground, ground.line(xs, ys, "route"), "Relief with a route")
"""

from __future__ import annotations

import math

import numpy as np

from planner.arrays import Array
from planner.report.axes import Axes
from planner.report.drawing import chart, circle, rectangle, text
from planner.report.markup import Attributes, Markup, element, joined
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


def relief_map(terrain: Terrain, ground: Axes, content: str, title: str) -> Markup:
    """The part of a map that axes show, with marks upon it.

    Args:
        terrain: the map.
        ground: from ``ground_axes``.
        content: marks as SVG elements.
        title: for those who cannot see it.
    """
    (x0, x1), (y0, y1) = ground.x_range, ground.y_range
    size: Attributes = {"width": ground.width, "height": ground.height}
    relief = as_data_url(
        relief_image(terrain, (x0, y0, x1, y1), pixels=int(min(1000, 2 * ground.width)))
    )
    image = element("image", href=relief, preserveAspectRatio="none", **size)
    parts = f"{image}{content}{_scale_bar(ground)}"
    # Exact, for the cursor of the page.
    scale: Attributes = {
        "data_x0": str(x0),
        "data_y1": str(y1),
        "data_scale": str(ground.width / (x1 - x0)),
    }
    return chart(**size, content=parts, title=title, kind="map", **scale)


def whole_map(terrain: Terrain, *, width: int = 720) -> Markup:
    """A map's relief as SVG, with nothing upon it; ``width`` in pixels."""
    return relief_map(terrain, ground_axes(terrain.extent, width), "", f"Relief of {terrain.name}")


def outlined(
    ground: Axes, xs: Array, ys: Array, colour: str, *, width: float = 2.5, dashes: str = ""
) -> Markup:
    """A line on the ground with a white rim that parts it from the relief.

    Args:
        ground: from ``ground_axes``.
        xs, ys: (n,) m.
        colour: of the line.
        width: of the line without its rim, pixels.
        dashes: as in stroke-dasharray; "" for a whole line.
    """
    shape = {"points": ground.points(xs, ys), "fill": "none", "stroke_linejoin": "round"}
    rim: Attributes = {"stroke": "#fff", "stroke_opacity": 0.55, "stroke_linecap": "round"}
    look = {"stroke": colour, "stroke_dasharray": dashes}
    return joined(
        element("polyline", **shape, **rim, stroke_width=width + 2),
        element("polyline", **shape, **look, stroke_width=width),
    )


def place_mark(ground: Axes, x: float, y: float, colour: str, words: str) -> Markup:
    """A dot at a place with words under the pointer."""
    return circle(
        ground.x(x), ground.y(y), 6.5, tooltip=words, fill=colour, stroke="#fff", stroke_width=2
    )


def _scale_bar(ground: Axes) -> Markup:
    """A bar with its length, for the lower left corner."""
    x0, x1 = ground.x_range
    target = (x1 - x0) / 5
    power = 10 ** math.floor(math.log10(target))
    length = max(m * power for m in (1, 2, 5) if m * power <= target)
    size = length / (x1 - x0) * ground.width
    words = f"{length:g} m" if length < 1000 else f"{length / 1000:g} km"
    y = ground.height - 14
    ink: Attributes = {"font_size": 11, "font_family": "system-ui,sans-serif", "fill": "#111827"}
    bar = f"M18,{y - 4:.1f}v6h{size:.1f}v-6"
    return joined(
        rectangle(10, y - 16, size + 16, 24, rx=4, fill="#fff", fill_opacity=0.8),
        element("path", d=bar, fill="none", stroke="#111827", stroke_width=1.5),
        text(18 + size / 2, y - 3, words, anchor="middle", **ink),
    )
