"""The route of least energy within a maximum duration.

    route, reason = in_time(run, 120.0)

The front of duration against energy (planner.search.front) is looked at only where it crosses the
limit: the two neighbours on either side are brought closer by the price of their chord, as long as
whole searches find other paths. Then the paths of both are driven at time weights that close in on
the limit, since the same path with other speeds fills the gap between two corners of the front.

A motion that is the best for a time weight bounds what its path can do: within the limit the path
takes no less than E + λ·(T - limit). Where this leaves next to nothing to gain, it is left alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from planner.amounts import seconds
from planner.search.resolution import MOST_WEIGHT
from planner.search.results import Route
from planner.search.run import Run
from planner.search.tradeoff.hull import (
    LEAST_CHORD_GAIN,
    between,
    chord_price,
    ends_of,
    lower_hull,
    mean_power,
)
from planner.search.tradeoff.weighted_objective import DrivenRoute, PricedSearch

CHORD_SEARCHES = 4
"""Chord prices that are searched at; each is a whole search."""
WEIGHTS_TRIED = 10
"""Time weights tried on each path at most."""
LEFT_TO_GAIN = 2e-4
"""Share of the energy that may be left to gain on a path: motions scatter by about as much."""
FARTHER = 4.0
"""Factor from one time weight to the next, until there is a motion on either side of the limit."""
LEAST_STEP = 0.1
"""Share of the bracket by which the next time weight stays inside it."""


class _Tried(NamedTuple):
    """A motion, and the time weight, W, that it was searched with."""

    watts: float
    driven: DrivenRoute


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
        if found.legs is quick.legs or found.legs is slow.legs:
            # The whole search found no better path for this weight.
            break
    quick, slow = _round(front, most_s)
    if quick is None:
        return None, (
            f"the fastest route that was found takes {seconds(front[0].route.duration_s)}, "
            f"and {seconds(most_s)} are allowed"
        )
    best = min((one for one in pool if one.route.duration_s <= most_s), key=_energy)
    if slow is None:
        return best.route, ""
    watts = chord_price(quick, slow)
    for known in {id(one.legs): one for one in (slow, quick)}.values():
        best, watts = _closing_in(search, known, best, most_s, watts)
    return best.route, ""


def _energy(driven: DrivenRoute) -> float:
    return driven.route.energy_j


def _round(
    front: list[DrivenRoute], most_s: float
) -> tuple[DrivenRoute | None, DrivenRoute | None]:
    """The neighbours on the front that are just quick enough, and just not; None beyond an end."""
    quick = [r for r in front if r.route.duration_s <= most_s]
    slow = [r for r in front if r.route.duration_s > most_s]
    return (quick[-1] if quick else None), (slow[0] if slow else None)


def _closing_in(
    search: PricedSearch, known: DrivenRoute, best: DrivenRoute, most_s: float, watts: float
) -> tuple[DrivenRoute, float]:
    """The best of a route in time and of motions on a path, at weights that close in on the limit.

    Args:
        search: of the question.
        known: the path.
        best: the best route in time so far.
        most_s: s from start to goal.
        watts: time weight to begin with.

    Returns:
        The best, and the time weight that was tried last.
    """
    tried: list[_Tried] = []
    late: _Tried | None = None
    early: _Tried | None = None
    heaviest = MOST_WEIGHT * mean_power(known.route)
    for _ in range(WEIGHTS_TRIED):
        driven = search.along(known, watts)
        if driven is None:
            break
        below = late is None or early is None or _below(driven, watts, early.driven, late.driven)
        tried.append(_Tried(watts, driven))
        if driven.route.duration_s > most_s:
            late = tried[-1]
        else:
            early = tried[-1]
            best = min(best, driven, key=_energy)
        left = _energy(best) - _least(tried, most_s)
        if not below or left <= LEFT_TO_GAIN * abs(_energy(best)):
            break
        if early is None and watts >= heaviest:
            break
        watts = _next_weight(late, early)
    return best, watts


def _least(tried: Sequence[_Tried], most_s: float) -> float:
    """J that motions on a path take at least within a limit, by those that were tried.

    For each weight no motion costs less than the best of them, whichever weight it was found with.
    """
    return max(
        min(other.driven.cost(one.watts) for other in tried) - one.watts * most_s for one in tried
    )


def _below(driven: DrivenRoute, watts: float, quick: DrivenRoute, slow: DrivenRoute) -> bool:
    """Whether a motion is better for a weight than two others: there is no dent between these."""
    spread = abs(_energy(quick) - _energy(slow))
    known = min(quick.cost(watts), slow.cost(watts))
    return driven.cost(watts) < known - LEAST_CHORD_GAIN * spread


def _next_weight(late: _Tried | None, early: _Tried | None) -> float:
    """W at which a motion may lie between one that is late and one that is early.

    None stands for that which is still to be found.
    """
    if early is None:
        assert late is not None  # at least one was driven
        return late.watts * FARTHER
    if late is None:
        return early.watts / FARTHER
    # Motions scatter: their chord may ask for a weight outside the bracket.
    inside = LEAST_STEP * (early.watts - late.watts)
    chord = chord_price(early.driven, late.driven)
    return min(max(chord, late.watts + inside), early.watts - inside)
