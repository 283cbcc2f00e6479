"""Routes take hardly more where friction changes its sign at once."""

from __future__ import annotations

from tests.benchmarks.hard_maps import made
from tests.benchmarks.sharp_friction import BARS, shares


def test_routes_among_rocks_do_not_live_off_smooth_signs():
    found = shares(made("rocks", 3), 2, 3)
    assert -0.05 < min(found) <= max(found) <= BARS["worst"]
