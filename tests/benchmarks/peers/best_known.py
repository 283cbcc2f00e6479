"""The best route that is known for a question: what all methods found, refined in many ways.

    route = best_known(case, paths, seconds=20.0)

No method has it alone: a peer's path that goes round another side of a hill counts as well.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence

import numpy as np

from planner.search.results import Route
from tests.benchmarks.peers.case import Array, Case

KNOTS = (4.0, 8.0, 6.0, 12.0, 3.0, 16.0)
"""Cells between knots."""
TOLLS = (1.0, 0.3, 0.1, 3.0)
"""Shares of a corner's toll."""


def best_known(case: Case, paths: Sequence[Array], seconds: float) -> Route | None:
    """The cheapest motion near any of the paths.

    Args:
        case: the question.
        paths: polylines (k, 2), the most promising ones first.
        seconds: CPU time after which no other way of refining is begun.
    """
    best: Route | None = None
    begun = time.process_time()
    for knots, corner_penalty in sorted(itertools.product(KNOTS, TOLLS), key=_order):
        for path in paths:
            if time.process_time() - begun > seconds:
                return best
            route = case.refined(path, {knots: (corner_penalty,)})
            if route is not None and (best is None or route.energy_j < best.energy_j):
                best = route
    return best


def _order(way: tuple[float, float]) -> int:
    return KNOTS.index(way[0]) + TOLLS.index(way[1])


def distinct(case: Case, paths: Sequence[Array], most: int) -> list[Array]:
    """The first paths that differ from each other by more than two cells somewhere."""
    kept: list[Array] = []
    share = np.linspace(0.0, 1.0, 40)
    marks: list[Array] = []
    for path in paths:
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        at = np.column_stack([np.interp(share * along[-1], along, path[:, k]) for k in (0, 1)])
        apart = [float(np.hypot(*(at - other).T).max()) for other in marks]
        if min(apart, default=np.inf) > 2.0 * min(case.field.dx, case.field.dy):
            kept.append(path)
            marks.append(at)
        if len(kept) == most:
            break
    return kept
