"""From paths to the cheapest trajectory near them: smooth, drive, check, keep the cheapest.

    attempt = cheapest_near(run, field, paths, "energy")
    attempt.route                   # or None, with attempt.infeasible

Every route of every question comes out of this pipeline. An ``Effort`` says how much work goes
into it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from planner.arrays import Array
from planner.search.field import CostField, polyline_cost
from planner.search.limit_places import Infeasible
from planner.search.results import Route, price
from planner.search.run import Run
from planner.search.situation import not_driven
from planner.search.solve.descent import descended, dissipated
from planner.search.solve.sketch import (
    ANSWER,
    Closely,
    Driven,
    Effort,
    Legs,
    Sketch,
    sketch,
    trajectory,
)
from planner.search.trajectory import Motion


@dataclass(frozen=True)
class Candidate:
    """A route that may become the answer.

    Attributes:
        route: with its energy.
        source: what found it.
        legs: that it was driven along.
    """

    route: Route
    source: str
    legs: Legs


@dataclass(frozen=True)
class Attempt:
    """What a search came to: a route, or paths that cannot be driven, or neither.

    Attributes:
        field: map and costs that it was searched with.
        paths: one for each leg; None where a leg has none.
        legs: the paths smoothed; the cheapest of them.
        route: along the legs.
        reason: why there is no route.
        infeasible: where a limit is in the way of a route, or of a cheaper one.
        missed: share of its energy by which a rough trajectory was cheaper that cannot be driven.
        too_warm: whether some path was refused for the torque over time alone.
    """

    field: CostField
    paths: list[Array] | None = None
    legs: Legs | None = None
    route: Route | None = None
    reason: str = ""
    infeasible: Infeasible | None = None
    missed: float = 0.0
    too_warm: bool = False

    def candidate(self, source: str) -> Candidate | None:
        """The route under the name of what found it."""
        if self.route is None or self.legs is None:
            return None
        return Candidate(self.route, source, self.legs)

    def value(self, objective: str) -> float:
        """What the route takes of an objective; infinite without one."""
        return math.inf if self.route is None else self.route.value(objective)

    def spent(self, run: Run, objective: str) -> float:
        """As ``value``, to be compared with ``metres``: without the energy that climbing stores."""
        if self.route is None or objective != "energy":
            return self.value(objective)
        return dissipated(run, self.route)

    def metres(self, field: CostField) -> float:
        """Cost of the metres of the legs, on a field without penalties."""
        return sum(polyline_cost(field, path, field.step) for path, _ in self.legs or [])


def finished(
    run: Run,
    sketches: Sequence[Sketch],
    objective: str,
    effort: Effort = ANSWER,
    closely: Closely | None = None,
) -> Attempt:
    """The cheapest feasible trajectory among sketches: only the best of all are driven closely.

    Args:
        run: the request.
        sketches: at least one.
        objective: "energy", "time" or "length".
        effort: how much work goes into it.
        closely: knows what was driven before, for the same objective.
    """
    closely = closely or Closely(objective)
    order = sorted(
        ((one, whole) for whole in sketches for one in whole.driven),
        key=lambda pair: pair[0].energy,
    )
    moving = [pair for pair in order if isinstance(pair[0].motion, Motion)]
    failed, failed_of = (None, moving[0][1]) if moving else order[0]
    descends = effort.descent and objective == "energy"
    found = descended(run, moving, closely) if descends else []
    for one, of in sorted([*found, *moving], key=lambda pair: pair[0].energy):
        motion = closely.drive(run, one.legs, of) if effort.closely else one.motion
        if isinstance(motion, Infeasible):
            if failed is None:
                failed, failed_of = Driven(one.legs, motion, one.energy), of
            continue
        attempt = Attempt(of.field, of.paths, one.legs, priced(run, of.field, motion))
        if failed is None or not isinstance(failed.motion, Infeasible):
            return attempt
        missed = (one.energy - failed.energy) / abs(one.energy)
        return replace(attempt, infeasible=failed.motion, missed=missed)
    assert failed is not None  # whatever did not move is stuck
    where = failed.motion
    assert isinstance(where, Infeasible)
    legs = (moving[0][0] if moving else failed).legs
    reason = not_driven(run.conditions, failed_of.field, where).what
    return Attempt(failed_of.field, failed_of.paths, legs, None, reason, where)


def cheapest_near(
    run: Run, field: CostField, paths: list[Array], objective: str, effort: Effort = ANSWER
) -> Attempt:
    """The cheapest feasible trajectory near some paths; arguments as for ``sketch``."""
    return finished(run, [sketch(run, field, paths, objective, effort)], objective, effort)


def drive_legs(run: Run, field: CostField, legs: Legs, objective: str) -> Route | Infeasible:
    """The best trajectory along legs, and its energy."""
    motion = trajectory(run, field, legs, objective)
    return motion if isinstance(motion, Infeasible) else priced(run, field, motion)


def priced(run: Run, field: CostField, motion: Motion) -> Route:
    """The route of a motion, with its energy and account."""
    return price(field, run.conditions, motion, charge=run.request.conditions.battery_charge)
