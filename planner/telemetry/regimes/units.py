"""Independent pieces of a log: rows next to each other err alike, and a run may be off as a whole.

units = units_of(run, residual)
cluster_length(residual, run)          # rows
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.arrays import Array, Integers

MOST_REGIME_CLUSTERS = 160
"""Clusters of a log; the search for regimes takes time in proportion."""
LEAST_CLUSTERS = 8
"""Clusters below which a log says nothing about chance."""
LEAST_REGIME_ROWS = 10
"""Rows of a cluster, at least."""
CLUSTER_CORRELATION_TIMES = 5.0
"""Length of a cluster in correlation times, at least: its ends then hardly correlate."""


@dataclass(frozen=True, eq=False)
class Units:
    """Independent pieces of a log.

    Attributes:
        cluster: (n,) number of the cluster of every row.
        run: (n,) number of the run (or of the group of runs, where there are many).
        of: (clusters,) run of every cluster.
        runs: number of runs.
    """

    cluster: Integers
    run: Integers
    of: Integers
    runs: int

    @property
    def clusters(self) -> int:
        """Number of clusters."""
        return len(self.of)


def units_of(run: Integers, residual: Array) -> Units:
    """Cut a log into units.

    Args:
        run: (n,) label of the run; rows of a run stand together.
        residual: (n,) W, whose correlation along the run says how long a block is.
    """
    starts = np.concatenate([[0], np.flatnonzero(np.diff(run)) + 1])
    lengths = np.diff(np.append(starts, len(run)))
    runs = len(starts)
    number = np.repeat(np.arange(runs), lengths)
    means = np.bincount(number, residual) / lengths
    block = max(
        cluster_length(residual - means[number], number), -(-len(run) // MOST_REGIME_CLUSTERS)
    )
    if runs >= LEAST_CLUSTERS and (
        runs > MOST_REGIME_CLUSTERS // 2 or np.median(lengths) < 2 * block
    ):
        groups = min(runs, MOST_REGIME_CLUSTERS)
        group = number * groups // runs
        return Units(group, group, np.arange(groups), groups)
    # Every run in equal blocks of about that length.
    pieces = np.maximum(1, np.round(lengths / block)).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(pieces)])
    within = np.arange(len(run)) - starts[number]
    cluster = first[number] + within * pieces[number] // lengths[number]
    return Units(cluster, number, np.repeat(np.arange(runs), pieces), runs)


def cluster_length(residual: Array, number: Integers) -> int:
    """Rows that a block needs to be independent of the next one.

    Args:
        residual: (n,) W, less the mean of its run.
        number: (n,) number of the run.
    """
    return max(
        LEAST_REGIME_ROWS, round(CLUSTER_CORRELATION_TIMES * correlation_time(residual, number))
    )


def correlation_time(residual: Array, number: Integers) -> float:
    """Integrated correlation time in rows, 1 + 2·Σ ρ, of a residual with runs numbered (n,)."""
    power = float(residual @ residual)
    if power == 0.0:
        return 1.0
    total = 1.0
    for lag in range(1, min(400, len(residual) // 4)):
        same = number[lag:] == number[:-lag]
        pairs = int(np.count_nonzero(same))
        if pairs < len(residual) // 10:
            break
        rho = float((residual[lag:] * residual[:-lag])[same].sum()) / power * len(residual) / pairs
        if rho < 0.05:
            break
        total += 2.0 * rho
    return total
