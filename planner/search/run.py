"""One request being answered: what its steps share, how it tells of progress, and how it stops.

with Stop(cancelled) as stop:
    run = Run(request, situation, progress, stop)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.search.conditions import Circumstances
from planner.search.driving_ground import DrivingGround
from planner.search.ground import CostField
from planner.search.other_core import OtherCore
from planner.search.request import PlanRequest, PoseRequest
from planner.search.situation import Situation
from planner.search.steady import MARGIN
from planner.search.stopping import Stop

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Run:
    """What the steps of one request share.

    Attributes:
        request: what is asked for.
        situation: map and model.
        progress: called with what is being done and the share done.
        stop: the caller's wish to.
        other_core: for what can be done at once.
    """

    request: PlanRequest
    situation: Situation
    progress: Progress
    stop: Stop
    other_core: OtherCore = field(default_factory=OtherCore)

    @property
    def ground(self) -> DrivingGround:
        """The map as the robot feels it."""
        return self.situation.ground

    @property
    def around(self) -> Circumstances:
        """Model, conditions and limits."""
        return self.situation.around

    def step(self, what: str, share: float) -> None:
        """Tell how far it is, and stop if the caller wants to."""
        self.check()
        self.progress(what, share)

    def check(self) -> None:
        """Stop if the caller wants to."""
        self.stop.check()

    def cancelled(self) -> bool:
        """Whether the caller wants to stop."""
        return self.stop.asked()

    @property
    def poses(self) -> tuple[PoseRequest, ...]:
        """Start, via points and goal, as they are asked for.

        A goal that is a region must be settled (planner.search.arrival).
        """
        goal = self.request.goal
        assert isinstance(goal, PoseRequest)
        return (self.request.start, *self.request.via, goal)

    @property
    def places(self) -> list[tuple[float, float]]:
        """Start, via points and goal."""
        return [(p.x, p.y) for p in self.poses]

    @property
    def yaws(self) -> list[float | None]:
        """Yaw asked for at each of them."""
        return [p.yaw for p in self.poses]

    def field(
        self, objective: str, margin: float = MARGIN, factor: Array | None = None
    ) -> CostField:
        """Map and costs for an objective."""
        return self.situation.field(objective, margin, factor)
