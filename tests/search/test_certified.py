"""A request for the certified bound: it stands in the answer, and no route undercuts it."""

import math

import numpy as np
import pytest

from planner import plan_route
from planner.errors import RequestError
from planner.search.lower_bound import certify
from planner.search.request import PlanRequest
from planner.search.situation import situation_of
from planner.search.steady import MARGIN

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


def test_a_place_that_no_node_leads_to_has_a_bound_as_well():
    """Guides may miss a narrow passage or end at a wall; the bound does not depend on them."""
    start, goal = {"x": 2.0, "y": 2.0}, {"x": 20.0, "y": 17.0}
    request = PlanRequest.from_json({"map": "warehouse", "start": start, "goal": goal})
    situation = situation_of(request)
    field = situation.field("energy", MARGIN)
    solid = np.argwhere(field.mask == 0)
    j, i = solid[len(solid) // 2]
    place = (field.x0 + i * field.dx, field.y0 + j * field.dy)
    bound = certify(field, situation.around, (2.0, 2.0), place, seconds=1.0).bound_j
    assert 0.0 < bound < math.inf
