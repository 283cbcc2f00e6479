"""The route of least energy within a maximum duration.

    route, reason = in_time(run, 120.0)

The front of duration against energy (planner.search.front) is looked at only where it crosses the
limit: the two neighbours on either side are brought closer by the price of their chord. Then the
paths of both are driven at time weights that close in on the limit, since the same path with other
speeds fills the gap between two corners of the front.
"""

from __future__ import annotations

from planner.amounts import seconds
from planner.search.results import Route
from planner.search.run import Run
from planner.search.tradeoff.hull import between, ends_of, lower_hull
from planner.search.tradeoff.weighted_objective import DrivenRoute, PricedSearch

CHORD_SEARCHES = 4
"""Chord prices that are searched at; each is a whole search."""
BISECTIONS = 10
"""Time weights tried on each path: raised until it is quick enough, then bisected."""


def in_time(run: Run, most_s: float) -> tuple[Route | None, str]:
    """The route of least energy that takes no longer, or None and why there is none.

    Args:
        run: the question; its objective is energy, its goal may be a region.
        most_s: s from start to goal.
    """
    search = PricedSearch(run)
    front = pool = ends_of(search)
    if not front:
        return None, search.reason
    for _ in range(CHORD_SEARCHES):
        run.step(0.6, "routes that arrive in time")
        quick, slow = _round(front, most_s)
        if quick is None or slow is None:
            break
        found = between(search, quick, slow)
        if found is None:
            break
        pool = [*pool, found]
        front = lower_hull(pool)
    quick, slow = _round(front, most_s)
    if quick is None:
        return None, (
            f"the fastest route that was found takes {seconds(front[0].route.duration_s)}, "
            f"and {seconds(most_s)} are allowed"
        )
    driven_routes = [
        *pool,
        *(driven for known in (quick, slow) if known for driven in _driven(search, known, most_s)),
    ]
    good = [driven.route for driven in driven_routes if driven.route.duration_s <= most_s]
    return min(good, key=lambda route: route.energy_j), ""


def _round(
    front: list[DrivenRoute], most_s: float
) -> tuple[DrivenRoute | None, DrivenRoute | None]:
    """The neighbours on the front that are just quick enough, and just not; None beyond an end."""
    quick = [r for r in front if r.route.duration_s <= most_s]
    slow = [r for r in front if r.route.duration_s > most_s]
    return (quick[-1] if quick else None), (slow[0] if slow else None)


def _driven(search: PricedSearch, known: DrivenRoute, most_s: float) -> list[DrivenRoute]:
    """Motions on one path at time weights that close in on a duration."""
    driven_routes: list[DrivenRoute] = []
    low, high = 0.0, 0.0
    watts = max(known.route.energy_j / max(known.route.duration_s, 1e-9), 1e-3)
    for _ in range(BISECTIONS):
        driven = search.along(known, watts)
        if driven is None:
            break
        driven_routes.append(driven)
        if driven.route.duration_s > most_s:
            low = watts
        else:
            high = watts
        watts = 0.5 * (low + high) if high > 0.0 else 4.0 * watts
    return driven_routes
