"""Clusters of consecutive rows, which are taken to be independent of each other.

number = cluster_numbers(log)          # (n,) cluster of every row
"""

from __future__ import annotations

import numpy as np

from planner.arrays import Integers
from planner.telemetry.logs import Telemetry

LEAST_CLUSTER_ROWS = 30
"""Rows of a cluster, at least."""
MOST_CLUSTERS = 200
"""Clusters of a log; more do not sharpen a standard error that scatters by 5 % already."""


def cluster_numbers(log: Telemetry, most: int = MOST_CLUSTERS) -> Integers:
    """(n,) number of every row's cluster, counting from 0.

    A cluster has at least LEAST_CLUSTER_ROWS rows of one run, more in a long log. Shorter runs are
    put together. There are never more than ``most`` clusters.
    """
    pieces = log.run_pieces()
    rows = max(LEAST_CLUSTER_ROWS, -(-len(log) // most))
    number = np.empty(len(log), np.int64)
    current, filled, last_stop = 0, 0, 0
    for start, stop in pieces:
        length = stop - start
        if filled and filled + length > rows:
            current, filled = current + 1, 0
        if length <= rows:
            number[start:stop] = current
            filled += length
        else:
            count = length // rows
            number[start:stop] = current + np.minimum(np.arange(length) // rows, count - 1)
            current, filled = current + count, 0
        last_stop = stop
    assert last_stop == len(log)
    return number
