"""A request as a problem of OMPL's, and a path of OMPL's as a route.

problem = EnergyProblem(map="cone", start={"x": 6, "y": 20}, goal={"x": 34, "y": 20})
setup = problem.setup()                               # og.SimpleSetup
route = problem.route(setup.getSolutionPath())
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import geometric as og

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.errors import RequestError
from planner.power.model import PowerModel
from planner.progress import silent
from planner.search.goals import check_places, settled
from planner.search.limit_places import Infeasible
from planner.search.ompl.costs import MotionCosts, State, costs_of
from planner.search.ompl.parts import DissipatedEnergy, Driveable, Reader, written
from planner.search.requests import PlanRequest, PoseRequest
from planner.search.resolution import YAW_BINS
from planner.search.results import Route, price
from planner.search.run import Run
from planner.search.situation import Situation
from planner.search.trajectory import move
from planner.terrain.heightmap import Terrain

AT_GOAL = 1e-6
"""m, and rad, from the goal within which a path has arrived."""


class Frame:
    """OMPL's parts for some costs: state space, validity checkers and objective.

    Args:
        costs: of straight motions.
        run: the request, for LeastEnergy.

    Attributes:
        information, objective: OMPL's.
    """

    def __init__(self, costs: MotionCosts, run: Run | None = None) -> None:
        field = costs.field
        ny, nx = field.heights.shape
        self.reader = reader = Reader(costs)
        space = ob.SE2StateSpace() if costs.poses else ob.RealVectorStateSpace(2)
        bounds = ob.RealVectorBounds(2)
        axes = ((field.x0, field.dx, nx), (field.y0, field.dy, ny))
        for axis, (first, cell, count) in enumerate(axes):
            bounds.setLow(axis, first - 0.5 * cell)
            bounds.setHigh(axis, first + (count - 0.5) * cell)
        space.setBounds(bounds)
        self.information = ob.SpaceInformation(space)
        self.objective = DissipatedEnergy(self.information, reader, run)
        self.information.setStateValidityChecker(reader.feasible)
        self.information.setMotionValidator(Driveable(self.information, reader))
        self.information.setup()

    def between(self, start: PoseRequest, goal: PoseRequest) -> Any:
        """og.SimpleSetup from one pose to another, without a planner.

        With poses, a yaw that is free becomes a choice among those at which the body fits.
        """
        setup = og.SimpleSetup(self.information)
        goals = ob.GoalStates(self.information)
        goals.setThreshold(AT_GOAL)
        for pose, add in ((start, setup.addStartState), (goal, goals.addState)):
            for values in self._states_at(pose, math.atan2(goal.y - start.y, goal.x - start.x)):
                add(written(self.information.allocState(), values))
        setup.setGoal(goals)
        setup.setOptimizationObjective(self.objective)
        return setup

    def _states_at(self, pose: PoseRequest, travel: float) -> list[State]:
        """States of a pose; where its yaw is free, all feasible ones beginning with the travel."""
        if not self.reader.costs.poses:
            return [(pose.x, pose.y)]
        if pose.yaw is not None:
            return [(pose.x, pose.y, pose.yaw)]
        turns = 2.0 * math.pi * np.arange(YAW_BINS) / YAW_BINS
        states: list[State] = [(pose.x, pose.y, travel + float(turn)) for turn in turns]
        return [state for state in states if self.reader.costs.feasible(state)] or states[:1]

    def points(self, path: Any) -> Array:
        """(k, 2) m of a path's states, without those on which the body only turns."""
        return waypoints([self.reader.read(state) for state in path.getStates()])


def waypoints(states: Sequence[State]) -> Array:
    """(k, 2) m of states, without those on which the body only turns."""
    points = np.array([state[:2] for state in states])
    apart = np.hypot(*np.diff(points, axis=0).T) > 1e-9
    return np.asarray(points[np.concatenate([[True], apart])])


class EnergyProblem(Frame):
    """A request as a problem of OMPL's.

    Args:
        space: "plane" for (x, y) with the yaw that costs least, or "poses" for (x, y, yaw).
        objective: "energy", "time" or "length".
        terrain, model: already there, instead of those that the request names.
        request: further fields of a route request. A goal that is a region becomes the place in it
            that costs least.

    Raises:
        RequestError, MapError, VehicleError, ModelError: something given cannot be used.

    Attributes:
        information: OMPL's SpaceInformation; planners are made with it.
        objective: OMPL's objective.
        run: the request with its map and model.
    """

    def __init__(
        self,
        space: str = "plane",
        objective: str = "energy",
        *,
        terrain: Terrain | None = None,
        model: PowerModel | str | PathLike[str] | None = None,
        **request: Any,
    ) -> None:
        fields = {"space": space, "objective": objective, **request}
        asked, situation = Situation.asked(PlanRequest, None, fields, terrain, model)
        run = Run(asked, situation, silent, CancellationToken())
        refused = check_places(run, run.field(asked.objective))
        if refused is not None:
            raise RequestError("goal", refused.what, accepted="places that the robot can hold")
        self._pose(run)

    @classmethod
    def of(cls, run: Run) -> EnergyProblem:
        """The problem of a request that is being answered; its places are checked already."""
        problem = cls.__new__(cls)
        problem._pose(run)
        return problem

    def _pose(self, run: Run) -> None:
        asked = run.request
        self.run = next(settled(run, asked.objective))
        super().__init__(costs_of(run, asked.objective, asked.space == "poses"), self.run)

    def setup(self) -> Any:
        """og.SimpleSetup from start to goal, without a planner.

        LeastEnergy passes the request's via places on the way; other planners know none.
        """
        return self.between(self.run.poses[0], self.run.poses[-1])

    def route(self, path: Any) -> Route:
        """The best motion along a path of OMPL's, with its energy.

        Args:
            path: og.PathGeometric from start to goal.

        Raises:
            RequestError: no motion along it keeps to all limits; says where and why.
        """
        asked = self.run.request
        yaws = (asked.start.yaw, self.run.poses[-1].yaw)
        situation = self.run.situation
        field, conditions = situation.to_drive(self.reader.costs.field, asked.objective)
        motion = move(field, conditions, [self.points(path)], yaws)
        if isinstance(motion, Infeasible):
            problem = f"cannot be driven: at x {motion.x:.2f}, y {motion.y:.2f} {motion.what}"
            raise RequestError("path", problem, accepted="a path that keeps to the limits")
        return price(field, self.run.conditions, motion, charge=asked.conditions.battery_charge)
