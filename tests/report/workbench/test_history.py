"""The history of a model as a table and a picture."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from planner.errors import RequestError
from planner.report import write_report
from tests.report.workbench.reading import SVG, rows_of, tree, words
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import Material


def test_history_as_a_table_and_a_picture(pages: dict[str, str], made: Material) -> None:
    rows = rows_of(pages["model"], "Version by version")
    assert [row[2] for row in rows[1:]] == ["fit", "adopt air_drag", "back to version 1"]
    assert rows[2][4:] == ["7", "2.00 W", "1.00 W", "0.50 W", "2026-05-04 12:34"]
    drawing = ElementTree.fromstring(results.model(made).figure("history").svg)
    dots = [e for e in drawing.iter(f"{SVG}circle") if "solid" in e.attrib["class"]]
    rings = [e for e in drawing.iter(f"{SVG}circle") if "hollow" in e.attrib["class"]]
    assert (len(dots), len(rings)) == (3, 1)
    noise = next(e for e in drawing.iter(f"{SVG}rect"))
    zero = float(noise.attrib["y"]) + float(noise.attrib["height"])
    # Half a watt of noise lies half as high as one watt of error.
    high = zero - float(dots[1].attrib["cy"])
    assert float(noise.attrib["height"]) == pytest.approx(0.5 * high, abs=0.2)
    # Versions on different logs are not joined: the one line is that from ring to dot.
    lines = [e for e in drawing.iter(f"{SVG}line") if e.attrib["class"].startswith("after")]
    assert len(lines) == 1


def test_a_model_without_history_says_so(made: Material, tmp_path: Path) -> None:
    write_report(made.base.model, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "has no history" in words(tree(page))
    assert made.base.model.figures() == ()
    with pytest.raises(RequestError, match="no history"):
        made.base.model.figure("history")
