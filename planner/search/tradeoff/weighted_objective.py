"""The best route for a time weight: energy plus so many joules for every second.

    search = PricedSearch(run)
    found = search.at(50.0)                    # the whole search, 50 W
    quicker = search.along(found, 200.0)       # the same way with yaw and speeds for 200 W

The search runs as for energy, with a model that draws the price as well
(PowerModel.time_weight): field, refinement, yaw and speed all minimise E + λ·T. The motion is
then priced by the model without it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.goals import settled
from planner.search.grid import Lattice
from planner.search.limit_places import Infeasible
from planner.search.ompl import solved
from planner.search.resolution import MARGIN
from planner.search.results import Route, drive, price
from planner.search.run import Run
from planner.search.situation import Situation
from planner.search.solve import on_grid
from planner.search.steady import SteadyCosts
from planner.search.wanted_yaw import Wanted

WEIGHT_STEP = 2.0
"""Factor between time weights for which steady driving is tabulated. A table takes longer than the
motions that it serves, and weights of a question are hardly ever those of another one."""


@dataclass(frozen=True)
class PricedSituation(Situation):
    """A situation with a time weight in its model.

    Attributes:
        plain: the same without it.
        watts: the price.
    """

    plain: Situation
    watts: float
    asked_together: ClassVar[tuple[str, ...]] = ("energy",)

    @cached_property
    def _tabulated(self) -> Situation:
        """That of the step next to the weight: what is tabulated and searched is as for it."""
        step = WEIGHT_STEP ** round(math.log(self.watts, WEIGHT_STEP))
        return self if step == self.watts else self.of(self.plain, step)

    def costs(self, objective: str) -> SteadyCosts:
        """Costs of steady driving at the step next to the weight."""
        at = self._tabulated
        return super().costs(objective) if at is self else at.costs(objective)

    def lattice(self, objective: str, field: CostField) -> Lattice:
        """The moves on the grid at the step next to the weight."""
        at = self._tabulated
        return super().lattice(objective, field) if at is self else at.lattice(objective, field)

    @classmethod
    def of(cls, plain: Situation, watts: float) -> PricedSituation:
        """A situation with every second priced at so many W."""
        model = replace(plain.conditions.model, time_weight=watts)
        return cls(plain.ground, replace(plain.conditions, model=model), plain, watts)

    def corner_penalty(self, objective: str) -> float:
        """What refinement counts for a corner: that of the energy, and the priced one of time."""
        return self.plain.corner_penalty(objective) + self.watts * self.plain.corner_penalty("time")


@dataclass(frozen=True, eq=False)
class DrivenRoute:
    """A route and the path that it was made of.

    Attributes:
        route: priced by the model without a time weight.
        legs: polylines (k, 2) from one fixed place to the next.
        yaws: asked for at the fixed places, None where it is free.
        margin: share of the slope limit with which the path was found.
    """

    route: Route
    legs: tuple[Array, ...]
    yaws: tuple[Wanted, ...]
    margin: float

    def cost(self, price: float) -> float:
        """J with every second at ``price`` W."""
        return self.route.energy_j + price * self.route.duration_s


class PricedSearch:
    """Searches for the same question at any time weight.

    Args:
        run: the question.

    Attributes:
        reason: why the first search that failed found no route.
        cause: what was in its way.
    """

    def __init__(self, run: Run) -> None:
        self.run = run
        self.reason = ""
        self.cause: Infeasible | None = None

    def at(self, watts: float) -> DrivenRoute | None:
        """The best route that the grid with refinement finds at a price, W.

        A goal that is a region is settled for that price.
        """
        return self._found(replace(self.run, situation=self._priced(watts)), "energy")

    def by(self, objective: str) -> DrivenRoute | None:
        """The best route of the grid for an objective alone, "time" or "length"."""
        return self._found(self.run, objective)

    def _found(self, run: Run, objective: str) -> DrivenRoute | None:
        found = (self._at_place(one, objective) for one in settled(run, objective))
        return next((one for one in found if one is not None), None)

    def _at_place(self, run: Run, objective: str) -> DrivenRoute | None:
        # OMPL's objective is the one that is searched for.
        request = run.request.model_copy(update={"objective": objective})
        attempt, _ = solved(
            replace(run, request=request),
            lambda run: on_grid(run, run.field(objective, MARGIN), objective),
        )
        if attempt.route is None or attempt.legs is None:
            self.reason = self.reason or attempt.reason
            self.cause = self.cause or attempt.infeasible
            return None
        legs = tuple(leg for leg, _ in attempt.legs)
        route = self._repriced(attempt.route, attempt.field)
        return DrivenRoute(route, legs, tuple(run.yaws), attempt.field.margin)

    def along(self, known: DrivenRoute, watts: float) -> DrivenRoute | None:
        """The best motion on a known path at a price, W; None where it breaks a limit."""
        self.run.check()
        situation = self._priced(watts)
        field = situation.field("energy", known.margin)
        route = drive(field, situation.conditions, known.legs, known.yaws)
        if not isinstance(route, Route):
            return None
        return replace(known, route=self._repriced(route, field))

    def _priced(self, watts: float) -> Situation:
        plain = self.run.situation
        return PricedSituation.of(plain, watts) if watts > 0.0 else plain

    def _repriced(self, route: Route, field: CostField) -> Route:
        """The same motion, priced by the model without a time weight."""
        assert route.motion is not None  # as ``drive`` leaves it
        charge = self.run.request.conditions.battery_charge
        return price(field, self.run.conditions, route.motion, charge=charge)
