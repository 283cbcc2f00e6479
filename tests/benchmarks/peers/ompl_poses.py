"""OMPL's own planners on poses (x, y, yaw): SE(2) with our energy, or with mechanical work.

    for at, poses in plan(case, "BIT*", "energy", seconds=20.0, seed=1): ...

After every time in TIMES the best poses so far are given. OMPL keeps no best solution by a Python
objective (nor does its planner's order of stored paths follow it), so the cheapest is kept here.
Yaw is free at start and goal: several of each are given to the planner. A process plans once:
OMPL's random generator cannot be set back.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from planner.quantities import STANDARD_GRAVITY
from planner.terrain.interpolation import interpolate
from tests.benchmarks.peers.case import Array, Case
from tests.benchmarks.peers.poses import pose_cost, pose_free, turning_prices
from tests.benchmarks.peers.report import TIMES

ENDS = 16
"""Yaw angles to choose from at start and goal."""
BATCH = 1000
"""BIT*'s samples at a time, with all neighbours in a radius: of 100 to 3,000, and of the nearest
ones instead, what did best on four of the benchmark's own questions."""
PATH_LENGTH = 1e-5
"""Weight of the length beside mechanical work: OMPL's own default."""
PLANNERS = {
    "BIT*": og.BITstar,
    "Informed RRT*": og.InformedRRTstar,
    "SORRT*": og.SORRTstar,
    "RRT*": og.RRTstar,
}


class Motions:
    """What a motion between two states costs; the last answer is remembered."""

    def __init__(self, case: Case, aim: str) -> None:
        field = case.field
        self.field, self.prices = field, turning_prices(case)
        self.work = aim == "work"
        self.weight = case.situation.around.mass * STANDARD_GRAVITY
        lattice = case.situation.lattice("energy", field)
        self.cheapest = PATH_LENGTH if self.work else lattice.cheapest
        self.evaluations = 0
        # Compiled code is loaded before time counts.
        pose_cost(field, *self.prices, *case.start, 0.0, *case.start, 0.1)
        self._last: tuple[Any, float] = (None, 0.0)

    def cost(self, a: Any, b: Any) -> float:
        """J, infinity where a limit is broken."""
        ends = (a.getX(), a.getY(), a.getYaw(), b.getX(), b.getY(), b.getYaw())
        if ends == self._last[0]:
            return self._last[1]
        self.evaluations += 1
        cost = float(pose_cost(self.field, *self.prices, *ends))
        if self.work and math.isfinite(cost):
            cost = self._climbed(*ends[:2], *ends[3:5])
        self._last = ends, cost
        return cost

    def floor(self, a: Any, b: Any) -> float:
        """A cost that no motion undercuts."""
        return self.cheapest * math.hypot(b.getX() - a.getX(), b.getY() - a.getY())

    def _climbed(self, xa: float, ya: float, xb: float, yb: float) -> float:
        """Work against gravity on every rise on the way, and a little for the length."""
        field = self.field
        length = math.hypot(xb - xa, yb - ya)
        count = max(1, math.ceil(length / min(field.dx, field.dy)))
        share = np.arange(count + 1) / count
        heights = np.array(
            [
                interpolate(
                    field.heights,
                    field.x0,
                    field.y0,
                    field.dx,
                    field.dy,
                    xa + w * (xb - xa),
                    ya + w * (yb - ya),
                )[0]
                for w in share
            ]
        )
        rises = np.maximum(np.diff(heights), 0.0).sum()
        return float(self.weight * rises + PATH_LENGTH * length)


class MotionCost(ob.OptimizationObjective):  # type: ignore[misc]
    """OMPL's objective: the sum of the motions' costs."""

    def __init__(self, information: Any, motions: Motions) -> None:
        super().__init__(information)
        self.motions = motions

    def stateCost(self, _state: Any) -> Any:
        """Being somewhere costs nothing."""
        return ob.Cost(0.0)

    def motionCost(self, a: Any, b: Any) -> Any:
        """Cost of the straight motion."""
        return ob.Cost(self.motions.cost(a, b))

    def motionCostHeuristic(self, a: Any, b: Any) -> Any:
        """A lower bound of the motion's cost."""
        return ob.Cost(self.motions.floor(a, b))

    def isSymmetric(self) -> bool:
        """Uphill is not downhill."""
        return False


class Possible(ob.MotionValidator):  # type: ignore[misc]
    """A motion is valid where its cost is finite."""

    def __init__(self, information: Any, motions: Motions) -> None:
        super().__init__(information)
        self.motions = motions

    def checkMotion(self, a: Any, b: Any, *_last: Any) -> bool:
        """Whether the straight motion can be driven."""
        return math.isfinite(self.motions.cost(a, b))


def plan(
    case: Case, planner: str, aim: str, *, seconds: float, seed: int
) -> Iterator[tuple[float, int, Array | None]]:
    """CPU seconds, motions priced, and the best poses (k, 3) so far, after every time in TIMES.

    Args:
        case: the question.
        planner: of PLANNERS.
        aim: "energy" or "work".
        seconds: CPU time in all.
        seed: of OMPL's random numbers.
    """
    ou.setLogLevel(ou.LOG_NONE)
    ou.RNG.setSeed(seed + 1)
    field = case.field
    space = ob.SE2StateSpace()
    bounds = ob.RealVectorBounds(2)
    ny, nx = field.heights.shape
    for axis, (least, cell, count) in enumerate(
        ((field.x0, field.dx, nx), (field.y0, field.dy, ny))
    ):
        bounds.setLow(axis, least - 0.5 * cell)
        bounds.setHigh(axis, least + (count - 0.5) * cell)
    space.setBounds(bounds)
    information = ob.SpaceInformation(space)
    motions = Motions(case, aim)
    information.setStateValidityChecker(
        lambda state: pose_free(field, state.getX(), state.getY(), state.getYaw())
    )
    information.setMotionValidator(Possible(information, motions))
    information.setup()
    problem = ob.ProblemDefinition(information)
    goals = ob.GoalStates(information)
    travel = math.atan2(case.goal[1] - case.start[1], case.goal[0] - case.start[0])
    for k in range(ENDS):
        yaw = math.remainder(travel + 2.0 * math.pi * k / ENDS, 2.0 * math.pi)
        if pose_free(field, *case.start, yaw):
            problem.addStartState(_state(space, *case.start, yaw))
        if pose_free(field, *case.goal, yaw):
            goals.addState(_state(space, *case.goal, yaw))
    problem.setGoal(goals)
    problem.setOptimizationObjective(MotionCost(information, motions))
    search = PLANNERS[planner](information)
    search.setProblemDefinition(problem)
    if planner == "BIT*":
        search.setSamplesPerBatch(BATCH)
        search.setUseKNearest(False)
    search.setup()
    best: Array | None = None
    least = math.inf
    spent = 0.0
    for at in TIMES:
        if at > seconds:
            return
        problem.clearSolutionPaths()
        begun = time.process_time()
        search.solve(ob.PlannerTerminationCondition(_after(begun + at - spent)))
        spent += time.process_time() - begun
        if problem.hasExactSolution():
            states = problem.getSolutionPath().getStates()
            cost = sum(motions.cost(a, b) for a, b in zip(states[:-1], states[1:], strict=True))
            if cost < least:
                least = cost
                best = np.array([(s.getX(), s.getY(), s.getYaw()) for s in states])
        yield spent, motions.evaluations, best


def _after(moment: float) -> Callable[[], bool]:
    """Whether the process has worked until a moment."""
    return lambda: time.process_time() > moment


def _state(space: Any, x: float, y: float, yaw: float) -> Any:
    state = space.allocState()
    state.setX(float(x))
    state.setY(float(y))
    state.setYaw(float(yaw))
    return state
