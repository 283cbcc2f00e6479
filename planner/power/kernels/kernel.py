"""A compiled kernel: its types in numba, and its loops over rows, one by one or BLOCK at a time.

    KERNEL          fills an account for one row
    BLOCK_KERNEL    wants the values of each quantity side by side (row_blocks.py)

Compiled loops elsewhere take any model's kernel as an argument of one of the two types.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from planner.arrays import Array
from planner.compiled_code import njit
from planner.errors import InputError
from planner.power.account import ACCOUNT_LENGTH, PER_WHEEL
from planner.power.kernels.row_blocks import BLOCK
from planner.quantities import ROW_LENGTH

_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
KERNEL = types.FunctionType(types.float64(_F1, _F1, _F1, _F2, _F1, _F2))
"""Type of a compiled real kernel."""
BLOCK_KERNEL = types.FunctionType(types.void(_F1, types.int64, _F1, _F1, _F2, _F1))
"""Type of a compiled real kernel that takes a block of rows."""


class Kernel:
    """A compiled ``evaluate``, to be called or handed to compiled loops.

    numba would look up type and address of a plain compiled function at every call that it is
    handed to, which takes longer than a short loop itself. Both names with underscores are numba's.

    Attributes:
        name: of the module that was written for it; follows from all that the kernel follows from.
    """

    def __init__(self, evaluate: Any) -> None:
        [compiled] = evaluate.overloads.values()
        name = compiled.fndesc.llvm_cfunc_wrapper_name
        self.name: str = evaluate.__module__
        self._evaluate = evaluate
        self._address: int = compiled.library.get_pointer_to_function(name)
        self._numba_type_ = types.FunctionType(compiled.signature)

    def __call__(self, *arguments: Any) -> Any:
        return self._evaluate(*arguments)

    def __wrapper_address__(self) -> int:
        return self._address

    def accounts(
        self, rows: Array, parameters: Array, body: Array, wheels: Array
    ) -> tuple[Array, Array]:
        """Accounts (n, ACCOUNT_LENGTH) of all rows, and per-wheel values of the last row.

        For a kernel of type KERNEL.
        """
        rows = _checked(rows)
        accounts = np.empty((len(rows), ACCOUNT_LENGTH))
        per_wheel = np.empty((len(wheels), len(PER_WHEEL)))
        _over_rows(self, rows, parameters, body, wheels, accounts, per_wheel)
        return accounts, per_wheel

    def results(
        self, rows: Array, parameters: Array, body: Array, wheels: Array, *, count: int
    ) -> Array:
        """The ``count`` results of every row, (n, count).

        For a kernel of type BLOCK_KERNEL.
        """
        rows = _checked(rows)
        results = np.empty((len(rows), count))
        _over_blocks(self, rows, parameters, body, wheels, results)
        return results


def _checked(rows: Any) -> Array:
    """Rows as compiled code needs them, which reads whatever lies behind shorter ones.

    Raises:
        InputError: they are not (n, ROW_LENGTH) numbers.
    """
    try:
        found = np.ascontiguousarray(rows, dtype=float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.ndim != 2 or found.shape[1] != ROW_LENGTH:
        raise InputError(
            "rows",
            "are not rows of the power model",
            value=getattr(rows, "shape", rows),
            accepted=f"numbers of shape (n, {ROW_LENGTH}), as planner.power.rows.rows_from gives",
        )
    return found


@njit(types.void(KERNEL, _F2, _F1, _F1, _F2, _F2, _F2), cache=True, error_model="numpy", nogil=True)
def _over_rows(
    kernel: Any, rows: Any, parameters: Any, body: Any, wheels: Any, accounts: Any, per_wheel: Any
) -> None:
    for k in range(rows.shape[0]):
        kernel(rows[k], parameters, body, wheels, accounts[k], per_wheel)


@njit(
    types.void(BLOCK_KERNEL, _F2, _F1, _F1, _F2, _F2), cache=True, error_model="numpy", nogil=True
)
def _over_blocks(
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
