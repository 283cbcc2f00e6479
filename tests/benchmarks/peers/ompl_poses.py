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
from itertools import pairwise

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from planner.quantities import STANDARD_GRAVITY
from planner.search.field import sample_surface
from planner.search.ompl.costs import MotionCosts, State, turning_rates
from planner.search.ompl.problem import Frame
from planner.search.requests import PoseRequest
from tests.benchmarks.peers.case import Array, Case
from tests.benchmarks.peers.report import TIMES

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


class Work:
    """Mechanical work against gravity in place of our energy, and a little for the length.

    Motions are as feasible as ours are.

    Args:
        case: the question.
        costs: of ours, with poses.
    """

    poses = True

    def __init__(self, case: Case, costs: MotionCosts) -> None:
        self.field, self.feasible, self._ours = costs.field, costs.feasible, costs.between
        self.weight = case.situation.conditions.mass * STANDARD_GRAVITY

    def between(self, a: State, b: State) -> float:
        """Work on every rise along the straight motion; infinity where it is infeasible."""
        if not math.isfinite(self._ours(a, b)):
            return math.inf
        field = self.field
        length = math.dist(a[:2], b[:2])
        count = max(1, math.ceil(length / min(field.dx, field.dy)))
        share = np.arange(count + 1)[:, None] / count
        points = (1.0 - share) * np.array(a[:2]) + share * np.array(b[:2])
        rises = np.maximum(np.diff(sample_surface(field, points)[0]), 0.0).sum()
        return float(self.weight * rises + PATH_LENGTH * length)

    def bound(self, a: State, b: State) -> float:
        """A cost that no motion undercuts."""
        return PATH_LENGTH * math.dist(a[:2], b[:2])


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
    lattice = case.situation.lattice("energy", case.field)
    rates = turning_rates(case.situation.conditions, "energy")
    costs = MotionCosts(case.field, lattice.cheapest, rates)
    # Compiled code is loaded before time counts.
    costs.between((*case.start, 0.0), (*case.start, 0.1))
    frame = Frame(costs if aim == "energy" else Work(case, costs))  # type: ignore[arg-type]
    ends = (PoseRequest(x=x, y=y) for x, y in (case.start, case.goal))
    setup = frame.between(*ends)
    search = PLANNERS[planner](frame.information)
    if planner == "BIT*":
        search.setSamplesPerBatch(BATCH)
        search.setUseKNearest(False)
    setup.setPlanner(search)
    setup.setup()
    problem, reader = setup.getProblemDefinition(), frame.reader
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
            states = [reader.read(state) for state in problem.getSolutionPath().getStates()]
            cost = sum(reader.costs.between(a, b) for a, b in pairwise(states))
            if cost < least:
                least, best = cost, np.array(states)
        yield spent, reader.evaluations, best


def _after(moment: float) -> Callable[[], bool]:
    """Whether the process has worked until a moment."""
    return lambda: time.process_time() > moment
