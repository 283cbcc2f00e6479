"""The lower convex hull of energy over duration, against the best at every price."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from planner.search.results import Route
from planner.search.tradeoff.hull import chord_price, lower_hull
from planner.search.tradeoff.weighted_objective import DrivenRoute


def made(seconds: float, joules: float) -> DrivenRoute:
    """A route of which only duration and energy count."""
    t = np.array([0.0, seconds])
    arrays = {"t": t, "watts": np.array([0.0, joules / seconds])}
    return DrivenRoute(
        Route(joules, 0.0, 0.0, seconds, 1.0, lambda: None, {}, arrays, {}), (), (), 1.0
    )


def test_the_hull_leaves_out_what_no_price_asks_for():
    corner = [made(10.0, 300.0), made(12.0, 200.0), made(20.0, 100.0)]
    dent, dominated = made(16.0, 190.0), made(13.0, 200.0)
    assert lower_hull([dent, *corner, dominated]) == corner
    # Ends that save next to no time, or next to no energy.
    assert lower_hull([*corner, made(9.9999, 400.0), made(500.0, 99.9999)]) == corner


@pytest.mark.parametrize("seed", range(8))
def test_corners_are_the_best_at_some_price(seed):
    rng = np.random.default_rng(seed)
    # Of such numbers no chord is so flat or so steep that an end is left out.
    points = {(int(t), 5 * int(e)) for t, e in rng.integers((10, 20), (21, 61), (30, 2))}
    routes = [made(float(t), float(e)) for t, e in points]
    slopes = {0.0, 1e6} | {
        (b - a) / (s - t) for (s, a), (t, b) in combinations(points, 2) if s != t and a != b
    }
    prices = np.unique([slope for slope in slopes if slope >= 0.0])
    best = {
        id(min(routes, key=lambda one: one.cost(watts)))
        for watts in 0.5 * (prices[:-1] + prices[1:])
    }
    hull = lower_hull(routes)
    assert {id(one) for one in hull} == best
    assert (np.diff([one.route.duration_s for one in hull]) > 0.0).all()


def test_both_ends_of_a_chord_cost_the_same_at_its_price():
    quick, frugal = made(10.0, 300.0), made(14.0, 180.0)
    watts = chord_price(quick, frugal)
    assert watts == 30.0
    assert quick.cost(watts) == pytest.approx(frugal.cost(watts))
