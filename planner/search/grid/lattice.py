"""What every move on the map's grid costs, small enough to be kept for maps of any size.

    lattice = build_lattice(field)             # for least_cost
    numbering = number_nodes(field)            # the same for all objectives: build_lattice(.., it)

A robot has 16 moves at a node: all coprime offsets of up to two cells. What a metre costs depends
on the slope and the direction only. So every node keeps the number of its slope, two bytes, in a
square grid of SLOPES_PER_AXIS² slopes. One table holds the cost of each slope in each direction. A
move costs the mean of the nodes that it passes, a quadrature whose error is far below what the few
directions lose and what planner.search.waypoints.path_smoothing takes back.

Where something stands near, or a limit may be near, nodes say little about what lies between them.
Moves from there are priced closely (close_moves), once, when a search first asks for them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Mask
from planner.compiled_code import njit
from planner.search.field import CostField, wind_cost
from planner.search.grid.close_moves import Together, move_points, node_slope
from planner.search.resolution import ALL_YAWS, COUNT, LEAST_COST, MOVES
from planner.search.second_core import in_halves
from planner.search.steady import cost_for_best_yaw, kept_table

SLOPES_PER_AXIS = 255
"""Slopes along each axis of the table: 65,025 in all, so that two bytes number them."""
PRICED_CLOSELY = 65535
"""In place of a slope's number: moves from this node are priced closely."""
MOST_CLOSE_BYTES = 600_000_000
"""Bytes for costs of such moves, of each objective; beyond it they are worked out whenever they
are needed."""

_TABLES = "best", "gentle"


@dataclass(frozen=True)
class Numbering:
    """Numbers of the nodes of a map, the same for every objective.

    Attributes:
        slopes: (ny, nx) number of the node's slope, or PRICED_CLOSELY.
        row: (ny, nx) row of ``Lattice.close`` for nodes that are priced closely, else -1; (1, 1)
            without any, or where their prices would take too much memory.
        count: of such rows.
    """

    slopes: NDArray[np.uint16]
    row: NDArray[np.int32]
    count: int

    @property
    def nbytes(self) -> int:
        """Cached bytes."""
        return self.slopes.nbytes + self.row.nbytes

    def together(self, fields: Sequence[CostField]) -> Together:
        """Room for the prices of several objectives; their fields differ in nothing else."""
        best, gentle = (np.stack([getattr(field, name) for field in fields]) for name in _TABLES)
        close = np.full((len(fields), self.count, COUNT), np.nan, np.float32)
        return Together(best, gentle, close, move_points(fields[0]))


class Lattice(NamedTuple):
    """Costs of the moves of one map for one model, as the compiled search reads them."""

    slopes: NDArray[np.uint16]
    """Of the numbering."""
    table: NDArray[np.float32]
    """(grounds, SIDE², COUNT) cost of each slope over half the length of each move; a quarter of
    it where a move also passes between two nodes."""
    moves: NDArray[np.int64]
    """(COUNT, 2) columns and rows."""
    beside: NDArray[np.int64]
    """(COUNT, 2, 2) columns and rows of the two nodes that a move passes between; or zeros."""
    row: NDArray[np.int32]
    """Of the numbering."""
    close: NDArray[np.float32]
    """(rows, COUNT) of ``together``, for this objective."""
    together: Together
    factor: NDArray[np.float64]
    """(ny, nx) factor on the cost of moves from a node, or (1, 1): ground to be avoided."""
    cheapest: float
    """Cost per metre that no move undercuts."""

    @property
    def nbytes(self) -> int:
        """Cached bytes, without those of the numbering."""
        return self.table.nbytes + self.close.nbytes


class _MoveCosts(NamedTuple):
    """Of a lattice, what follows from model, conditions and cell alone: ``table``, ``cheapest``."""

    table: NDArray[np.float32]
    cheapest: float


def number_nodes(field: CostField) -> Numbering:
    """Number the slopes of a map's nodes; the objective of the field does not matter."""
    ny, nx = field.heights.shape
    slopes = np.empty((ny, nx), np.uint16)
    in_halves(ny, partial(_number_slopes, field, _reach(field), slopes))
    closely = slopes == PRICED_CLOSELY
    count = int(np.count_nonzero(closely))
    if count == 0 or count * COUNT * 4 + closely.size * 4 > MOST_CLOSE_BYTES:
        return Numbering(slopes, np.full((1, 1), -1, np.int32), 1)
    row = np.full((ny, nx), -1, np.int32)
    row[closely] = np.arange(count, dtype=np.int32)
    return Numbering(slopes, row, count)


def _reach(field: CostField) -> float:
    """Largest slope along an axis that has a number."""
    return max(field.safe, 1e-9)


def build_lattice(
    field: CostField,
    numbering: Numbering | None = None,
    key: tuple[object, ...] | None = None,
    together: tuple[Together, int] | None = None,
) -> Lattice:
    """Costs of the moves of a map for one model and one objective.

    Args:
        field: map and costs, with no ground to be avoided: see ``Lattice.factor``.
        numbering: of a field for the same map and model, if there is one.
        key: what the costs of the field follow from, for a table that all maps and processes share
            (planner.search.steady.kept_table); None works it out anew.
        together: prices of several objectives, and which of them this one is.
    """
    numbering = number_nodes(field) if numbering is None else numbering
    shared, own = together or (numbering.together([field]), 0)
    beside = np.stack([np.floor(MOVES / 2), np.ceil(MOVES / 2)], axis=1).astype(np.int64)
    beside[np.abs(MOVES).max(axis=1) < 2] = 0
    between: Mask = np.asarray(beside.any(axis=(1, 2)))
    if key is None:
        costs = _move_costs(field, between)
    else:
        key = (__name__, *key, field.safe, field.dx, field.dy)
        costs = kept_table(key, _MoveCosts, lambda: _move_costs(field, between))
    return Lattice(
        numbering.slopes,
        costs.table,
        MOVES,
        beside,
        numbering.row,
        shared.close[own],
        shared,
        np.ones((1, 1)),
        costs.cheapest,
    )


def _move_costs(field: CostField, between: Mask) -> _MoveCosts:
    """``between``: (COUNT,) whether a move passes between two nodes."""
    shares = np.hypot(MOVES[:, 0] * field.dx, MOVES[:, 1] * field.dy)
    shares *= np.where(between, 0.25, 0.5)
    table = np.full(
        (field.best.shape[0], SLOPES_PER_AXIS * SLOPES_PER_AXIS, COUNT), np.inf, np.float32
    )
    directions = np.arctan2(MOVES[:, 1] * field.dy, MOVES[:, 0] * field.dx)
    in_halves(
        SLOPES_PER_AXIS, partial(_fill_table, field, _reach(field), directions, shares, table)
    )
    finite = np.isfinite(field.best)
    cheapest = float(field.best[finite].min(initial=math.inf)) + min(0.0, float(field.extra.min()))
    least = max(cheapest, LEAST_COST) if math.isfinite(cheapest) else LEAST_COST
    return _MoveCosts(table, least)


@njit(cache=True, error_model="numpy", nogil=True)
def _number_slopes(field: Any, reach: float, slopes: Any, first: int, last: int) -> None:
    ny, nx = field.heights.shape
    half = (SLOPES_PER_AXIS - 1) // 2
    for j in range(first, last):
        for i in range(nx):
            slopes[j, i] = PRICED_CLOSELY
            if field.steep[j, i]:
                continue
            crowded = False
            for b in range(max(j - 2, 0), min(j + 3, ny)):
                for a in range(max(i - 2, 0), min(i + 3, nx)):
                    crowded |= field.mask[b, a] != ALL_YAWS
            if crowded:
                continue
            px, py = node_slope(field, j, i)
            u = int(math.floor(px / reach * half + 0.5))
            v = int(math.floor(py / reach * half + 0.5))
            if abs(u) <= half and abs(v) <= half:
                slopes[j, i] = (v + half) * SLOPES_PER_AXIS + u + half


@njit(cache=True, error_model="numpy", nogil=True)
def _fill_table(
    field: Any, reach: float, directions: Any, shares: Any, table: Any, first: int, last: int
) -> None:
    half = (SLOPES_PER_AXIS - 1) // 2
    for v in range(first, last):
        for u in range(SLOPES_PER_AXIS):
            px, py = (u - half) * reach / half, (v - half) * reach / half
            steepness = math.sqrt(px * px + py * py)
            azimuth = math.atan2(py, px)
            for ground in range(table.shape[0]):
                for m in range(directions.shape[0]):
                    cost = cost_for_best_yaw(
                        field.best, field.limit, ground, azimuth - directions[m], steepness, 1.0
                    )
                    cost = max(cost + wind_cost(field, directions[m]), LEAST_COST)
                    table[ground, v * SLOPES_PER_AXIS + u, m] = cost * shares[m]
