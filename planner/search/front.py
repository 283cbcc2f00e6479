"""The Pareto front of duration and energy: routes from the fastest to that of least energy.

    front = energy_time_front(map="warehouse", start={"x": 2, "y": 2}, goal={"x": 27, "y": 17})
    for point in front.points:
        point.route.energy_j, point.route.duration_s, point.price_w

For a time weight λ the best route has least E + λ·T. The slope of the chord between two
neighbours is the price at which both are equally good; what is found for that price lies below the
chord, or there is nothing between them (the dichotomic scheme of Aneja and Nair, Management Science
25, 1979). The longest chords are taken first, so a few routes show the whole curve. At each price
the whole search runs again. The paths of both neighbours are driven as well, with yaw and speeds
for that price. Finally the outermost paths are driven as fast and as frugally as possible.

Only corners of the lower convex hull are answered: no other route is as quick for less energy, and
each is the best of them for some price. Routes in dents of the front, which no price asks for, are
left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any

from planner.cancellation import CancellationToken
from planner.power.model import PowerModel
from planner.progress import Progress, silent
from planner.search.conditions import assumptions
from planner.search.goals import check_places
from planner.search.requests import FrontRequest, PlanRequest, RequestLike
from planner.search.resolution import MARGIN
from planner.search.results import Route
from planner.search.run import Run
from planner.search.situation import Situation
from planner.search.tradeoff import DrivenRoute, PricedSearch, chord_price, ends_of, filled_in
from planner.shown import Shown, frame
from planner.terrain.heightmap import Terrain

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class FrontPoint:
    """A route of the front.

    Attributes:
        route: ready to drive.
        price_w: time weights, W, between which no other route of the front has less E + λ·T. The
            lower one is what each second costs that is saved against the next slower route, the
            upper one what each would cost to the next faster; 0 and infinity at the ends.
    """

    route: Route
    price_w: tuple[float, float]

    def to_json(self) -> dict[str, Any]:
        """The route as in ROUTE.json with its prices; None stands for no upper one."""
        low, high = self.price_w
        prices = [low, high if math.isfinite(high) else None]
        return {"price_w": prices, **self.route.to_json()}


@dataclass(frozen=True)
class Front(Shown):
    """What ``energy_time_front`` returns.

    Attributes:
        status: "ok", or "no_route" with a reason that names what blocks.
        terrain: the map.
        model: the power model that priced the routes.
        points: fastest first, so energy falls from each to the next.
        searches: prices that were searched at, beside the two ends.
        reason: what blocks.
        cause: the limit, its ``value``, what is ``allowed``, and the place ``x``, ``y``; without a
            route.
        notes: what was assumed, in sentences.
    """

    status: str
    terrain: Terrain
    model: Mapping[str, Any]
    points: tuple[FrontPoint, ...] = ()
    searches: int = 0
    reason: str | None = None
    cause: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = ()

    def within(self, duration_s: float) -> FrontPoint | None:
        """The point of least energy that takes no longer than so many seconds, or None."""
        quick = [p for p in self.points if p.route.duration_s <= duration_s]
        return min(quick, key=lambda p: p.route.energy_j, default=None)

    def to_json(self) -> dict[str, Any]:
        """The front ready for JSON."""
        document: dict[str, Any] = {"status": self.status}
        if self.reason is not None:
            document["reason"] = self.reason
        if self.cause is not None:
            document["cause"] = dict(self.cause)
        document["points"] = [point.to_json() for point in self.points]
        document["searches"] = self.searches
        document["model"] = dict(self.model)
        document["notes"] = list(self.notes)
        return document

    def to_frame(self) -> pandas.DataFrame:
        """The routes as a DataFrame, fastest first.

        Columns are ``duration_s``, ``energy_j``, ``length_m``, ``low_w`` and ``high_w``, the time
        weights between which a route is optimal.
        """
        return frame(
            {
                **{name: getattr(p.route, name) for name in ("duration_s", "energy_j", "length_m")},
                **dict(zip(("low_w", "high_w"), p.price_w, strict=True)),
            }
            for p in self.points
        )

    def svg(self) -> str:
        """The curve of energy over duration, and the map with all routes, as SVG."""
        return self.figure("front").svg


def energy_time_front(
    request: FrontRequest | RequestLike = None,
    *,
    terrain: Terrain | None = None,
    model: PowerModel | str | PathLike[str] | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    **fields: Any,
) -> Front:
    """Routes that show what time costs in energy.

    Args:
        request: a FrontRequest, a mapping with its fields or the path of a JSON file; or give
            the fields as keywords.
        terrain, model: already there, instead of those that the request names; a text or a path
            as model is the request's field ``model``.
        progress: called with the share done, 0 to 1, and what is being done.
        cancelled: asked often; True raises Cancelled.
        fields: fields of the request, over those of ``request``; ``map`` may be a Terrain,
            ``vehicle`` a Vehicle and ``model`` a PowerModel.

    Returns:
        A Front of status "ok", or "no_route" with the reason.

    Raises:
        RequestError, MapError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` returned True.
    """
    request, situation = Situation.asked(FrontRequest, request, fields, terrain, model)
    question = request.model_dump(exclude_unset=True, exclude={"points"})
    with CancellationToken(cancelled) as token:
        asked = PlanRequest.from_json(question)
        run = Run(asked, situation, progress or silent, token)
        return _front(run, request.points)


def _front(run: Run, most: int) -> Front:
    run.step(0.02, "costs of steady driving")
    refused = check_places(run, run.field("energy", MARGIN))
    notes = assumptions(run.request, run.conditions, run.ground.terrain)
    model = run.conditions.model.describe()
    blank = Front("no_route", run.ground.terrain, model, notes=notes)
    if refused is not None:
        return replace(blank, reason=refused.what, cause=refused.to_json())
    search = PricedSearch(run)
    run.step(0.05, "least energy")
    ends = ends_of(search)
    if not ends:
        cause = None if search.cause is None else search.cause.to_json()
        return replace(blank, reason=search.reason, cause=cause)
    front, searches = filled_in(search, ends, most)
    run.progress(1.0, "done")
    return replace(blank, status="ok", points=_points(front), searches=searches)


def _points(front: Sequence[DrivenRoute]) -> tuple[FrontPoint, ...]:
    slopes = [math.inf, *(chord_price(a, b) for a, b in pairwise(front)), 0.0]
    return tuple(
        FrontPoint(driven.route, (slopes[k + 1], slopes[k])) for k, driven in enumerate(front)
    )
