"""What turning on the move adds to the cost of a stretch, read from a table; for compiled code.

turn_cost(table, tightest, state, span, turn)
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy", inline="always")
def turn_place(turning: Any, tightest: float, span: float, turn: float) -> Any:
    """Where a turn over ``span`` metres stands in a table (STATES, TURNS): share, and column.

    The column is -1 for what is too tight.
    """
    last = turning.shape[1] - 1
    u = abs(turn) / span / tightest * last
    if u > last:
        return 0.0, -1
    q = min(int(u), last - 1)
    return u - q, q


@njit(cache=True, error_model="numpy", inline="always")
def turn_cost_at(turning: Any, s: int, span: float, u: float, q: int) -> float:
    """What a turn adds to the cost of ``span`` metres, by its place in the table."""
    if q < 0:
        return np.inf
    cost: float = span * ((1.0 - u) * turning[s, q] + u * turning[s, q + 1])
    return cost


@njit(cache=True, error_model="numpy", inline="always")
def turn_cost(turning: Any, tightest: float, s: int, span: float, turn: float) -> float:
    """What a turn adds to the cost of ``span`` metres, by a table (STATES, TURNS)."""
    u, q = turn_place(turning, tightest, span, turn)
    cost: float = turn_cost_at(turning, s, span, u, q)
    return cost
