"""OMPL as the frame of every answer: joulepath's ground, robot and energy as OMPL's own parts.

    problem = EnergyProblem(map="cone", start={"x": 6, "y": 20}, goal={"x": 34, "y": 20})
    setup = problem.setup()
    setup.setPlanner(og.RRTstar(problem.information))
    setup.solve(5.0)
    route = problem.route(setup.getSolutionPath())        # yaw, speed, energy, breakdown

The default planner is joulepath's own search, as a planner of OMPL's:
``setup.setPlanner(LeastEnergy(problem.information))``.
"""

from planner.search.ompl.benchmark import PlannerComparison, compare_planners
from planner.search.ompl.least_energy import LeastEnergy, solved
from planner.search.ompl.planners import answer
from planner.search.ompl.problem import EnergyProblem

__all__ = [
    "EnergyProblem",
    "LeastEnergy",
    "PlannerComparison",
    "answer",
    "compare_planners",
    "solved",
]
