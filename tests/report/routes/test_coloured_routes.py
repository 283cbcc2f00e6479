"""The front as a curve and as routes on a map: points lie where their figures are."""

from __future__ import annotations

import pytest

from tests.report.synthetic import SVG, drawing, front


def test_a_front_falls_from_fast_to_frugal() -> None:
    curve = drawing(front(), "curve")
    dots = list(curve.iter(f"{SVG}circle"))
    across, down = ([float(e.attrib[k]) for e in dots] for k in ("cx", "cy"))
    assert across == sorted(across)
    assert down == sorted(down)
    # 12, 16 and 24 s, and 400, 320 and 160 J, are evenly spaced as numbers are.
    assert (across[1] - across[0]) / (across[2] - across[0]) == pytest.approx(1 / 3, abs=0.01)
    assert (down[1] - down[0]) / (down[2] - down[0]) == pytest.approx(1 / 3, abs=0.01)
    assert dots[0].findtext(f"{SVG}title") == "400.0 J in 12.0 s, best from 40 W"
    assert len([*drawing(front(), "map").iter(f"{SVG}polyline")]) == 6
    assert front().svg() == front().figure("front").svg
