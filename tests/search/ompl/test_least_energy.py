"""joulepath's own search as a planner of OMPL's: reproducible, without leaks, stopped in time."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from ompl import base as ob

from planner import energy_time_front, plan_route
from planner.search.ompl import LeastEnergy
from tests.search.maps import terrain
from tests.search.ompl.problems import ENDS, RELIEF, problem

PROGRAM = """
import json, resource, sys
from planner import plan_route
from planner.terrain.heightmap import Terrain
import numpy as np
level = Terrain.from_arrays(np.zeros((24, 24)), cell=(0.5, 0.5))
ends = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 9.0, "y": 8.0}}
def memory():
    return int(open("/proc/self/statm").read().split()[1]) * resource.getpagesize()
from planner.search.ompl import EnergyProblem, LeastEnergy
from planner.search.solve import on_grid
from ompl import util as ou
ou.setLogLevel(ou.LOG_NONE)
def one():
    problem = EnergyProblem(terrain=level, **ends)
    setup = problem.setup()
    grid = lambda run: on_grid(run, run.field("energy"), "energy")
    setup.setPlanner(LeastEnergy(problem.information, grid))
    assert setup.solve(60.0)
    assert setup.getSolutionPath().check()
answer = plan_route(terrain=level, **ends).to_json()
for _ in range(100):
    one()
before = memory()
for _ in range(int(sys.argv[1])):
    one()
print(json.dumps({"grown": memory() - before, "answer": answer}))
"""


def in_new_process(problems: int) -> tuple[dict, str]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(problems)], capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout), done.stderr


@pytest.mark.parametrize("problems", [300, pytest.param(1000, marks=pytest.mark.nightly)])
def test_many_problems_leave_no_memory_behind_and_the_exit_is_silent(problems):
    found, errors = in_new_process(problems)
    assert errors == ""
    assert found["grown"] < 3 * 2**20
    level = terrain(np.zeros((24, 24)), cell=0.5)
    here = plan_route(
        terrain=level, start={"x": 2.0, "y": 2.0}, goal={"x": 9.0, "y": 8.0}
    ).to_json()
    assert json.dumps(found["answer"]) == json.dumps(here)


def test_the_second_answer_is_the_first():
    first, second = (
        json.dumps(plan_route(terrain=RELIEF, **ENDS, alternatives=2).to_json()) for _ in range(2)
    )
    assert first == second


@pytest.mark.parametrize(
    "asked", [{}, {"alternatives": 1}, {"via": [{"x": 12.0, "y": 4.0}]}, {"objective": "time"}]
)
def test_every_route_is_a_solution_of_ompls_planner(asked, monkeypatch):
    solved = []
    solve = LeastEnergy.solve

    def watched(self, until):
        status = solve(self, until)
        assert self.getProblemDefinition().hasSolution()
        solved.append(self.outcome.route.energy_j)
        return status

    monkeypatch.setattr(LeastEnergy, "solve", watched)
    found = plan_route(terrain=RELIEF, **ENDS, **asked).routes
    assert found[0].energy_j in solved
    front = len(solved)
    energy_time_front(terrain=RELIEF, **ENDS, points=2)
    assert len(solved) > front


def test_a_termination_condition_that_holds_at_once_ends_in_a_timeout():
    made = problem()
    setup = made.setup()
    planner = LeastEnergy(made.information)
    setup.setPlanner(planner)
    assert setup.solve(ob.PlannerTerminationCondition(lambda: True)).asString() == "Timeout"
    assert planner.outcome is None
    planner.clear()


def test_where_there_is_no_path_status_and_reason_both_stand():
    heights = np.zeros((48, 48))
    blocked = np.zeros(heights.shape, bool)
    blocked[:, 22:26] = True
    answer = plan_route(
        terrain=terrain(heights, obstacles=blocked),
        start={"x": 2.0, "y": 6.0},
        goal={"x": 10.0, "y": 6.0},
    )
    assert answer.status == "no_route"
    assert answer.planner.status == "Infeasible"
    assert answer.reason


def test_an_error_in_the_search_reaches_who_asked():
    def broken(run):
        raise ZeroDivisionError("in the search")

    made = problem()
    setup = made.setup()
    setup.setPlanner(LeastEnergy(made.information, broken))
    with pytest.raises(ZeroDivisionError, match="in the search"):
        setup.solve(60.0)
