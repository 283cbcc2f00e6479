"""What a second costs: routes from the one of least energy to the fastest.

    front = energy_time_front(map="warehouse", start={"x": 2, "y": 2}, goal={"x": 27, "y": 17})
    for point in front.points:
        point.route.energy_j, point.route.duration_s, point.price_w

For a price of time λ the best route has least E + λ·T. The slope of the chord between two
neighbours is the price at which both are equally good; what is found for that price lies below the
chord, or there is nothing between them (the dichotomic scheme of Aneja and Nair, Management Science
25, 1979). The longest chords are taken first, so a few routes show the whole curve. At each price
the whole search runs anew, and the ways of both neighbours are driven as well, with the yaw and the
speeds for that price. The outermost ways are at last driven as fast and as frugally as they can be.

Only corners of the lower convex hull are answered: no other route is as quick for less energy, and
each is the best of them for some price. Routes in dents of the front, which no price asks for, are
left out.
"""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from planner.power.model import PowerModel
from planner.search.arrival import check_places
from planner.search.priced_routes import PricedSearch, Ridden
from planner.search.request import FrontRequest, PlanRequest
from planner.search.route import Route
from planner.search.run import Run
from planner.search.situation import situation_of
from planner.search.situation_request import RequestLike
from planner.search.steady import MARGIN
from planner.search.stopping import Stop
from planner.terrain.heightmap import Terrain

HURRIED = 10.0
"""Price of time over the mean power at which quick ways are searched for."""
CHEAP, DEAR = 1e-2, 1e2
"""Prices of time over the mean power beyond which hardly anything but energy, or time, counts."""
WORTHWHILE = 0.01
"""Share of a chord's energy by which a route has to lie below it."""


@dataclass(frozen=True)
class FrontPoint:
    """A route of the front.

    Attributes:
        route: ready to drive.
        price_w: prices of time, W, between which no other route of the front has less E + λ·T. The
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
class Front:
    """What ``energy_time_front`` returns.

    Attributes:
        status: "ok", or "no_route" with a reason that names what blocks.
        terrain: the map.
        model: the power model that priced the routes.
        points: fastest first, so energy falls from each to the next.
        searches: prices that were searched at, beside the two ends.
        reason: what blocks.
    """

    status: str
    terrain: Terrain
    model: Mapping[str, Any]
    points: tuple[FrontPoint, ...] = ()
    searches: int = 0
    reason: str | None = None

    def within(self, duration_s: float) -> FrontPoint | None:
        """The point of least energy that takes no longer than so many seconds, or None."""
        quick = [p for p in self.points if p.route.duration_s <= duration_s]
        return min(quick, key=lambda p: p.route.energy_j, default=None)

    def to_json(self) -> dict[str, Any]:
        """The front ready for JSON."""
        document: dict[str, Any] = {"status": self.status}
        if self.reason is not None:
            document["reason"] = self.reason
        document["points"] = [point.to_json() for point in self.points]
        document["searches"] = self.searches
        document["model"] = dict(self.model)
        return document

    def svg(self) -> str:
        """The curve of energy over duration, and the map with all routes, as SVG."""
        from planner.search.front_picture import front_svg

        return front_svg(self)

    def _repr_html_(self) -> str:
        if not self.points:
            return f"<p><b>No route.</b> {html.escape(self.reason or '')}</p>"
        return f'<div style="max-width:760px">{self.svg()}</div>'


def energy_time_front(
    request: FrontRequest | RequestLike = None,
    *,
    terrain: Terrain | None = None,
    model: PowerModel | None = None,
    progress: Callable[[str, float], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
    **fields: Any,
) -> Front:
    """Routes that show what time costs in energy.

    Args:
        request: a FrontRequest, a mapping with its fields or the path of a JSON file; or give
            the fields as keywords.
        terrain, model: already there, instead of those that the request names.
        progress: called with what is being done and the share done, 0 to 1.
        cancelled: asked often; True raises Cancelled.
        fields: fields of the request, over those of ``request``.

    Returns:
        A Front of status "ok", or "no_route" with the reason.

    Raises:
        RequestError, MapError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` returned True.
    """
    if terrain is not None:
        fields = {"map": terrain.name, **fields}
    request = FrontRequest.from_call(request, fields)
    situation = situation_of(request, terrain=terrain, model=model)
    say = progress or (lambda _what, _share: None)
    question = request.model_dump(exclude_unset=True, exclude={"points"})
    with Stop(cancelled) as stop:
        run = Run(PlanRequest.from_json({**question, "planner": "grid"}), situation, say, stop)
        return _front(run, request.points)


def _front(run: Run, most: int) -> Front:
    run.step("costs of steady driving", 0.02)
    reason = check_places(run, run.field("energy", MARGIN))
    blank = Front("no_route", run.ground.terrain, run.around.model.describe())
    if reason is not None:
        return replace(blank, reason=reason)
    search = PricedSearch(run)
    run.step("least energy", 0.05)
    ends = ends_of(search)
    if not ends:
        return replace(blank, reason=search.reason)
    front, searches = _between(search, ends, most)
    run.progress("done", 1.0)
    return replace(blank, status="ok", points=_points(front), searches=searches)


def ends_of(search: PricedSearch) -> list[Ridden]:
    """Routes from the fastest to that of least energy; none where there is no way."""
    frugal = search.at(0.0)
    if frugal is None:
        return []
    power = _power(frugal.route)
    if power == 0.0:
        return [frugal]
    search.run.step("least time", 0.1)
    # Whatever is found counts for both ends, as it does for a single route.
    with ThreadPoolExecutor(max_workers=2) as pool:
        tasks = [
            pool.submit(search.at, HURRIED * power),
            *(pool.submit(search.by, objective) for objective in ("time", "length")),
        ]
    others = [task.result() for task in tasks]
    return _polished(search, [frugal, *(route for route in others if route is not None)])


def _polished(search: PricedSearch, found: list[Ridden]) -> list[Ridden]:
    """The hull, with its outermost ways driven as fast and as frugally as they can be."""
    pool, done = list(found), set[tuple[int, float]]()
    while True:
        front = lower_hull(pool)
        dear = DEAR * _power(front[-1].route)
        outermost = [(way, dear) for way in front[:2]] + [(way, 0.0) for way in front[-2:]]
        tries = [(way, watts) for way, watts in outermost if (id(way.legs), watts) not in done]
        if not tries:
            return front
        for way, watts in tries:
            done.add((id(way.legs), watts))
            ridden = search.along(way, watts)
            pool += [] if ridden is None else [ridden]


def _between(search: PricedSearch, ends: list[Ridden], most: int) -> tuple[list[Ridden], int]:
    """A front of at most so many routes, and how many prices were searched at."""
    front, pool, done = ends, list(ends), set[tuple[int, int]]()
    with ThreadPoolExecutor(max_workers=2) as threads:
        while len(front) < most and len(done) < most:
            pairs = [pair for pair in pairwise(front) if _identity(pair) not in done]
            if not pairs:
                break
            search.run.step("prices of time", 0.2 + 0.7 * len(done) / most)
            pairs.sort(key=lambda pair: _length(pair, front), reverse=True)
            chosen = pairs[: min(2, most - len(front))]
            done |= {_identity(pair) for pair in chosen}
            found = threads.map(lambda pair: between(search, *pair), chosen)
            pool += [route for route in found if route is not None]
            front = lower_hull(pool)
    front = _polished(search, pool)
    while len(front) > most:
        # Without the corner that lies least below the chord of its neighbours.
        front.pop(min(range(1, len(front) - 1), key=lambda k: _height(front[k - 1 : k + 2])))
    return front, len(done)


def between(search: PricedSearch, quick: Ridden, frugal: Ridden) -> Ridden | None:
    """The best route at the price of a chord; None where it does not lie below the chord."""
    watts = _slope(quick, frugal)
    tried = (search.at(watts), search.along(quick, watts), search.along(frugal, watts))
    best = min(
        (route for route in tried if route is not None),
        key=lambda r: r.cost(watts),
        default=quick,
    )
    spread = quick.route.energy_j - frugal.route.energy_j
    return best if best.cost(watts) < quick.cost(watts) - WORTHWHILE * spread else None


def lower_hull(routes: Sequence[Ridden]) -> list[Ridden]:
    """Corners of the lower convex hull of energy over duration, fastest first.

    Ends that hardly any price of time asks for are left out: they save next to no time, or next to
    no energy.
    """
    hull: list[Ridden] = []
    for route in sorted(routes, key=lambda r: (r.route.duration_s, r.route.energy_j)):
        if hull and route.route.energy_j >= hull[-1].route.energy_j:
            continue
        while len(hull) > 1 and _slope(hull[-1], route) >= _slope(hull[-2], hull[-1]):
            hull.pop()
        hull.append(route)
    while len(hull) > 1 and _slope(*hull[:2]) > DEAR * _power(hull[1].route):
        hull.pop(0)
    while len(hull) > 1 and _slope(*hull[-2:]) < CHEAP * _power(hull[-2].route):
        hull.pop()
    return hull


def _slope(quick: Ridden, frugal: Ridden) -> float:
    """W at which both cost the same: J that the quick one takes more for each second it saves."""
    later = frugal.route.duration_s - quick.route.duration_s
    more = quick.route.energy_j - frugal.route.energy_j
    return more / later if later > 0.0 else math.inf


def _power(route: Route) -> float:
    """Mean W of a route, what comes back counted as positive."""
    steps = np.diff(route.arrays["t"], prepend=0.0)
    return float(np.abs(route.arrays["watts"]) @ steps) / max(route.duration_s, 1e-9)


def _identity(pair: tuple[Ridden, Ridden]) -> tuple[int, int]:
    return id(pair[0]), id(pair[1])


def _length(pair: tuple[Ridden, Ridden], front: Sequence[Ridden]) -> float:
    """Length of a chord, with the front's spans of energy and of duration as units."""
    quick, frugal = (r.route for r in pair)
    first, last = front[0].route, front[-1].route
    return math.hypot(
        (quick.energy_j - frugal.energy_j) / (first.energy_j - last.energy_j),
        (quick.duration_s - frugal.duration_s) / (first.duration_s - last.duration_s),
    )


def _height(three: Sequence[Ridden]) -> float:
    """J by which the second of three routes lies below the chord of the others."""
    quick, middle, frugal = three
    watts = _slope(quick, frugal)
    return quick.cost(watts) - middle.cost(watts)


def _points(front: Sequence[Ridden]) -> tuple[FrontPoint, ...]:
    slopes = [math.inf, *(_slope(a, b) for a, b in pairwise(front)), 0.0]
    return tuple(
        FrontPoint(ridden.route, (slopes[k + 1], slopes[k])) for k, ridden in enumerate(front)
    )
