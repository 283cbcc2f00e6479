"""joulepath's own search as a planner of OMPL's.

    setup.setPlanner(LeastEnergy(problem.information))
    setup.solve(10.0)

    found, status = solved(run, best_route)         # for an answer: through OMPL's frame

It draws no random number of OMPL's, so its answers are the same in every process.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol, TypeVar

from ompl import base as ob
from ompl import util as ou

from planner.cancellation import CancellationToken
from planner.errors import Cancelled
from planner.search.ompl.costs import State
from planner.search.ompl.parts import DissipatedEnergy, path_through, word_for
from planner.search.ompl.problem import EnergyProblem
from planner.search.requests import PoseRequest
from planner.search.results import Route
from planner.search.run import Run
from planner.search.solve import best_route

Legs = list[tuple[Any, float]]


class Outcome(Protocol):
    """What a search came to."""

    @property
    def route(self) -> Route | None:
        """The best route, if there is one."""

    @property
    def legs(self) -> Legs | None:
        """Polylines (k, 2) with their costs that the route was driven along."""


T = TypeVar("T", bound=Outcome)


class LeastEnergy(ob.Planner):  # type: ignore[misc]
    """Exhaustive grid search, smoothing, poses where there is little room, waypoint descent.

    It passes the via places of the request on the way. Without a time budget in the request it ends
    by itself; it always ends when the termination condition says so, with the best route so far.

    Args:
        information: of an EnergyProblem.
        search: what is searched for; a whole answer by default.

    Attributes:
        outcome: what the search came to, or None.
    """

    def __init__(self, information: Any, search: Callable[[Run], Outcome] = best_route) -> None:
        super().__init__(information, "LeastEnergy")
        self.search = search
        self.outcome: Outcome | None = None

    def clear(self) -> None:
        """Forget what was found."""
        super().clear()
        self.outcome = None

    def solve(self, until: Any) -> Any:
        """Search until there is an answer or the termination condition says stop."""
        definition, inputs = self.getProblemDefinition(), self.getPlannerInputStates()
        objective = definition.getOptimizationObjective()
        status = ob.PlannerStatus.PlannerStatusType
        if not isinstance(objective, DissipatedEnergy) or objective.run is None:
            raise TypeError("LeastEnergy needs the objective of an EnergyProblem")
        inputs.restart()
        read = objective.reader.read
        ends = [state and read(state) for state in (inputs.nextStart(), inputs.nextGoal())]
        run = _between(objective.run, *ends)
        try:
            with CancellationToken(lambda: bool(until())) as token:
                self.outcome = self.search(replace(run, token=token))
        except Cancelled:
            return ob.PlannerStatus(status.TIMEOUT)
        if self.outcome.route is None or self.outcome.legs is None:
            return ob.PlannerStatus(status.INFEASIBLE)
        states = _states(self.outcome.route, self.outcome.legs, objective.reader.costs.poses)
        path = path_through(self.getSpaceInformation(), states)
        definition.addSolutionPath(path, False, 0.0, self.getName())
        return ob.PlannerStatus(True, False)


def solved(run: Run, search: Callable[[Run], T]) -> tuple[T, str]:
    """What a search comes to as a planner in OMPL's frame, and OMPL's word for how it ended.

    Args:
        run: the request.
        search: what is searched for.

    Raises:
        Cancelled: the caller wants to stop.
    """
    ou.setLogLevel(ou.LOG_NONE)
    problem = EnergyProblem.of(run)
    setup = problem.setup()
    planner = LeastEnergy(problem.information, search)
    setup.setPlanner(planner)
    status = setup.solve(ob.PlannerTerminationCondition(run.token.cancelled))
    if planner.outcome is None:
        raise Cancelled("cancelled by the caller")
    return planner.outcome, word_for(status)  # type: ignore[return-value]


def _between(run: Run, start: State | None, goal: State | None) -> Run:
    """The request from another start or to another goal, where OMPL's definition has others."""
    changed: dict[str, Any] = {}
    for name, pose, state in (("start", run.poses[0], start), ("goal", run.poses[-1], goal)):
        if state is not None and (state[0], state[1]) != (pose.x, pose.y):
            yaw = state[2] if len(state) == 3 else None
            changed[name] = PoseRequest(x=state[0], y=state[1], yaw=yaw)
    return replace(run, request=run.request.model_copy(update=changed)) if changed else run


def _states(route: Route, legs: Legs, poses: bool) -> list[State]:
    """Waypoints of a route in the plane; with poses, its samples, each with its yaw."""
    if poses:
        x, y, yaw = (route.arrays[name] for name in ("x", "y", "yaw"))
        return [(float(a), float(b), float(c)) for a, b, c in zip(x, y, yaw, strict=True)]
    first = [tuple(map(float, legs[0][0][0]))]
    return first + [tuple(map(float, point)) for path, _ in legs for point in path[1:]]
