"""A request as a problem of OMPL's, used as OMPL's own users would."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from ompl import geometric as og

from planner import plan_route
from planner.errors import RequestError
from planner.search.ompl import EnergyProblem, LeastEnergy
from tests.search.maps import terrain
from tests.search.ompl.problems import ENDS, RELIEF, problem


def solved(made: EnergyProblem, planner=LeastEnergy, seconds: float = 60.0):
    """OMPL's path for a problem."""
    setup = made.setup()
    setup.setPlanner(planner(made.information))
    assert setup.solve(seconds).asString() == "Exact solution"
    return setup.getSolutionPath(), setup


@pytest.mark.parametrize("space", ["plane", "poses"])
@pytest.mark.parametrize("objective", ["energy", "time", "length"])
def test_the_path_is_valid_and_costs_the_sum_of_its_motions(space, objective):
    made = problem(space, objective=objective)
    path, _setup = solved(made)
    assert path.check()
    states = path.getStates()
    total = sum(made.objective.motionCost(a, b).value() for a, b in pairwise(states))
    assert path.cost(made.objective).value() == pytest.approx(total, rel=1e-12)
    assert total > 0.0


@pytest.mark.parametrize("space", ["plane", "poses"])
def test_a_trajectory_on_steep_relief_is_a_valid_path(space):
    """Motors may briefly give more while the body turns; the path that results has to be valid."""
    ends = {"start": {"x": 120.0, "y": 240.0}, "goal": {"x": 200.0, "y": 150.0}}
    path, _setup = solved(EnergyProblem(space, map="jacksboro-1to100", **ends))
    assert path.check()


def test_least_energy_through_ompl_is_the_answer():
    made = problem()
    path, _setup = solved(made)
    answer = plan_route(terrain=RELIEF, **ENDS)
    assert made.route(path).energy_j == pytest.approx(answer.routes[0].energy_j, rel=1e-12)


@pytest.mark.parametrize("space", ["plane", "poses"])
def test_a_sampled_path_becomes_a_route_above_the_bound(space):
    made = problem(space)
    path, _setup = solved(made, og.BITstar, 2.0)
    route = made.route(path)
    assert route.energy_j > route.lower_bound_j
    assert sum(route.breakdown_j.values()) == pytest.approx(route.energy_j)


def test_a_path_that_cannot_be_driven_says_where():
    blocked = np.zeros((48, 48), bool)
    blocked[10:20, 20:28] = True
    ends = {"start": {"x": 2.0, "y": 4.0}, "goal": {"x": 10.0, "y": 4.0}}
    made = EnergyProblem(terrain=terrain(np.zeros((48, 48)), obstacles=blocked), **ends)
    path = og.PathGeometric(made.information)
    for x in (2.0, 10.0):
        state = made.information.allocState()
        state[0], state[1] = x, 4.0
        path.append(state)
    assert not path.check()
    with pytest.raises(RequestError, match="path: cannot be driven: at x"):
        made.route(path)


def test_a_start_with_a_yaw_is_one_state_and_a_free_one_a_choice():
    free = problem("poses")
    given = problem("poses", start={**ENDS["start"], "yaw": 0.5})
    count = [made.setup().getProblemDefinition().getStartStateCount() for made in (free, given)]
    assert count[1] == 1
    assert count[0] > 16


def test_a_goal_that_is_a_region_becomes_a_place_in_it():
    made = problem(goal={"x": 18.0, "y": 17.0, "radius": 2.0})
    path, _setup = solved(made)
    x, y = made.points(path)[-1]
    assert math.hypot(x - 18.0, y - 17.0) <= 2.0 + 1e-6


def test_another_start_in_ompls_definition_counts():
    made = problem()
    setup = made.setup()
    start = made.information.allocState()
    start[0], start[1] = 6.0, 4.0
    setup.getProblemDefinition().clearStartStates()
    setup.addStartState(start)
    setup.setPlanner(LeastEnergy(made.information))
    assert setup.solve(60.0)
    assert made.points(setup.getSolutionPath())[0] == pytest.approx((6.0, 4.0))


def test_via_places_are_passed():
    made = problem(via=[{"x": 15.0, "y": 5.0}])
    path, _setup = solved(made)
    away = np.hypot(*(made.points(path) - (15.0, 5.0)).T)
    assert away.min() < 1e-9


@pytest.mark.parametrize(
    ("wrong", "named"), [({"space": "air"}, "space"), ({"goal": {"x": 900.0, "y": 3.0}}, "goal")]
)
def test_a_problem_that_cannot_be_posed_says_what_is_wrong(wrong, named):
    with pytest.raises(RequestError, match=named):
        problem(**wrong)
