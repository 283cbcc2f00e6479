"""Charts of the residual: curves lie where their figures are."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from tests.report.workbench.reading import SVG
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import Material


def test_outside_the_ring_the_robot_needs_more(made: Material) -> None:
    drawing = ElementTree.fromstring(results.comparison(made).figure("heading").svg)
    rings = [e for e in drawing.iter(f"{SVG}circle") if "fill" not in e.attrib]
    zero = next(e for e in rings if e.attrib["class"] == "zero")
    x, y, radius = (float(zero.attrib[k]) for k in ("cx", "cy", "r"))
    # Half a watt more at 0 rad, forward, which is up; half a watt less at 90°, to the left.
    forward, left = [e for e in rings if e.attrib["class"] == "before solid"]
    assert float(forward.attrib["cx"]) == pytest.approx(x, abs=0.2)
    assert y - float(forward.attrib["cy"]) > radius + 5
    assert float(left.attrib["cy"]) == pytest.approx(y, abs=0.2)
    assert 0 < x - float(left.attrib["cx"]) < radius - 5


def test_a_curve_lies_where_its_figures_are(made: Material) -> None:
    drawing = ElementTree.fromstring(results.comparison(made).figure("speed").svg)
    x0, x1, y0, y1 = map(float, drawing.attrib["data-range"].split(","))
    left, top, right, bottom = map(float, drawing.attrib["data-inner"].split(","))
    line = next(e for e in drawing.iter(f"{SVG}polyline"))
    places = [tuple(map(float, p.split(","))) for p in line.attrib["points"].split()]
    for (px, py), (x, y) in zip(places, [(0.1, 0.0), (0.2, 1.0), (0.3, 2.0)], strict=True):
        assert px == pytest.approx(left + (x - x0) / (x1 - x0) * (right - left), abs=0.1)
        assert py == pytest.approx(bottom - (y - y0) / (y1 - y0) * (bottom - top), abs=0.1)


def test_a_claim_is_drawn_through_the_dots(made: Material) -> None:
    drawing = ElementTree.fromstring(results.diagnosis(made).figure("curve").svg)
    _, _, y0, y1 = map(float, drawing.attrib["data-range"].split(","))
    _, top, _, bottom = map(float, drawing.attrib["data-inner"].split(","))
    line = next(e for e in drawing.iter(f"{SVG}polyline") if e.attrib["class"] == "after line")
    places = [tuple(map(float, p.split(","))) for p in line.attrib["points"].split()]
    dots = [e for e in drawing.iter(f"{SVG}circle") if e.attrib["class"] == "before solid"]
    assert len(dots) == len(places) > 5
    # The log lies 0.05 W above the claim in this made-up result.
    above = 0.05 / (y1 - y0) * (bottom - top)
    for dot, (x, y) in zip(dots, places, strict=True):
        assert float(dot.attrib["cx"]) == pytest.approx(x, abs=0.2)
        assert y - float(dot.attrib["cy"]) == pytest.approx(above, abs=0.2)
