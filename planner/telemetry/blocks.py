"""Blocks of consecutive rows: the units that are taken to be independent of each other.

number = block_numbers(log)          # (n,) block of every row
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.telemetry.log import Telemetry
from planner.telemetry.noise import run_pieces

BLOCK_ROWS = 30
MOST_BLOCKS = 200


def block_numbers(log: Telemetry, most: int = MOST_BLOCKS) -> NDArray[np.int64]:
    """(n,) number of every row's block, counting from 0.

    A block has at least BLOCK_ROWS rows of one run, more in a long log. Runs that are shorter than
    that are put together, so that there are never more than ``most`` blocks.
    """
    pieces = list(run_pieces(log))
    rows = max(BLOCK_ROWS, -(-len(log) // most))
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
