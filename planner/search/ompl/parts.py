"""OMPL's objective and motion validator over our costs.

Costs are dissipated energy: never negative, and lower than the energy drawn only by the constant
M·g·Δz. They differ by direction, so the objective is not symmetric.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ompl import base as ob
from ompl import geometric as og

from planner.search.ompl.costs import MotionCosts, State
from planner.search.run import Run


def path_through(information: Any, states: Sequence[State]) -> Any:
    """og.PathGeometric through some states, (x, y) or (x, y, yaw)."""
    path = og.PathGeometric(information)
    for values in states:
        path.append(written(information.allocState(), values))
    return path


def written(state: Any, values: State) -> Any:
    """A state of OMPL's with other numbers."""
    if len(values) == 3:
        state.setX(float(values[0]))
        state.setY(float(values[1]))
        state.setYaw(math.remainder(values[2], 2.0 * math.pi))
    else:
        state[0], state[1] = float(values[0]), float(values[1])
    return state


def word_for(status: Any) -> str:
    """OMPL's word for how a planner ended; its own list lacks the one for infeasible problems."""
    infeasible = status.getStatus() == ob.PlannerStatus.PlannerStatusType.INFEASIBLE
    return "Infeasible" if infeasible else str(status.asString())


class Reader:
    """Costs by OMPL's states; the last answer is remembered, as OMPL checks and then prices."""

    def __init__(self, costs: MotionCosts) -> None:
        self.costs = costs
        self.evaluations = 0
        self._last: tuple[State, float] = ((), 0.0)

    def read(self, state: Any) -> State:
        """The numbers of a state."""
        if self.costs.poses:
            return state.getX(), state.getY(), state.getYaw()
        return state[0], state[1]

    def between(self, a: Any, b: Any) -> float:
        """Cost of the straight motion between two states."""
        ends = self.read(a) + self.read(b)
        if ends != self._last[0]:
            half = len(ends) // 2
            self.evaluations += 1
            self._last = ends, self.costs.between(ends[:half], ends[half:])
        return self._last[1]

    def feasible(self, state: Any) -> bool:
        """Whether the robot can be at a state."""
        return self.costs.feasible(self.read(state))


class DissipatedEnergy(ob.OptimizationObjective):  # type: ignore[misc]
    """The sum of the motions' costs: J dissipated, or s or m for the other objectives.

    Attributes:
        reader: costs by states.
        run: the request, for LeastEnergy; None for planners that sample.
    """

    def __init__(self, information: Any, reader: Reader, run: Run | None = None) -> None:
        super().__init__(information)
        self.reader, self.run = reader, run

    def stateCost(self, _state: Any) -> Any:
        """Being somewhere costs nothing."""
        return ob.Cost(0.0)

    def motionCost(self, a: Any, b: Any) -> Any:
        """Cost of the straight motion; infinity where it is infeasible."""
        return ob.Cost(self.reader.between(a, b))

    def motionCostHeuristic(self, a: Any, b: Any) -> Any:
        """A lower bound of the motion's cost."""
        read = self.reader.read
        return ob.Cost(self.reader.costs.bound(read(a), read(b)))

    def isSymmetric(self) -> bool:
        """Uphill is not downhill."""
        return False


class Driveable(ob.MotionValidator):  # type: ignore[misc]
    """A motion is valid where its cost is finite."""

    def __init__(self, information: Any, reader: Reader) -> None:
        super().__init__(information)
        self.reader = reader

    def checkMotion(self, a: Any, b: Any, *_last_valid: Any) -> bool:
        """Whether the straight motion can be driven."""
        return math.isfinite(self.reader.between(a, b))
