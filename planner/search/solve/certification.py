"""Routes with the certified lower bound in place of the quick one, where a request asks for it.

    routes, said = certified(run, routes)

The bound of each leg holds for all motions between its two places; that of the way is their sum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from planner.quantities import STANDARD_GRAVITY
from planner.search.certificate import certify
from planner.search.results import Route
from planner.search.run import Run


def certified(run: Run, routes: Sequence[Route]) -> tuple[tuple[Route, ...], dict[str, Any]]:
    """The same routes with the closer bound and gap, and how it was found.

    Args:
        run: the request, with ``certify_s``.
        routes: all between the same places.

    Raises:
        Cancelled: the caller wants to stop.
    """
    assert run.request.certify_s is not None
    field = run.field("energy")
    legs = list(pairwise(run.places))
    share = run.request.certify_s / len(legs)
    bounds = [certify(field, run.conditions, *leg, seconds=share, token=run.token) for leg in legs]
    bound = sum(part.bound_j for part in bounds)
    weight = run.conditions.mass * STANDARD_GRAVITY
    closer = []
    for route in routes:
        z = route.arrays["z"]
        dissipated = route.energy_j - weight * float(z[-1] - z[0])
        most = max(route.lower_bound_j, bound)
        gap = (route.energy_j - most) / dissipated if dissipated > 0.0 else 0.0
        closer.append(replace(route, lower_bound_j=most, gap=gap))
    how = sorted({part.how for part in bounds})
    return tuple(closer), {"bound": how, "bound_s": sum(part.seconds for part in bounds)}
