"""Plain Dijkstra: scipy's, on a directed graph of the map's nodes with our cost of every edge.

    graph = prepare(case)
    seconds, path = shortest(case, graph)

Edges are the same 16 moves that our grid has, each priced closely. networkx would do the same with
Python objects for four million edges; scipy's compiled search is the fairer peer.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numba import njit
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from planner.search.field import segment_cost
from planner.search.resolution import grid_moves
from tests.benchmarks.peers.case import Array, Case


def prepare(case: Case) -> csr_array:
    """The graph of all moves, J; nodes are numbered along the rows."""
    rows, columns, costs = _edges(case.field, grid_moves())
    count = case.field.heights.size
    return csr_array((costs, (rows, columns)), shape=(count, count))


@njit(cache=True, error_model="numpy")
def _edges(field: Any, moves: Any) -> Any:
    ny, nx = field.heights.shape
    most = ny * nx * moves.shape[0]
    rows, columns = np.empty(most, np.int32), np.empty(most, np.int32)
    costs = np.empty(most)
    n = 0
    for j in range(ny):
        for i in range(nx):
            if field.mask[j, i] == 0:
                continue
            x, y = field.x0 + i * field.dx, field.y0 + j * field.dy
            for k in range(moves.shape[0]):
                a, b = i + moves[k, 0], j + moves[k, 1]
                if a < 0 or b < 0 or a >= nx or b >= ny:
                    continue
                u, v = field.x0 + a * field.dx, field.y0 + b * field.dy
                cost = segment_cost(field, x, y, u, v, field.step)
                if cost < np.inf:
                    rows[n], columns[n], costs[n] = j * nx + i, b * nx + a, cost
                    n += 1
    return rows[:n].copy(), columns[:n].copy(), costs[:n].copy()


def shortest(case: Case, graph: csr_array) -> tuple[float, Array | None]:
    """CPU seconds, and the least-cost path (k, 2); None where there is none."""
    nx = case.field.heights.shape[1]
    (j, i), (goal_j, goal_i) = case.node(case.start), case.node(case.goal)
    begun = time.process_time()
    _, before = dijkstra(graph, indices=j * nx + i, return_predecessors=True)
    node = goal_j * nx + goal_i
    nodes = [node]
    while node >= 0 and node != j * nx + i:
        node = int(before[node])
        nodes.append(node)
    seconds = time.process_time() - begun
    if node < 0:
        return seconds, None
    numbers = np.array(nodes[::-1], np.int64)
    return seconds, case.points(np.column_stack([numbers // nx, numbers % nx]))
