"""Cost of turning on the move, read from a table by compiled code.

turn_cost(prices, state, span, turn)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.kernel_arguments import F2, tuple_type


class Turning(NamedTuple):
    """Costs of turning and stopping, in J or in s.

    Attributes:
        stop: speeding up again after a stop on the way.
        tightest: rad/m up to which turning on the move is tabulated.
        table: (STATES, TURNS) what turning adds to a level metre, by the angle to the travel and by
            rad/m from 0 to ``tightest``; infinite where it is impossible.
    """

    stop: float
    tightest: float
    table: Array

    @property
    def nbytes(self) -> int:
        """Memory that the cache counts."""
        return self.table.nbytes


TURNING = tuple_type(Turning, types.float64, types.float64, F2)


@njit(cache=True, error_model="numpy", inline="always")
def turn_place(prices: Any, span: float, turn: float) -> Any:
    """Where a turn over ``span`` metres stands in the table: share of the next column, and column.

    The column is -1 for a turn that is too tight.
    """
    last = prices.table.shape[1] - 1
    u = abs(turn) / span / prices.tightest * last
    if u > last:
        return 0.0, -1
    q = min(int(u), last - 1)
    return u - q, q


@njit(cache=True, error_model="numpy", inline="always")
def turn_cost(prices: Any, state: int, span: float, turn: float) -> float:
    """Cost that a turn adds to ``span`` metres at an angle ``state`` to the travel."""
    u, q = turn_place(prices, span, turn)
    if q < 0:
        return np.inf
    cost: float = span * ((1.0 - u) * prices.table[state, q] + u * prices.table[state, q + 1])
    return cost
