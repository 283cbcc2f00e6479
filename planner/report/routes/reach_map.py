"""The map of a reachable area: relief, the area and its edge, and the start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.report.markup import Attributes, element, joined
from planner.report.routes.relief_map import ground_axes, place_mark, relief_map, window_around
from planner.report.routes.route_map import START

if TYPE_CHECKING:
    from planner.search.reach import Reach

AREA = "#1d4ed8"


def reach_map(reach: Reach, *, width: int = 720) -> str:
    """The area that an energy reaches as SVG; an area of nothing shows the start alone.

    Args:
        reach: what to draw.
        width: in pixels.
    """
    x, y = reach.start
    edge = np.vstack([*reach.outlines, np.array([reach.start])])
    ground = ground_axes(window_around(reach.terrain, edge[:, 0], edge[:, 1]), width)
    # One path, so that lines around holes leave them open.
    edges = (ground.points(line[:, 0], line[:, 1]) for line in reach.outlines)
    path = "".join(f"M{edge.replace(' ', 'L')}Z" for edge in edges)
    shade: Attributes = {"fill": AREA, "fill_opacity": 0.2, "fill_rule": "evenodd"}
    rim: Attributes = {"stroke": "#fff", "stroke_width": 4.5, "stroke_opacity": 0.7}
    area = [
        element("path", d=path, **shade, **rim),
        element("path", d=path, fill="none", stroke=AREA, stroke_width=2),
    ]
    marks = joined(*(area if path else ()), place_mark(ground, x, y, START, "start"))
    return relief_map(reach.terrain, ground, marks, f"Area in reach on {reach.terrain.name}")
