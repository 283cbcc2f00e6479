"""A request for the certified bound: it stands in the answer, and no route undercuts it."""

import pytest

from planner import plan_route
from planner.errors import RequestError

ASKED = {
    "map": "tilted-plane",
    "start": {"x": 4.0, "y": 4.0},
    "goal": {"x": 20.0, "y": 15.0},
}


@pytest.fixture(scope="module")
def quick():
    return plan_route(ASKED)


def test_the_certified_bound_is_closer_and_below_every_route(quick):
    closer = plan_route(ASKED, certify_s=4.0, alternatives=2)
    assert closer.planner["bound"] == ["potential"]
    assert closer.routes[0].energy_j == pytest.approx(quick.routes[0].energy_j)
    for route in closer.routes:
        assert quick.routes[0].lower_bound_j < route.lower_bound_j <= route.energy_j
    assert closer.routes[0].gap < quick.routes[0].gap


def test_legs_add_up_to_no_more_than_the_way():
    """A place on the way can only make it dearer, and so can the sum of two bounds."""
    via = plan_route(ASKED, certify_s=4.0, via=[{"x": 6.0, "y": 14.0}]).routes[0]
    assert via.lower_bound_j <= via.energy_j
    assert plan_route(ASKED, certify_s=4.0).routes[0].lower_bound_j < via.energy_j


def test_seconds_that_cannot_be():
    with pytest.raises(RequestError, match="certify_s"):
        plan_route(ASKED, certify_s=0.0)
