"""A matrix of energies as a coloured table: a row for each start, a column for each goal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.amounts import coordinates, joules
from planner.report.axes import Axes
from planner.report.drawing import chart, text, width_of
from planner.report.routes.route_map import hexadecimal, power_colour

if TYPE_CHECKING:
    from planner.search.matrix import Matrix
    from planner.search.requests import PoseRequest

READABLE = 12
"""Columns up to which cells hold their energies; smaller cells show them under the pointer."""
_LETTERS = 13.0
"""Pixels, size of the letters."""
_TOP = 24
"""Pixels above the cells, for the names of the columns."""


def place_words(place: PoseRequest) -> str:
    """A place by its coordinates in m: "2, 17.5"."""
    return coordinates(place.x, place.y)


def energy_words(energy: float) -> str:
    """An energy, or that there is no route."""
    return joules(energy) if np.isfinite(energy) else "no route"


def matrix_chart(matrix: Matrix) -> str:
    """Energies as cells, the darker the more; grey where there is no route."""
    energies = matrix.energy_j
    rows, columns = energies.shape
    known = energies[np.isfinite(energies)]
    least, most = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    # Energy given back has a colour of its own.
    low = max(least, 0.0)
    high = max(most, low + 1e-9)
    starts = [place_words(place) for place in matrix.starts]
    goals = [place_words(place) for place in matrix.goals]
    readable = columns <= READABLE
    left = 12.0 + max(width_of(words, _LETTERS) for words in [*starts, "start \\ goal"])
    words = [energy_words(float(energy)) for energy in energies.flat] + goals
    cell = 16.0 + max(width_of(said, _LETTERS) for said in words) if readable else 20.0
    tall = 32.0 if readable else 20.0
    width, height = left + cell * columns, _TOP + tall * rows
    inner = (left, float(_TOP), width, height)
    axes = Axes(width, height, (0.0, columns), (float(rows), 0.0), size=_LETTERS, inner=inner)
    parts = [text(0, 15, "start \\ goal")]
    if readable:
        parts += [text(axes.x(j + 0.5), 15, goal, anchor="middle") for j, goal in enumerate(goals)]
    for i, start in enumerate(starts):
        top, middle = axes.y(i), axes.y(i + 0.5) + 4.5
        parts.append(text(left - 8, middle, start, anchor="end"))
        for j, goal in enumerate(goals):
            fill, ink = _colours(float(energies[i, j]), low, high)
            said = energy_words(float(energies[i, j]))
            label = f"{start} to {goal}: {said}"
            parts.append(axes.bar(j, j + 1, top, tall, "band", rx=0, fill=fill, tooltip=label))
            if readable:
                look = {"fill": ink, "pointer_events": "none"}
                parts.append(text(axes.x(j + 0.5), middle, said, anchor="middle", **look))
    title = "Energy from every start to every goal"
    summary = f"From {joules(least)} to {joules(most)}." if len(known) else "No route at all."
    return chart(width, height + 2, "".join(parts), title, summary, kind="chart bars")


def _colours(energy: float, low: float, high: float) -> tuple[str, str]:
    """Colour of a cell, and of the words upon it."""
    if not np.isfinite(energy):
        return "#9ca3af", "#111827"
    colour = power_colour(energy, low, high)
    dark = np.dot((0.299, 0.587, 0.114), colour) < 140
    return hexadecimal(colour), "#fff" if dark else "#111827"
