"""The matrix of energies as a picture."""

from __future__ import annotations

from tests.report.synthetic import SVG, drawing, matrix


def test_cells_of_a_matrix_are_darker_where_energy_is_larger() -> None:
    cells = list(drawing(matrix(), "energies").iter(f"{SVG}rect"))
    said = [e.findtext(f"{SVG}title") or "" for e in cells]
    assert said[1] == "2, 3 to 3, 3: 200.0 J"
    assert said[-1] == "3, 3 to 4, 3: no route"
    fills = [e.attrib["fill"] for e in cells]
    brightness = [sum(bytes.fromhex(fill[1:])) for fill in fills[1:-1]]
    assert brightness == sorted(brightness, reverse=True)
    assert fills[0] == "#266edc"  # gives energy back, as on the map of a route
    words = " ".join(drawing(matrix(), "energies").itertext())
    assert "500.0 J" in words
    # Cells too small for words tell them under the pointer only.
    assert "500.0 J" not in [e.text for e in drawing(matrix(20), "energies").iter(f"{SVG}text")]
