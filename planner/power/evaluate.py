"""A compiled power model over many rows: one after the other, or BLOCK at a time.

Called by planner.power.model alone. ``evaluate_rows`` takes the kernel that fills an account for
one row; ``evaluate_in_blocks`` takes the one of planner.power.row_blocks, which wants the values of
each quantity side by side, and puts rows in that order and results back.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from planner.power.compile_kernel import BLOCK_KERNEL, KERNEL
from planner.power.row_blocks import BLOCK

_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")


@njit(types.void(KERNEL, _F2, _F1, _F1, _F2, _F2, _F2), cache=True, error_model="numpy", nogil=True)
def evaluate_rows(
    kernel: Any, rows: Any, parameters: Any, body: Any, wheels: Any, accounts: Any, per_wheel: Any
) -> None:
    for k in range(rows.shape[0]):
        kernel(rows[k], parameters, body, wheels, accounts[k], per_wheel)


@njit(
    types.void(BLOCK_KERNEL, _F2, _F1, _F1, _F2, _F2), cache=True, error_model="numpy", nogil=True
)
def evaluate_in_blocks(
    kernel: Any, rows: Any, parameters: Any, body: Any, wheels: Any, results: Any
) -> None:
    columns, found = np.empty(rows.shape[1] * BLOCK), np.empty(results.shape[1] * BLOCK)
    for start in range(0, rows.shape[0], BLOCK):
        count = min(BLOCK, rows.shape[0] - start)
        for k in range(count):
            for quantity in range(rows.shape[1]):
                columns[quantity * BLOCK + k] = rows[start + k, quantity]
        kernel(columns, count, parameters, body, wheels, found)
        for k in range(count):
            for result in range(results.shape[1]):
                results[start + k, result] = found[result * BLOCK + k]
