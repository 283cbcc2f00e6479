"""The ground below marks: which part of a map is shown, and where its metres lie."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from planner.report.routes.relief_map import (
    ground_axes,
    outlined,
    place_mark,
    relief_map,
    window_around,
)
from tests.report.synthetic import terrain


@pytest.mark.parametrize(
    ("xs", "ys"),
    [([8.0, 12.0], [5.0, 5.0]), ([10.0, 10.0], [3.0, 8.0]), ([0.5, 19.5], [0.5, 9.5])],
)
def test_a_window_holds_its_points_and_stays_on_the_map(xs: list[float], ys: list[float]) -> None:
    west, south, east, north = window_around(terrain(), np.array(xs), np.array(ys))
    xmin, ymin, xmax, ymax = terrain().extent
    assert xmin <= west < min(xs)
    assert max(xs) < east <= xmax
    assert ymin <= south < min(ys)
    assert max(ys) < north <= ymax


def test_a_metre_is_as_long_to_the_north_as_to_the_east() -> None:
    ground = ground_axes((2.0, 1.0, 12.0, 5.0), 500)
    assert ground.x(np.array([2.0, 3.0, 12.0])) == pytest.approx([0.0, 50.0, 500.0])
    assert ground.y(np.array([5.0, 4.0, 1.0])) == pytest.approx([0.0, 50.0, 200.0])


def test_a_map_says_where_its_metres_lie() -> None:
    ground = ground_axes((2.0, 1.0, 12.0, 5.0), 500)
    line = outlined(ground, np.array([2.0, 12.0]), np.array([1.0, 5.0]), "red")
    content = line + place_mark(ground, 7.0, 3.0, "red", "start")
    drawing = ElementTree.fromstring(relief_map(terrain(), ground, content, "A & B"))
    scale, x0, y1 = (float(drawing.attrib[f"data-{k}"]) for k in ("scale", "x0", "y1"))
    assert (scale, x0, y1) == (50.0, 2.0, 5.0)
    assert drawing.findtext("title") == "A & B"
    assert "start" in "".join(drawing.itertext())
    mark = next(drawing.iter("circle"))
    assert float(mark.attrib["cx"]) / scale + x0 == pytest.approx(7.0)
    assert y1 - float(mark.attrib["cy"]) / scale == pytest.approx(3.0)
    for drawn in drawing.iter("polyline"):
        ends = [tuple(map(float, p.split(","))) for p in drawn.attrib["points"].split()]
        assert ends == [(0.0, 200.0), (500.0, 0.0)]
