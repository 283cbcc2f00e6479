"""A request for the certified bound: it stands in the answer, and no route undercuts it."""

import math

import numpy as np
import pytest

from planner import plan_route
from planner.errors import RequestError
from planner.search.certificate import STEADY, certify
from planner.search.requests import PlanRequest
from planner.search.resolution import MARGIN
from planner.search.situation import situation_of
from planner.terrain.surface import GroundClass
from tests.search.maps import hills, terrain

ASKED = {
    "map": "tilted-plane",
    "start": {"x": 4.0, "y": 4.0},
    "goal": {"x": 20.0, "y": 15.0},
}


@pytest.fixture(scope="module")
def quick():
    return plan_route(ASKED)


def test_the_certified_bound_is_closer_and_below_every_route(quick):
    closer = plan_route(ASKED, certify_s=2.0, alternatives=2)
    assert closer.planner.bound == STEADY
    assert closer.routes[0].energy_j == pytest.approx(quick.routes[0].energy_j)
    for route in closer.routes:
        assert quick.routes[0].lower_bound_j < route.lower_bound_j <= route.energy_j
    assert closer.routes[0].gap < quick.routes[0].gap


def test_legs_add_up_to_no_more_than_the_path():
    """A place on the way can only make it dearer, and so can the sum of two bounds."""
    via = plan_route(ASKED, certify_s=2.0, via=[{"x": 6.0, "y": 14.0}]).routes[0]
    assert via.lower_bound_j <= via.energy_j
    assert plan_route(ASKED, certify_s=2.0).routes[0].lower_bound_j < via.energy_j


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
    bound = certify(field, situation.conditions, [(2.0, 2.0), place], seconds=1.0).bound_j
    assert 0.0 < bound < math.inf


@pytest.mark.parametrize(
    "factors",
    [
        (0.7, 0.3),
        pytest.param((0.5,), marks=pytest.mark.nightly),
        pytest.param((0.0,), marks=pytest.mark.nightly),
    ],
)
def test_ground_that_rolls_more_easily_than_as_measured(factors):
    """All of the map below a factor of 1: between the quick bound and the route.

    Where nothing rolls off energy, prices gain nothing over the quick bound.
    """
    heights = hills(64, rms_degrees=4.0)
    ground = np.zeros(heights.shape, np.uint8)
    ground[:, 32:] = len(factors) - 1
    classes = tuple(GroundClass(f"ground {k}", rolling=f) for k, f in enumerate(factors))
    map_ = terrain(heights, ground=ground, classes=classes)
    ends = {"start": {"x": 3.0, "y": 3.0}, "goal": {"x": 13.0, "y": 12.0}}
    quick = plan_route(terrain=map_, **ends).routes[0]
    closer = plan_route(terrain=map_, certify_s=2.0, **ends)
    assert closer.planner.bound == STEADY
    bound = closer.routes[0].lower_bound_j
    assert quick.lower_bound_j <= bound <= closer.routes[0].energy_j
    assert max(factors) == 0.0 or quick.lower_bound_j < bound
