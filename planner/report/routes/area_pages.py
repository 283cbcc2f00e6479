"""Pages and cards about an area in reach and about a matrix of energies."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.amounts import joules, share
from planner.report.markup import figure, paragraph, section, table
from planner.report.routes.matrix_chart import energy_words, matrix_chart, place_words
from planner.report.routes.reach_map import reach_map
from planner.report.view import View

if TYPE_CHECKING:
    from planner.search.matrix import Matrix
    from planner.search.reach import Reach


def reach_view(reach: Reach) -> View:
    """The area that an energy reaches."""
    drawing = reach_map(reach)
    x, y = reach.start
    way = "there and back" if reach.and_back else "one way"
    lead = paragraph(
        f"{joules(reach.energy_j)} from ({x:.4g}, {y:.4g}) reach {_area(reach.area_m2)}, {way}.",
        "lead",
    )
    checked = f"{reach.checked} routes to the edge were driven in full"
    if not math.isnan(reach.error_share):
        checked += f"; the last round was off by at most {share(reach.error_share)}"
    content = lead + figure(drawing, f"{checked}.")
    title = f"{reach.terrain.name}: reach of {joules(reach.energy_j)}"
    return View(title, {"map": drawing}, (section("", content),), content)


def _area(area: float) -> str:
    return f"{area / 1e6:,.2f} km²" if area >= 1e6 else f"{area:,.0f} m²"


def matrix_view(matrix: Matrix) -> View:
    """Energies between places."""
    drawing = matrix_chart(matrix)
    rows, columns = matrix.energy_j.shape
    ways = int(np.isfinite(matrix.energy_j).sum())
    lead = paragraph(
        f"Energy from {_counted(rows, 'start')} to {_counted(columns, 'goal')}; "
        f"{ways} of {rows * columns} pairs have a route.",
        "lead",
    )
    driven = f"{int(matrix.driven.sum())} pairs were driven in full"
    if matrix.error_share > 0.0:
        driven += f"; nine of ten others are within {share(matrix.error_share)}"
    content = lead + figure(drawing, f"{driven}.")
    heads = ["start", *map(place_words, matrix.goals)]
    cells = [
        [place_words(start), *map(energy_words, row)]
        for start, row in zip(matrix.starts, matrix.energy_j.tolist(), strict=True)
    ]
    sections = (section("", content), section("Energies", table("", heads, cells)))
    return View("Energy matrix", {"energies": drawing}, sections, content)


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
