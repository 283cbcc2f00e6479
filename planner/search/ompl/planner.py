"""OMPL at work: BIT* on a plane whose cost is the energy that a robot dissipates.

    result = solve(Tube(field, path, cheapest), seed=1, seconds=2.0)

The same seed with an iteration limit gives the same path in every fresh process; OMPL's seed is one
for the whole process and cannot be set back, and a time limit depends on the machine's load.
``solve`` holds Python's lock while it runs: services call it in a process of its own.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from planner.cancellation import CancellationToken
from planner.search.ompl.objective import DissipatedEnergy, Driveable, Plane


@dataclass(frozen=True)
class OmplResult:
    """What one run of OMPL found.

    Attributes:
        path: (k, 2) polyline in the map's frame; None when nothing was found.
        cost: its cost on the plane.
        iterations: of the planner.
        evaluations: edges whose cost was asked for.
        seconds: wall clock.
    """

    path: NDArray[np.float64] | None
    cost: float
    iterations: int
    evaluations: int
    seconds: float


def solve(
    plane: Plane,
    *,
    seed: int,
    seconds: float,
    iterations: int | None = None,
    token: CancellationToken,
) -> OmplResult:
    """Plan from the plane's start to its goal.

    Args:
        plane: coordinates and costs.
        seed: of OMPL's random numbers; takes effect on the first call in a process.
        seconds: time limit, ignored when ``iterations`` is given.
        iterations: limit on the planner's iterations; makes the result reproducible.
        token: asked often; ends the search with what was found.
    """
    ou.setLogLevel(ou.LOG_NONE)
    ou.RNG.setSeed(seed + 1)  # OMPL refuses 0
    space = ob.RealVectorStateSpace(2)
    bounds = ob.RealVectorBounds(2)
    for k in (0, 1):
        bounds.setLow(k, plane.low[k])
        bounds.setHigh(k, plane.high[k])
    space.setBounds(bounds)
    information = ob.SpaceInformation(space)
    information.setStateValidityChecker(lambda state: plane.valid(state[0], state[1]))
    information.setMotionValidator(Driveable(information, plane))
    information.setup()
    objective = DissipatedEnergy(information, plane)
    problem = ob.ProblemDefinition(information)
    problem.setStartAndGoalStates(_state(space, plane.start), _state(space, plane.goal), 1e-6)
    problem.setOptimizationObjective(objective)
    planner = og.BITstar(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    begun = time.perf_counter()
    asked = 0

    def finished() -> bool:
        nonlocal asked
        asked += 1
        if iterations is not None:
            return asked > iterations or (asked % 64 == 0 and token.cancelled())
        return time.perf_counter() - begun > seconds or (asked % 64 == 0 and token.cancelled())

    planner.solve(ob.PlannerTerminationCondition(finished))
    elapsed = time.perf_counter() - begun
    path, cost = None, math.inf
    if problem.hasExactSolution():
        states = np.array([(s[0], s[1]) for s in problem.getSolutionPath().getStates()])
        path = plane.path(states)
        cost = sum(plane.cost(*a, *b) for a, b in zip(states[:-1], states[1:], strict=True))
    return OmplResult(path, cost, asked, objective.evaluations, elapsed)


def _state(space: Any, values: tuple[float, float]) -> Any:
    state = space.allocState()
    state[0], state[1] = float(values[0]), float(values[1])
    return state
