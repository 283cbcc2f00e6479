"""The area in reach as a map."""

from __future__ import annotations

import pytest

from tests.report.synthetic import SVG, drawing, reach


def test_the_area_in_reach_lies_where_the_map_says() -> None:
    ground = drawing(reach(), "map")
    scale, x0, y1 = (float(ground.attrib[f"data-{k}"]) for k in ("scale", "x0", "y1"))
    area = next(e for e in ground.iter(f"{SVG}path") if e.attrib.get("fill-rule") == "evenodd")
    outer, hole = area.attrib["d"].rstrip("Z").split("Z")
    for line, half in ((outer, 3.0), (hole, 1.0)):
        x, y = map(float, line[1:].split("L")[0].split(","))
        assert x / scale + x0 == pytest.approx(10.0 - half, abs=0.02)
        assert y1 - y / scale == pytest.approx(5.0 - half, abs=0.02)
    assert "150.0 J from (8, 5) reach 32 m², there and back." in reach()._repr_html_()
