"""A robot with an effect that its model lacks, and a model that adopts it from the robot's log.

    story = close_the_loop(ERRANDS, "minibalance", {"regeneration_limit": {}}, Path("demo"))
    story.adoption.diagnosis.sentence
    for drive in story.drives: drive.error_before, drive.error_after, drive.saved

A virtual robot (planner.telemetry.virtual) hides an effect. It drives the routes that the
base model plans and logs its power. From that log alone the effect is named and adopted; the same
errands are planned again with the new version and driven again. Its log is written beside the
pages: ``joulepath diagnose demo/robot.csv --vehicle minibalance`` says the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner import Adoption, Answer, PowerModel, Telemetry, adopt, plan_route
from planner.errors import RequestError
from planner.power.vehicles import load_vehicle
from planner.telemetry.prediction import predict
from planner.telemetry.virtual import Noise, VirtualLog, VirtualRobot
from planner.terrain.catalogue import open_map

ITERATIONS = 5
"""Further searches for each route: answers at once scatter on this relief, by as much as the
corrected model saves. They stay reproducible."""
NOISE, ROW = Noise(level=0.02), 0.1
"""Scatter of the power, and s, the interval of a row: a route has corners, and what happens in one
only shows in rows that are shorter."""


@dataclass(frozen=True)
class Errand:
    """A route that is asked for twice: before and after the model has learnt."""

    name: str
    request: Mapping[str, Any]


def _errand(name: str, start: tuple[float, float], goal: tuple[float, float]) -> Errand:
    ends = {"start": {"x": start[0], "y": start[1]}, "goal": {"x": goal[0], "y": goal[1]}}
    return Errand(name, {"map": "jacksboro-1to100", **ends})


ERRANDS = (
    _errand("over the ridge", (93, 225), (212, 73)),
    _errand("down the valley", (288, 215), (238, 61)),
    _errand("along the crest", (137, 283), (262, 248)),
    _errand("across the hills", (40, 200), (230, 120)),
)


@dataclass(frozen=True)
class Drive:
    """One errand, driven along the route of the base model and along that of the corrected one.

    Answers scatter on this relief. So the robot keeps the old route where the corrected model
    predicts no less for the new one.

    Attributes:
        errand: which.
        before, after: the answers.
        took_before_j, took_after_j: J that the robot needed.
        corrected_before_j, corrected_after_j: J that the corrected model predicts for these drives.
    """

    errand: Errand
    before: Answer
    after: Answer
    took_before_j: float
    took_after_j: float
    corrected_before_j: float
    corrected_after_j: float

    @property
    def error_before(self) -> float:
        """Measured over planned energy less one, planned by the base model."""
        return self.took_before_j / self.before.routes[0].energy_j - 1.0

    @property
    def kept(self) -> bool:
        """Whether the robot keeps the old route."""
        return self.corrected_before_j <= self.corrected_after_j

    @property
    def said_j(self) -> float:
        """J that the corrected model says of the route that the robot takes now."""
        return self.corrected_before_j if self.kept else self.after.routes[0].energy_j

    @property
    def takes_j(self) -> float:
        """J that the robot needs on that route."""
        return self.took_before_j if self.kept else self.took_after_j

    @property
    def error_after(self) -> float:
        """Measured over predicted energy less one, on that route."""
        return self.takes_j / self.said_j - 1.0

    @property
    def saved(self) -> float:
        """Share of its energy that the robot saves on that route."""
        return 1.0 - self.takes_j / self.took_before_j

    @property
    def promised(self) -> float:
        """The same share, predicted by the corrected model."""
        return 1.0 - min(self.corrected_after_j / self.corrected_before_j, 1.0)


@dataclass(frozen=True)
class ClosedLoop:
    """The drives and the adoption.

    Attributes:
        adoption: with the diagnosis of the first drives' log.
        drives: one for each errand.
        log: where the first drives' log was written.
    """

    adoption: Adoption
    drives: tuple[Drive, ...]
    log: Path


def close_the_loop(
    errands: Sequence[Errand],
    vehicle: str,
    hidden: Mapping[str, Mapping[str, Any]],
    folder: Path,
    *,
    seed: int = 1,
) -> ClosedLoop:
    """Plan, drive, diagnose, adopt, plan and drive again.

    Args:
        errands: what to drive.
        vehicle: name of the robot's vehicle.
        hidden: the hidden effects, as VirtualRobot takes them.
        folder: for the log.
        seed: for the routes and the robot's noise.

    Raises:
        RequestError: an errand has no route.
    """
    robot = VirtualRobot(vehicle, hidden=hidden, seed=seed)
    model = PowerModel.from_vehicle(load_vehicle(vehicle), effects=())
    first = [_plan(errand, model, seed) for errand in errands]
    driven = [_drive(robot, e, answer) for e, answer in zip(errands, first, strict=True)]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "robot.csv"
    logs = {errand.name: log for errand, (_, log) in zip(errands, driven, strict=True)}
    VirtualLog.joined(logs).write_csv(path)
    adoption = adopt("diagnosed", path, model)
    second = [_plan(errand, adoption.model, seed) for errand in errands]
    again = [_drive(robot, e, answer) for e, answer in zip(errands, second, strict=True)]
    story = [_predicted(adoption.model, log, folder) for _, log in (*driven, *again)]
    drives = tuple(
        Drive(
            errand, first[k], second[k], driven[k][0], again[k][0], story[k], story[k + len(first)]
        )
        for k, errand in enumerate(errands)
    )
    return ClosedLoop(adoption, drives, path)


def _predicted(model: PowerModel, log: VirtualLog, folder: Path) -> float:
    """J that a model predicts for a logged drive."""
    path = folder / "drive.csv"
    log.write_csv(path)
    measured = Telemetry.read(path)
    path.unlink()
    return float(predict(model, measured) @ measured.interval)


def _plan(errand: Errand, model: PowerModel, seed: int) -> Answer:
    asked = {**errand.request, "iterations": ITERATIONS}
    answer = plan_route(asked, model=model, seed=seed)
    if not answer.routes:
        raise RequestError(errand.name, "no route", accepted=answer.reason or "")
    return answer


def _drive(robot: VirtualRobot, errand: Errand, answer: Answer) -> tuple[float, VirtualLog]:
    load = errand.request.get("payload", {}).get("mass", 0.0)
    return robot.drive_route(
        answer.to_json(),
        terrain=open_map(errand.request["map"]),
        settings={"payload": load},
        noise=NOISE,
        row=ROW,
    )
