"""Paths beside the best one that cost hardly more on the grid, on maps of few and large cells.

    if worth_looking(run, field):
        for path in corridors(run, field, best, metres): ...   # (k, 2), cheaper once smoothed

On cells larger than a robot the moves of the grid cost some per cent more than the paths they stand
for, one more than another. So the cheapest path on the grid need not be the cheapest one. The least
cost through every node is that from the start and that to the goal. Where it is least beside the
paths that are known, another one passes.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from scipy import ndimage

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.grid import grid_path
from planner.search.run import Run
from planner.search.waypoints import refine

FEW_NODES = 20_000
"""Nodes of a map up to which they are looked for: they need two whole fields of costs, which take
little time beside a trajectory on few nodes only."""
MOST_PATHS, MOST_MORE = 2, 0.03
"""Paths beside the best one, and the share by which they may cost more on the grid."""
CELLS_BESIDE = 4.0
"""Cells from the paths that are known to a node of another one."""
SMOOTHED_CELLS = 8.0
"""Cells between the waypoints of the smoothed path that says whether it is worth driving."""


def worth_looking(run: Run, field: CostField) -> bool:
    """Whether cells are larger than the body and the map has few of them."""
    coarse = min(field.dx, field.dy) > 2.0 * field.half_length
    return coarse and field.heights.size <= FEW_NODES and len(run.places) == 2


def corridors(run: Run, field: CostField, best: Array, metres: float) -> Iterator[Array]:
    """Paths on the grid (k, 2) beside the best one that cost less once they are smoothed.

    Args:
        run: the request, from one place to another.
        field: map and costs.
        best: (k, 2) the best path on the grid.
        metres: J of its metres once it is smoothed.
    """
    start, goal = run.places
    to_goal, from_start = run.other_core.all(
        [
            partial(run.situation.least_cost_to, "energy", field, goal, None, run.token),
            partial(run.situation.least_cost_from, field, start, run.token),
        ]
    )
    through = to_goal.values.astype(float) + from_start.values
    lattice = run.situation.lattice("energy", field)
    least = float(through.min())
    known = [best]
    for _ in range(MOST_PATHS):
        run.check()
        beside = np.where(_cells_from(field, known) > CELLS_BESIDE, through, np.inf)
        node = int(beside.argmin())
        if beside.flat[node] > (1.0 + MOST_MORE) * least:
            return
        j, i = divmod(node, beside.shape[1])
        place = field.x0 + i * field.dx, field.y0 + j * field.dy
        before = grid_path(field, lattice, from_start, place)
        after = grid_path(field, lattice, to_goal, place)
        if before is None or after is None:
            return
        path = np.vstack([before, after[1:]])
        known.append(path)
        ((_, cost),) = refine(field, path, waypoint_cells=SMOOTHED_CELLS, check=run.check)
        if cost < metres:
            yield path


def _cells_from(field: CostField, paths: Sequence[Array]) -> Array:
    """(ny, nx) cells to the nearest of the nodes that some paths on the grid pass."""
    away = np.ones(field.heights.shape, bool)
    for path in paths:
        for a, b in itertools.pairwise(path):
            between = np.linspace(0.0, 1.0, 1 + round(_moves(field, b - a)))[:, None]
            away[field.nodes_at(a + between * (b - a))] = False
    return np.asarray(ndimage.distance_transform_edt(away))


def _moves(field: CostField, step: Array) -> float:
    """Cells that a straight line (2,) crosses at most along one axis."""
    return float(max(abs(step[0]) / field.dx, abs(step[1]) / field.dy, 1.0))
