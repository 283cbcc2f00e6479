"""Which candidates count as alternatives, with routes made by hand instead of a search."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from planner.search.results import Route
from planner.search.results.energy_interval import EnergyDistribution
from planner.search.solve.alternatives import find_alternatives


def route(aside: float, *, energy: float, seconds: float = 100.0, scale: float = 1.0) -> Route:
    """From (0, 30) to (60, 30) by way of y = 30 + aside, times a scale."""
    x = np.linspace(0.0, 60.0, 241)
    y = 30.0 + aside * np.clip(np.minimum(x, 60.0 - x) / 5.0, 0.0, 1.0)
    arrays = {"x": scale * x, "y": scale * y, "z": 0.0 * x}
    return Route(
        energy, 0.0, 1.0, seconds, 60.0, lambda: EnergyDistribution(energy, 0.0), {}, arrays, {}
    )


def field(cell: float, scale: float = 1.0) -> SimpleNamespace:
    """What of a field is read: 60 m by 60 m times a scale."""
    count = round(60.0 / cell) + 1
    return SimpleNamespace(
        heights=np.zeros((count, count)), x0=0.0, y0=0.0, dx=cell * scale, dy=cell * scale
    )


def found(candidates: list[Route]) -> Callable[[np.ndarray], Route | None]:
    """A search that finds these, one after the other."""
    left = iter(candidates)
    return lambda _factor: next(left, None)


def test_order_and_limit_are_those_of_what_is_asked_for() -> None:
    """By time the costly quick routes count; by energy, the default, they are too dear."""
    best = route(0.0, energy=100.0, seconds=50.0)
    quick = route(12.0, energy=400.0, seconds=60.0)
    slow = route(-12.0, energy=110.0, seconds=90.0)
    middling = route(24.0, energy=90.0, seconds=55.0)
    by_time, note = find_alternatives(
        best,
        3,
        found([slow, quick, middling]),
        field(0.5),
        lambda r: r.duration_s,
    )
    assert by_time == (best, middling, quick)
    assert note is None
    by_energy, note = find_alternatives(best, 4, found([slow, quick, middling]), field(0.5))
    assert by_energy == (middling, best, slow)
    assert note is not None
    assert "1 cost over 50% more" in note


@pytest.mark.parametrize(
    ("cell", "scale", "aside", "differs"),
    [
        # Cells of 5 cm: six are 0.3 m, yet ways 1.2 m apart are one way, 1.8 m apart two.
        (0.05, 0.25, 4.8, False),
        (0.05, 0.25, 7.2, True),
        # Cells of 0.5 m: six are 3 m.
        (0.5, 1.0, 2.4, False),
        (0.5, 1.0, 3.6, True),
        # Cells of 20 m: six are 120 m, and ways 80 m apart are two.
        (0.5, 40.0, 1.0, False),
        (0.5, 40.0, 2.0, True),
        # Cells of 75 m: nothing closer than two of them can be told apart.
        (0.5, 150.0, 0.9, False),
        (0.5, 150.0, 1.6, True),
    ],
)
def test_how_far_apart_two_paths_are(
    cell: float, scale: float, aside: float, differs: bool
) -> None:
    best = route(0.0, energy=100.0, scale=scale)
    other = route(aside, energy=101.0, scale=scale)
    routes, _ = find_alternatives(best, 2, found([other]), field(cell / min(scale, 1.0), scale))
    assert (other in routes) == differs
