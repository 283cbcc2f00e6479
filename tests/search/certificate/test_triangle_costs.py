"""Ranges of slope and height hold for the whole cell."""

from __future__ import annotations

import numpy as np

from planner.search.certificate.triangle_costs import cell_ranges
from planner.terrain.interpolation import interpolate_many


def test_slopes_and_heights_of_a_cell_stay_in_their_range() -> None:
    """Bernstein coefficients against the surface itself, at random points of rough ground."""
    rng = np.random.default_rng(8)
    heights = rng.normal(0.0, 0.3, (12, 14))
    ranges = cell_ranges(heights, 0.5, 0.7)
    x, y = rng.uniform(1.0, 12.0, 4000), rng.uniform(1.0, 10.0, 4000)
    z, px, py = interpolate_many(heights, 0.0, 0.0, 0.5, 0.7, 0.5 * x, 0.7 * y)
    cell = ranges[np.floor(y).astype(int) - 1, np.floor(x).astype(int) - 1]
    for value, low, high in ((px, 0, 1), (py, 2, 3), (z, 4, 5)):
        assert (value >= cell[:, low] - 1e-12).all()
        assert (value <= cell[:, high] + 1e-12).all()
