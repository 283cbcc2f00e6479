"""Whitened columns of a log, cluster by cluster: what every test of the evidence is summed up from.

    clusters = RowClusters(white, numbers, runs)     # rows that are in memory
    clusters.total()                         # (columns, columns), all rows
    clusters.times(v)                        # (clusters, columns), every cluster's ZᵀZ·v
    clusters.partial_grams(at, own, beta)    # (clusters, k, k), what ``own`` leaves of columns

The rows take a fiftieth of the room that a Gram matrix of every cluster takes. A column's products
are formed when they are asked for.
"""

from __future__ import annotations

import numpy as np

from planner.arrays import Array, Integers


class RowClusters:
    """Clusters of whitened rows in memory.

    Args:
        white: (n, columns).
        numbers: (n,) number of the cluster, not decreasing.
        runs: (n,) number of the run.
    """

    def __init__(self, white: Array, numbers: Integers, runs: Integers) -> None:
        self.white = white
        self.starts = np.concatenate([[0], np.flatnonzero(np.diff(numbers)) + 1])
        self.stops = np.append(self.starts[1:], len(white))
        self.runs = np.asarray(runs)[self.starts]

    def total(self) -> Array:
        """(columns, columns) ZᵀZ of all rows."""
        return np.asarray(self.white.T @ self.white)

    def part(self, numbers: Integers) -> Array:
        """(columns, columns) ZᵀZ of some clusters."""
        rows = np.zeros(len(self.white), bool)
        for number in numbers:
            rows[self.starts[number] : self.stops[number]] = True
        some = self.white[rows]
        return np.asarray(some.T @ some)

    def times(self, v: Array) -> Array:
        """(clusters, columns) ZᵀZ·v of every cluster; ``v`` is (columns,)."""
        along = self.white @ v
        pieces = zip(self.starts, self.stops, strict=True)
        return np.stack([along[start:stop] @ self.white[start:stop] for start, stop in pieces])

    def partial_grams(self, at: Integers, own: Integers, beta: Array) -> Array:
        """(clusters, k, k) Gram matrices of Z[:, at] - Z[:, own]·beta, ``beta`` being (own, k)."""
        left = self._left(at, own, beta)
        pieces = zip(self.starts, self.stops, strict=True)
        return np.stack([left[start:stop].T @ left[start:stop] for start, stop in pieces])

    def partial_diagonals(self, at: Integers, own: Integers, beta: Array) -> Array:
        """(clusters, k) the diagonals of ``partial_grams``."""
        return np.asarray(np.add.reduceat(self._left(at, own, beta) ** 2, self.starts, axis=0))

    def _left(self, at: Integers, own: Integers, beta: Array) -> Array:
        return np.asarray(self.white[:, at] - self.white[:, own] @ beta)
