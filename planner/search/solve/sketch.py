"""Sketches: paths smoothed with several settings, each with its trajectory, roughly worked out.

    found = sketch(run, field, paths, "energy")
    found.best, found.infeasible
    Closely("energy").drive(run, legs, found)       # with all care, each only once

planner.search.solve.pipeline makes routes of them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

from planner.arrays import Array
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField, polyline_cost
from planner.search.limit_places import Infeasible
from planner.search.results import energy_of
from planner.search.run import Run
from planner.search.se2 import PosePath, keeping_yaw
from planner.search.trajectory import CLOSELY, ROUGHLY, Motion, move
from planner.search.waypoints import VARIANTS, refine

PLAIN = {8.0: (1.0,)}
"""Cells between waypoints, and shares of the corner penalty, of a path for time or length: these
have no bends that cost more than they save."""
WITH_YAW = {2.0: (1.0,), 4.0: (1.0,)}
"""The same for a path with yaw angles, which is left close to itself."""
HASTILY = ROUGHLY._replace(every_end=False)
"""How a path is driven roughly where nobody asks for another one past what is in the way."""
UNREFINED = CLOSELY._replace(refined=0)
"""How a path is driven to see whether it can be driven closely: the rest only saves energy."""
Legs = list[tuple[Array, float]]
"""A polyline (k, 2) from one fixed place to the next, and its cost, for each leg."""


class Effort(NamedTuple):
    """How much work goes into the trajectories near a path.

    Attributes:
        descent: whether waypoints are optimised, where that is likely to help.
        closely: whether the cheapest is driven again with more yaw angles and speeds. Without it,
            limits are checked on the rough trajectories, and the cheapest of these is answered.
        patient: whether recovery goes on for as long as for an answer.
    """

    descent: bool
    closely: bool
    patient: bool


ANSWER = Effort(descent=True, closely=True, patient=True)
ONE_OF_MANY = Effort(descent=False, closely=True, patient=False)
BASELINE = Effort(descent=True, closely=False, patient=False)
PATIENT_BASELINE = BASELINE._replace(patient=True)


class Driven(NamedTuple):
    """Legs, the motion along them, its energy and what it dissipates, J."""

    legs: Legs
    motion: Motion | Infeasible
    energy: float = math.inf
    dissipated: float = math.inf


@dataclass(frozen=True)
class Sketch:
    """Paths smoothed with several settings, each driven roughly.

    Attributes:
        field: map and costs to drive with.
        paths: one for each leg.
        driven: those that move, cheapest first, and then the others.
    """

    field: CostField
    paths: list[Array]
    driven: tuple[Driven, ...]

    @property
    def best(self) -> Driven | None:
        """The cheapest one that moves."""
        return self.driven[0] if isinstance(self.driven[0].motion, Motion) else None

    @property
    def energy(self) -> float:
        """J of the cheapest one; infinite where none moves."""
        return self.driven[0].energy

    @property
    def infeasible(self) -> Infeasible | None:
        """Why none of them moves."""
        first = self.driven[0].motion
        return first if isinstance(first, Infeasible) else None


def sketch(
    run: Run,
    field: CostField,
    paths: list[Array],
    objective: str,
    effort: Effort = ANSWER,
    *,
    plain: CostField | None = None,
    poses: Sequence[PosePath] = (),
) -> Sketch:
    """Smooth some paths and drive them roughly.

    Args:
        run: the request.
        field: map and costs to smooth with.
        paths: polylines (k, 2), one for each leg.
        objective: "energy", "time" or "length".
        effort: where nothing is driven closely later, limits are checked here.
        plain: map and costs to drive with, where those to smooth with have penalties.
        poses: the same paths with the yaw angles that they are to be driven with.
    """
    driven = _all_driven(run, field, paths, objective, effort, poses)
    return Sketch(plain or field, paths, tuple(sorted(driven, key=lambda one: one.energy)))


@dataclass
class Closely:
    """Legs driven with all care for an objective, each only once.

    Attributes:
        objective: "energy", "time" or "length".
        known: content of legs → their motion, or why there is none.
        passable: content of legs that have a motion, which nobody asked for yet.
    """

    objective: str
    known: dict[tuple[bytes, ...], Motion | Infeasible] = field(default_factory=dict)
    passable: set[tuple[bytes, ...]] = field(default_factory=set)

    def stopped(self, run: Run, legs: Legs, of: Sketch) -> Infeasible | None:
        """Why legs of a sketch cannot be driven with all care, in a fraction of its time."""
        key = _content(legs)
        if key not in self.known and key not in self.passable:
            motion = trajectory(run, of.field, legs, self.objective, refined=False)
            if isinstance(motion, Motion):
                self.passable.add(key)
            elif not motion.too_warm:  # a refined motion may be cooler
                self.known[key] = motion
        if key in self.passable:
            return None
        found = self.drive(run, legs, of)
        return found if isinstance(found, Infeasible) else None

    def drive(self, run: Run, legs: Legs, of: Sketch) -> Motion | Infeasible:
        """The motion along legs of a sketch."""
        key = _content(legs)
        if key not in self.known:
            self.known[key] = trajectory(run, of.field, legs, self.objective)
        return self.known[key]

    @property
    def refused(self) -> bool:
        """Whether something driven before was infeasible."""
        return any(isinstance(one, Infeasible) for one in self.known.values())

    @property
    def too_warm(self) -> bool:
        """Whether the torque over time alone refused something driven before."""
        return any(isinstance(one, Infeasible) and one.too_warm for one in self.known.values())


def _all_driven(
    run: Run,
    field: CostField,
    paths: list[Array],
    objective: str,
    effort: Effort,
    poses: Sequence[PosePath],
) -> list[Driven]:
    """The paths, each smoothed with several settings, with its trajectory."""
    penalty = run.situation.corner_penalty(objective)
    smoothings = VARIANTS if objective == "energy" else PLAIN
    near = field
    if poses:
        smoothings, near = WITH_YAW, keeping_yaw(field, poses)

    def smoothed(cells: float, shares: Iterable[float]) -> list[Legs]:
        penalties = [share * penalty for share in shares]
        legs = [
            refine(near, path, penalties=penalties, waypoint_cells=cells, check=run.check)
            for path in paths
        ]
        return [list(one) for one in zip(*legs, strict=True)]

    several = run.other_core.all([partial(smoothed, *kind) for kind in smoothings.items()])
    # Several settings may smooth a path alike.
    chains = {_content(legs): legs for legs in itertools.chain.from_iterable(several)}
    drive = partial(driven_roughly, run, field, objective=objective, effort=effort)
    return run.other_core.all([partial(drive, legs) for legs in chains.values()])


def driven_roughly(
    run: Run, field: CostField, legs: Legs, objective: str, effort: Effort = ANSWER
) -> Driven:
    """The trajectory along legs, roughly worked out."""
    motion = trajectory(run, field, legs, objective, effort, closely=False)
    if isinstance(motion, Infeasible):
        return Driven(legs, motion)
    _, conditions = run.situation.to_drive(field, objective)
    energy = energy_of(field, conditions, motion)
    climb = run.conditions.mass * STANDARD_GRAVITY * float(motion.heights[-1] - motion.heights[0])
    return Driven(legs, motion, energy, energy - climb)


def _content(legs: Legs) -> tuple[bytes, ...]:
    """What identifies legs."""
    return tuple(path.tobytes() for path, _ in legs)


def with_costs(field: CostField, paths: Iterable[Array]) -> Legs:
    """Polylines (k, 2), one for each leg, with their costs."""
    return [(path, float(polyline_cost(field, path, field.step))) for path in paths]


def trajectory(
    run: Run,
    field: CostField,
    legs: Legs,
    objective: str,
    effort: Effort = ANSWER,
    *,
    closely: bool = True,
    refined: bool = True,
) -> Motion | Infeasible:
    """The motion along legs, or where it is infeasible.

    Without ``closely``, limits are checked between samples only where nothing is driven closely.
    Without ``refined``, what is driven closely may take somewhat more energy.
    """
    run.check()
    field, conditions = run.situation.to_drive(field, objective)
    care = CLOSELY if refined else UNREFINED
    return move(
        field,
        conditions,
        [path for path, _ in legs],
        run.yaws,
        care=care if closely else ROUGHLY if effort.patient else HASTILY,
        checked=closely or not effort.closely,
        check=run.check,
    )
