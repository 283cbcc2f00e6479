"""The map of a route: its window, its places, its colours of power."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import pytest

from planner.report.routes.route_map import (
    coloured_pieces,
    map_svg,
    power_colour,
    routes_of,
    window_of,
)
from tests.report.synthetic import answer, route, terrain


def test_coloured_pieces_cover_every_step_once() -> None:
    one = route()
    watts = one.arrays["watts"].copy()
    watts[10:15] = -3.0
    changed = replace(one, arrays={**one.arrays, "watts": watts})
    pieces = list(coloured_pieces(changed))
    steps = [step for _, run in pieces for step in zip(run, run[1:], strict=False)]
    assert steps == [(k, k + 1) for k in range(len(watts) - 1)]
    given_back = "#266edc"
    assert [run for colour, run in pieces if colour == given_back] == [list(range(9, 15))]


def test_more_power_is_darker() -> None:
    brightness = [sum(power_colour(w, 0.0, 10.0)) for w in (0.0, 3.0, 7.0, 10.0)]
    assert brightness == sorted(brightness, reverse=True)
    assert power_colour(99.0, 0.0, 10.0) == power_colour(10.0, 0.0, 10.0)


def test_the_window_holds_the_route_and_stays_on_the_map() -> None:
    west, south, east, north = window_of(terrain(), routes_of(answer()).values())
    assert west <= 2.0
    assert east >= 18.0
    xmin, ymin, xmax, ymax = terrain().extent
    assert xmin <= west
    assert ymin <= south
    assert east <= xmax
    assert north <= ymax


def test_the_route_lies_where_the_map_says() -> None:
    drawing = ElementTree.fromstring(map_svg(answer(), width=500))
    scale, x0, y1 = (float(drawing.attrib[f"data-{k}"]) for k in ("scale", "x0", "y1"))
    circles = [e for e in drawing.iter() if e.tag.endswith("circle")]
    start = circles[0]
    assert float(start.attrib["cx"]) / scale + x0 == pytest.approx(2.0, abs=0.02)
    assert y1 - float(start.attrib["cy"]) / scale == pytest.approx(5.0, abs=0.02)
