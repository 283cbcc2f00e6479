"""Fronts, matrices and areas in reach as pictures, cards and pages: all well-formed."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.search.front import Front
from planner.search.matrix import Matrix
from planner.search.reach import Reach
from tests.report.synthetic import MODEL, SVG, drawing, front, matrix, reach, terrain


@pytest.mark.parametrize(
    ("result", "names"),
    [
        (front(), ("front", "curve", "map")),
        (reach(), ("map",)),
        (matrix(), ("energies",)),
        (Front("no_route", terrain(), MODEL, reason="a <wall>"), ()),
        (replace(reach(), outlines=(), area_m2=0.0), ("map",)),
        (matrix(20), ("energies",)),
        (replace(matrix(), energy_j=np.full((2, 3), math.inf)), ("energies",)),
    ],
)
def test_all_is_well_formed(
    result: Front | Reach | Matrix, names: tuple[str, ...], tmp_path: Path
) -> None:
    assert result.figures() == names
    for name in names:
        assert drawing(result, name).findtext(f"{SVG}title")
    ElementTree.fromstring(result._repr_html_())
    result.write_report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    ElementTree.fromstring(page.replace("<!DOCTYPE html>", "", 1))
    assert not re.search(r"\b(nan|inf)\b", page)
