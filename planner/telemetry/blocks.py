"""Blocks of consecutive rows: the units that are taken to be independent of each other.

    number = block_numbers(log)          # (n,) block of every row
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.telemetry.log import Telemetry
from planner.telemetry.noise import run_pieces

BLOCK_ROWS = 30
MOST_BLOCKS = 400


def block_numbers(log: Telemetry, rows: int = BLOCK_ROWS) -> NDArray[np.int64]:
    """(n,) number of every row's block, counting from 0; a block never spans two runs.

    Args:
        log: the rows.
        rows: length of a block; what is left at the end of a run joins the last one.
    """
    number = np.empty(len(log), np.int64)
    first = 0
    for start, stop in run_pieces(log):
        length = stop - start
        last = max(length // rows - 1, 0)
        number[start:stop] = first + np.minimum(np.arange(length) // rows, last)
        first += last + 1
    return number
