"""scikit-image's MCP_Geometric (what route_through_array uses), with an isotropic cost.

    prepared = prepare(case)
    for name, path in paths(case, prepared): ...

Which isotropic cost stands best for one that depends on the direction is open, so several are
tried, and whoever compares may take the best of them with hindsight. A node is no way where the
body cannot pass it in some direction ("wary"), or only where it can in none ("bold").
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
from skimage.graph import MCP_Geometric
from skimage.measure import approximate_polygon

from tests.benchmarks.peers.case import Array, Case, node_costs

STRAIGHT = 0.75
"""Cells by which a polyline with fewer corners may leave the nodes."""


def prepare(case: Case) -> dict[str, Array]:
    """Isotropic costs (ny, nx) by name, J/m; -1 where there is no way."""
    costs = node_costs(case.field)
    free = np.isfinite(costs)
    dear = np.where(free, costs, np.nan)
    some, all_of = free.any(axis=2), free.all(axis=2)
    dear[~some] = 1.0
    kinds = {
        "mean, wary": (np.nanmean(dear, axis=2), all_of),
        "least, wary": (np.nanmin(dear, axis=2), all_of),
        "greatest, wary": (np.nanmax(dear, axis=2), all_of),
        "mean, bold": (np.nanmean(dear, axis=2) * costs.shape[2] / free.sum(2).clip(1), some),
    }
    return {name: np.where(way, cost, -1.0) for name, (cost, way) in kinds.items()}


def paths(case: Case, prepared: dict[str, Array]) -> Iterator[tuple[str, float, Array]]:
    """The name of a cost, CPU seconds, and the least-cost path (k, 2) through the nodes."""
    a, b = case.node(case.start), case.node(case.goal)
    for name, costs in prepared.items():
        begun = time.process_time()
        search = MCP_Geometric(costs, sampling=(case.field.dy, case.field.dx))
        search.find_costs([a], [b])
        try:
            nodes = np.array(search.traceback(b), np.int64)
        except ValueError:
            continue
        yield name, time.process_time() - begun, case.points(nodes)


def straightened(case: Case, path: Array) -> Array:
    """The same way with fewer corners (scikit-image's approximate_polygon)."""
    return np.asarray(approximate_polygon(path, STRAIGHT * min(case.field.dx, case.field.dy)))
