"""The even table: at the kinks that of dual_power, and minus infinity beyond its prices."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.certificate.dual_power import rotor_share
from planner.search.certificate.price_table import (
    even_table,
    least_at_rest,
    rotor_price,
    table_watts,
)
from tests.search.certificate.robots import priced_of


def test_both_kinks_of_the_rotors_price_are_nodes() -> None:
    """There the interpolated value is that of the power's own table."""
    _, priced = priced_of("minibalance", 0.0)
    table = even_table(priced)
    middle = int(np.abs(priced.cross).argmin())
    for kink in (2.0 - 1.0 / priced.robot.efficiency, 1.0 / priced.robot.efficiency):
        node = int(np.abs(priced.shares - kink).argmin())
        assert priced.shares[node] == pytest.approx(kink)
        value = table_watts(table, table.watts, kink, priced.cross[middle], priced.loads[0])
        assert value == pytest.approx(priced.watts[node, middle, 0])


def test_prices_beyond_the_table_are_worth_nothing() -> None:
    _, priced = priced_of("minibalance", 0.0)
    table = even_table(priced)
    least, most = priced.shares[[0, -1]]
    load = float(priced.loads[0])
    assert math.isfinite(table_watts(table, table.watts, 1.0, 0.0, load))
    for share, cross, at in (
        (least - 0.1, 0.0, load),
        (most + 0.1, 0.0, load),
        (1.0, 1.1 * priced.cross[-1], load),
        (1.0, 0.0, 0.9 * load),
        (1.0, 0.0, 1.1 * priced.loads[1]),
    ):
        assert table_watts(table, table.watts, share, cross, at) == -math.inf


def test_no_price_near_another_leaves_less_at_rest() -> None:
    _, priced = priced_of("minibalance", 0.0)
    table = even_table(priced)
    # All nodes that lie within the range.
    shares = table.low + table.step * np.arange(table.standing.shape[0])
    cross = table.cross + table.cross_step * np.arange(table.standing.shape[1])
    share, size = 1.2, 0.15
    near = table.standing[np.ix_(np.abs(shares - share) < size, np.abs(cross) < size)]
    assert near.size > 10
    assert least_at_rest(table, share, size) <= near.min()
    assert least_at_rest(table, share, size) >= table.standing.min()


def test_the_rotors_price_is_the_same_for_one_share_as_for_many() -> None:
    shares = np.linspace(0.3, 2.0, 50)
    one_by_one = [rotor_price(share, 0.8) for share in shares]
    np.testing.assert_allclose(one_by_one, rotor_share(shares, 0.8), rtol=1e-14)
