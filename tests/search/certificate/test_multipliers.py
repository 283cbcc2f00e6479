"""Prices of force: within their table, dearer uphill, milder round bad cells."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.certificate.multipliers import best_prices, milder
from planner.search.certificate.price_table import PriceField, even_table
from tests.search.certificate.robots import STEEPEST, priced_of


def test_prices_are_of_the_table_on_any_slope() -> None:
    """Also where both slopes are the steepest, which is beyond what can be driven."""
    _, priced = priced_of("minibalance", 0.0)
    best = best_prices(even_table(priced), STEEPEST)
    shares, across = best.table[..., 0], best.table[..., 1]
    assert (shares >= priced.shares[0]).all()
    assert (shares <= priced.shares[-1]).all()
    assert (np.abs(across) <= priced.cross[-1] + 1e-12).all()
    # The steeper the climb, the dearer is force along it.
    assert (np.diff(shares[len(shares) // 2 :], axis=0) >= -1e-9).all()


def test_prices_get_milder_round_a_single_bad_cell() -> None:
    """On fine cells as well: one ledge between racks must not leave the quick floor alone."""
    _, priced = priced_of("minibalance", 0.0)
    table, best = even_table(priced), best_prices(even_table(priced), STEEPEST)
    even = np.full((121, 121), 1.3)
    none = np.zeros_like(even)
    bad = np.zeros((120, 120), bool)
    bad[60, 60] = True
    for cell in (1.0, 0.25, 0.1):
        before = PriceField(even, even, none, none)
        after = milder(table, before, bad, best.level, (cell, cell)).share - 1.0
        assert after[60:62, 60:62].max() < 0.75 * 0.3
        assert after[0, 0] == pytest.approx(0.3, abs=1e-3)
        # Prices change slowly: where they fall fast, the robot's own motion pays for driving.
        steepest = np.hypot(*np.gradient(after, cell)).max()
        assert 0.5 * table.robot.moving * table.robot.speed**2 * steepest < 0.5 * best.level
