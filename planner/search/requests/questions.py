"""What a user may ask for: a route, a front of routes, a matrix of energies, the area in reach.

    request = PlanRequest.from_text('{"map": "warehouse", "start": {"x": 1, "y": 1}, ...}')

Ground, robot and circumstances are common to all (scenario).
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from planner.search.requests.places import Goal, Number, Places, PoseRequest
from planner.search.requests.scenario import SituationRequest, Whole


class TripRequest(SituationRequest):
    """From where to where, over which ground, with which robot."""

    start: PoseRequest = Field(examples=[{"x": 4.0, "y": 4.0, "yaw": 0.0}])
    """where the robot stands, such as [2, 3] or {"x": 2, "y": 3, "yaw": 0}"""
    goal: Goal = Field(
        description='where it shall go: [20, 8] or {"x": 20, "y": 8, "yaw": 0}, anywhere in '
        '{"x": 20, "y": 8, "radius": 2} or in {"polygon": [[2, 2], [4, 2], [3, 5]]}, or one of '
        '{"any": [[20, 8], [4, 9]]}',
        examples=[{"x": 28.0, "y": 30.0}],
    )
    via: Places = Field(default=(), max_length=50)
    """up to 50 places to pass in this order, such as [[2, 3], [8, 1]]"""


class PlanRequest(TripRequest):
    """One route: its ends, its objective and how it is searched."""

    objective: Literal["energy", "time", "length"] = Field(
        default="energy", description='what to minimise: "energy", "time" or "length"'
    )
    max_duration_s: Number | None = Field(
        default=None,
        gt=0,
        description='s within which to arrive, above 0; only for the objective "energy"',
    )
    alternatives: Whole = Field(default=1, ge=1, le=5)
    """how many different routes, a whole number from 1 to 5"""
    seed: Whole = Field(default=0, ge=0, le=2**32 - 1)
    """of the random numbers, a whole number from 0 to 4294967295"""
    time_budget_s: Number = Field(default=2.0, gt=0, le=600)
    """seconds to search, above 0 up to 600"""
    iterations: Whole | None = Field(
        default=None,
        ge=1,
        le=10**9,
        description="iterations to search instead of the time budget, which makes the answer "
        "reproducible; a whole number from 1 to 1000000000",
    )
    certify_s: Number | None = Field(default=None, gt=0, le=600)
    """seconds for a closer lower bound, above 0 up to 600; left out, the quick one"""
    poses_every_s: Number | None = Field(default=None, ge=1e-3, le=600)
    """seconds between poses at most, 0.001 to 600; left out, as close as energy needs them"""
    planner: Literal["least-energy", "bit*", "rrt*", "informed-rrt*"] = Field(
        default="least-energy",
        description="which of OMPL's planners: \"least-energy\" (joulepath's own) or one that "
        'samples, "bit*", "rrt*" or "informed-rrt*"',
    )
    space: Literal["plane", "poses"] = "plane"
    """where it plans: "plane" (x, y, with the yaw that costs least) or "poses" (x, y, yaw)"""

    @field_validator("max_duration_s")
    @classmethod
    def _for_energy(cls, value: float | None, info: ValidationInfo) -> float | None:
        if value is not None and info.data.get("objective", "energy") != "energy":
            raise PydanticCustomError("not_energy", "is given together with another objective")
        return value


class FrontRequest(TripRequest):
    """A Pareto front of duration and energy: its ends and the number of routes."""

    points: Whole = Field(default=7, ge=2, le=30)
    """how many routes at most, a whole number from 2 to 30"""


class MatrixRequest(SituationRequest):
    """The energy from each of some places to each of others."""

    starts: Places = Field(min_length=1, max_length=1000)
    """1 to 1000 places to start from, such as [[2, 3], [8, 1]] or [{"x": 2, "y": 3}]"""
    goals: Places | None = Field(default=None, min_length=1, max_length=1000)
    """1 to 1000 places to go to; left out, the starts"""


class ReachRequest(SituationRequest):
    """How far an energy takes the robot."""

    start: PoseRequest = Field(examples=[{"x": 4.0, "y": 4.0}])
    """where the robot stands, such as [2, 3] or {"x": 2, "y": 3}"""
    energy_j: Number | None = Field(default=None, gt=0)
    """J to spend, above 0; left out, what is in the vehicle's battery"""
    and_back: bool = False
    """whether the energy has to last for the return as well"""
