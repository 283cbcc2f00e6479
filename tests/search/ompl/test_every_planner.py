"""Every planner in both spaces, on questions at random: a route or a reason, and never a crash."""

from __future__ import annotations

import pytest

from planner import plan_route
from planner.power.vehicles import load_vehicle
from planner.quantities import STANDARD_GRAVITY
from planner.search.ompl.sampling import SAMPLERS
from planner.search.requests import PlanRequest
from planner.terrain.catalogue import open_map
from tests.benchmarks.questions import questions

MAPS = ("cone", "warehouse", "jacksboro-1to100")
QUESTIONS = 10
SECONDS = 0.5
MASS = load_vehicle(PlanRequest.default_vehicle).mass


@pytest.mark.nightly
@pytest.mark.parametrize("space", ["plane", "poses"])
@pytest.mark.parametrize("name", ["least-energy", *SAMPLERS])
@pytest.mark.parametrize("on", MAPS)
def test_a_route_above_the_bound_or_a_reason(on, name, space):
    terrain = open_map(on)
    for asked in questions(terrain, QUESTIONS, 400 + MAPS.index(on)):
        given = {} if name == "least-energy" else {"time_budget_s": SECONDS}
        answer = plan_route(asked, terrain=terrain, planner=name, space=space, **given)
        assert answer.planner.name == name
        assert answer.planner.status
        if answer.status == "no_route":
            assert name in SAMPLERS, "the questions have routes, and the search is exhaustive"
            assert answer.reason.startswith(f"{name} found nothing in 0.5 s")
            continue
        route = answer.routes[0]
        assert route.energy_j >= route.lower_bound_j
        if answer.planner.path_cost is not None:
            z = route.arrays["z"]
            climbed = MASS * STANDARD_GRAVITY * float(z[-1] - z[0])
            # Metres alone, without start and stop, which the bound may count with 0 J.
            assert answer.planner.path_cost + climbed >= 0.999 * route.lower_bound_j
