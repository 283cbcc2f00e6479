"""Routes with their lower bound: the quick one, and a closer one where a request gives it time.

    routes, said, note = with_bounds(run, routes)

A bound of a way through several places is the sum over its legs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from planner.quantities import STANDARD_GRAVITY
from planner.search.certificate import ALL, certify, legs_bound
from planner.search.results import Route
from planner.search.run import Run


def with_bounds(
    run: Run, routes: Sequence[Route]
) -> tuple[tuple[Route, ...], dict[str, Any], str | None]:
    """The same routes with their bound and gap, how it was found, and what to note of it.

    Args:
        run: the request; ``certify_s`` asks for the closer bound.
        routes: all between the same places.

    Raises:
        Cancelled: the caller wants to stop.
    """
    field, seconds = run.field("energy"), run.request.certify_s
    how: dict[str, Any] = {"bound": ALL}
    note = None
    if seconds is None or run.cancelled():
        bound = legs_bound(field, run.conditions, run.places)
    else:
        run.step(0.95, "certified bound")
        found = certify(field, run.conditions, run.places, seconds=seconds, token=run.token)
        bound, how = found.bound_j, {"bound": found.how, "bound_s": found.seconds}
        if found.how == ALL:
            note = f"certify_s: {seconds:g} s gave no closer bound than the quick one"
    weight = run.conditions.mass * STANDARD_GRAVITY
    closer = []
    for route in routes:
        dissipated = route.energy_j - weight * route.rise_m
        gap = (route.energy_j - bound) / dissipated if dissipated > 0.0 else 0.0
        closer.append(replace(route, lower_bound_j=bound, gap=gap))
    return tuple(closer), how, note
