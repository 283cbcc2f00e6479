"""Clusters of rows: consecutive, never empty, of one run where runs are long."""

from __future__ import annotations

import numpy as np
import pytest

from planner.telemetry.sampling.clusters import LEAST_CLUSTER_ROWS, cluster_numbers
from tests.telemetry.rows import plain_log

LENGTHS = {
    "one run": [4000],
    "one row": [1],
    "runs of one row": [1] * 700,
    "short runs": [17] * 90,
    "just below two blocks": [2 * LEAST_CLUSTER_ROWS - 1] * 5,
    "of all lengths": [1, 300, 2, 29, 30, 31, 3000, 5, 61],
}


@pytest.mark.parametrize("most", [5, 200])
@pytest.mark.parametrize("lengths", LENGTHS.values(), ids=LENGTHS)
def test_blocks_are_consecutive_and_never_empty(lengths, most):
    log = plain_log(lengths)
    number = cluster_numbers(log, most)
    assert number[0] == 0
    assert set(np.diff(number).tolist()) <= {0, 1}
    counts = np.bincount(number)
    assert len(counts) <= most + len(lengths)
    # Rows of a run share a block with those of another only where a run is shorter than a block.
    size = max(LEAST_CLUSTER_ROWS, -(-len(log) // most))
    for block in range(len(counts)):
        runs, rows = np.unique(log.run[number == block], return_counts=True)
        assert len(runs) == 1 or (rows.sum() <= size and np.all(np.array(lengths)[runs] <= size))
    assert counts.max() < 2 * size
