"""Bars have the length of their figures."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from tests.report.workbench.reading import SVG
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import Material


def test_errors_are_drawn_to_scale_against_the_noise(made: Material) -> None:
    drawing = ElementTree.fromstring(results.diagnosis(made).figure("errors").svg)
    bars = [e for e in drawing.iter(f"{SVG}rect") if "solid" in e.attrib["class"]]
    widths = [float(bar.attrib["width"]) for bar in bars]
    assert widths[1] / widths[0] == pytest.approx(0.678 / 2.345, rel=1e-2)
    noise = next(e for e in drawing.iter(f"{SVG}line"))
    assert float(noise.attrib["x1"]) / widths[0] == pytest.approx(0.4321 / 2.345, rel=1e-2)
    shown = " ".join(drawing.itertext())
    for text in ("2.35 W", "0.68 W", "0.43 W", "with slope_offset corrected + air_drag"):
        assert text in shown


def test_shares_of_the_error_are_drawn_to_scale(made: Material) -> None:
    drawing = ElementTree.fromstring(results.diagnosis(made).figure("shares").svg)
    bars = [e for e in drawing.iter(f"{SVG}rect") if "solid" in e.attrib["class"]]
    widths = [float(bar.attrib["width"]) for bar in bars]
    for width, part in zip(widths, [0.2, 0.41, 0.8, 0.59], strict=True):
        assert width / widths[0] == pytest.approx(part / 0.2, rel=1e-2)
