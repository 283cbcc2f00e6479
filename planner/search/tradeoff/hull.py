"""The lower convex hull of energy over duration: its ends, and its corners by chords.

    ends = ends_of(search)                      # the fastest … that of least energy
    front, searches = filled_in(search, ends, most=7)

``search`` is a PricedSearch, which finds a route for a time weight.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from planner.search.resolution import MOST_WEIGHT
from planner.search.results import Route
from planner.search.tradeoff.weighted_objective import DrivenRoute, PricedSearch

FAST_WEIGHT = 10.0
"""Time weight, as a multiple of the mean power, at which quick paths are searched for."""
LEAST_WEIGHT = 1e-2
"""Time weight, as a multiple of the mean power, below which only energy counts."""
LEAST_CHORD_GAIN = 0.01
"""Share of a chord's energy span by which a new route must lie below the chord."""


def ends_of(search: PricedSearch) -> list[DrivenRoute]:
    """Routes from the fastest to that of least energy; none where there is no path."""
    frugal = search.at(0.0)
    if frugal is None:
        return []
    power = mean_power(frugal.route)
    if power == 0.0:
        return [frugal]
    search.run.step(0.1, "least time")
    # Whatever is found counts for both ends, as it does for a single route.
    with ThreadPoolExecutor(max_workers=2) as pool:
        tasks = [pool.submit(search.at, FAST_WEIGHT * power)]
        tasks += [pool.submit(search.by, objective) for objective in ("time", "length")]
    others = [task.result() for task in tasks]
    return _optimised(search, [frugal, *(route for route in others if route is not None)])


def between(search: PricedSearch, quick: DrivenRoute, frugal: DrivenRoute) -> DrivenRoute | None:
    """The best route at the price of a chord; None where it does not lie below the chord."""
    watts = chord_price(quick, frugal)
    # Of equals the first counts: a known path, before what a whole search makes of it.
    paths = {id(known.legs): known for known in (quick, frugal)}.values()
    tried = (*(search.along(known, watts) for known in paths), search.at(watts))
    found = [route for route in tried if route is not None]
    best = min(found, key=lambda r: r.cost(watts), default=quick)
    spread = quick.route.energy_j - frugal.route.energy_j
    return best if best.cost(watts) < quick.cost(watts) - LEAST_CHORD_GAIN * spread else None


def lower_hull(routes: Sequence[DrivenRoute]) -> list[DrivenRoute]:
    """Corners of the lower convex hull of energy over duration, fastest first.

    Ends that hardly any time weight asks for are left out: they save next to no time, or next to
    no energy.
    """
    hull: list[DrivenRoute] = []
    for route in sorted(routes, key=lambda r: (r.route.duration_s, r.route.energy_j)):
        if hull and route.route.energy_j >= hull[-1].route.energy_j:
            continue
        while len(hull) > 1 and chord_price(hull[-1], route) >= chord_price(hull[-2], hull[-1]):
            hull.pop()
        hull.append(route)
    while len(hull) > 1 and chord_price(*hull[:2]) > MOST_WEIGHT * mean_power(hull[1].route):
        hull.pop(0)
    while len(hull) > 1 and chord_price(*hull[-2:]) < LEAST_WEIGHT * mean_power(hull[-2].route):
        hull.pop()
    return hull


def _optimised(search: PricedSearch, found: list[DrivenRoute]) -> list[DrivenRoute]:
    """The hull, with its outermost paths driven as fast and as frugally as they can be."""
    pool, done = list(found), set[tuple[int, float]]()
    while True:
        front = lower_hull(pool)
        heaviest = MOST_WEIGHT * mean_power(front[-1].route)
        outermost = [(known, heaviest) for known in front[:2]] + [
            (known, 0.0) for known in front[-2:]
        ]
        tries = [
            (known, watts) for known, watts in outermost if (id(known.legs), watts) not in done
        ]
        if not tries:
            return front
        for known, watts in tries:
            done.add((id(known.legs), watts))
            driven = search.along(known, watts)
            pool += [] if driven is None else [driven]


def filled_in(
    search: PricedSearch, ends: list[DrivenRoute], most: int
) -> tuple[list[DrivenRoute], int]:
    """A front of at most so many routes, and how many prices were searched at."""
    front, pool, done = ends, list(ends), set[tuple[DrivenRoute, DrivenRoute]]()
    with ThreadPoolExecutor(max_workers=2) as threads:
        while len(front) < most and len(done) < most:
            pairs = [pair for pair in pairwise(front) if pair not in done]
            if not pairs:
                break
            search.run.step(0.2 + 0.7 * len(done) / most, "prices of time")
            pairs.sort(key=lambda pair: _length(pair, front), reverse=True)
            chosen = pairs[: min(2, most - len(front))]
            done.update(chosen)
            found = threads.map(lambda pair: between(search, *pair), chosen)
            pool += [route for route in found if route is not None]
            front = lower_hull(pool)
    front = _optimised(search, pool)
    while len(front) > most:
        # Without the corner that lies least below the chord of its neighbours.
        front.pop(min(range(1, len(front) - 1), key=lambda k: _height(front[k - 1 : k + 2])))
    return front, len(done)


def chord_price(quick: DrivenRoute, frugal: DrivenRoute) -> float:
    """W at which both cost the same: J that the quick one takes more for each second it saves."""
    later = frugal.route.duration_s - quick.route.duration_s
    more = quick.route.energy_j - frugal.route.energy_j
    return more / later if later > 0.0 else math.inf


def mean_power(route: Route) -> float:
    """Mean W of a route, what comes back counted as positive."""
    steps = np.diff(route.arrays["t"], prepend=0.0)
    return float(np.abs(route.arrays["watts"]) @ steps) / max(route.duration_s, 1e-9)


def _length(pair: tuple[DrivenRoute, DrivenRoute], front: Sequence[DrivenRoute]) -> float:
    """Length of a chord, with the front's spans of energy and of duration as units."""
    quick, frugal = (r.route for r in pair)
    first, last = front[0].route, front[-1].route
    return math.hypot(
        (quick.energy_j - frugal.energy_j) / (first.energy_j - last.energy_j),
        (quick.duration_s - frugal.duration_s) / (first.duration_s - last.duration_s),
    )


def _height(three: Sequence[DrivenRoute]) -> float:
    """J by which the second of three routes lies below the chord of the others."""
    quick, middle, frugal = three
    watts = chord_price(quick, frugal)
    return quick.cost(watts) - middle.cost(watts)
