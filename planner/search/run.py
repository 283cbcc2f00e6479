"""One request being answered: what its steps share, its progress, and how it stops.

with CancellationToken(cancelled) as token:
    run = Run(request, situation, progress, token)
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.errors import Cancelled
from planner.progress import Progress
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.requests import PlanRequest, PoseRequest
from planner.search.resolution import MARGIN
from planner.search.second_core import OtherCore
from planner.search.situation import DrivingGround, Situation
from planner.search.wanted_yaw import Wanted, as_wanted

COINCIDENT = 1e-6
"""m within which two places are one: no robot and no map knows them apart."""


@dataclass(frozen=True)
class Run:
    """What the steps of one request share.

    Attributes:
        request: what is asked for.
        situation: map and model.
        progress: called with the share done and what is being done.
        token: the caller's wish to stop.
        other_core: for what can be done at once.
        begun: time.perf_counter() of the call, from which a time budget counts.
    """

    request: PlanRequest
    situation: Situation
    progress: Progress
    token: CancellationToken
    other_core: OtherCore = field(default_factory=OtherCore)
    begun: float = field(default_factory=time.perf_counter)

    @property
    def ground(self) -> DrivingGround:
        """The map as the robot feels it."""
        return self.situation.ground

    @property
    def conditions(self) -> OperatingConditions:
        """Model, conditions and limits."""
        return self.situation.conditions

    def step(self, share: float, what: str) -> None:
        """Report progress, and stop if the caller wants to."""
        self.check()
        self.progress(share, what)

    def check(self) -> None:
        """Stop if the caller wants to."""
        self.token.check()

    def cancelled(self) -> bool:
        """Whether the caller wants to stop."""
        return self.token.cancelled()

    @property
    def seconds_left(self) -> float:
        """s of the time budget that are left; without end where none is given."""
        counted = self.request.iterations is not None
        if counted or "time_budget_s" not in self.request.model_fields_set:
            return math.inf
        return self.request.time_budget_s - (time.perf_counter() - self.begun)

    @contextmanager
    def within_budget(self) -> Iterator[Run]:
        """The same run, cancelled when the time budget ends; for what follows a first route.

        Where the time is up, the ``with`` ends early and without an error.
        """
        if math.isinf(self.seconds_left):
            yield self
            return
        with CancellationToken(lambda: self.cancelled() or self.seconds_left <= 0.0) as token:
            try:
                yield replace(self, token=token)
            except Cancelled:
                if self.cancelled():
                    raise

    @property
    def poses(self) -> tuple[PoseRequest, ...]:
        """Start, via points and goal, as they are asked for.

        A goal that is a region must be settled (planner.search.goals.goal_selection).
        """
        goal = self.request.goal
        assert isinstance(goal, PoseRequest)
        return (self.request.start, *self.request.via, goal)

    @property
    def places(self) -> list[tuple[float, float]]:
        """Start, via points and goal; those that coincide with the one before count once.

        Two at least: where all of them coincide, that place twice.
        """
        places = [place for place, _ in self._stops]
        return places if len(places) > 1 else 2 * places

    @property
    def yaws(self) -> list[Wanted]:
        """Yaw asked for at each of ``places``."""
        wanted = [as_wanted(yaws) for _, yaws in self._stops]
        return wanted if len(wanted) > 1 else [None, *wanted]

    @property
    def _stops(self) -> list[tuple[tuple[float, float], list[float]]]:
        """Places that differ, each with the yaw angles asked for there, in this order."""
        stops: list[tuple[tuple[float, float], list[float]]] = []
        for pose in self.poses:
            place = (pose.x, pose.y)
            if not stops or math.dist(place, stops[-1][0]) > COINCIDENT:
                stops.append((place, []))
            if pose.yaw is not None:
                stops[-1][1].append(pose.yaw)
        return stops

    def field(
        self, objective: str, margin: float = MARGIN, factor: Array | None = None
    ) -> CostField:
        """Map and costs for an objective."""
        return self.situation.field(objective, margin, factor)
