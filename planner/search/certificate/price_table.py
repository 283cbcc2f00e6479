"""The table of dual_power on even grids, as compiled loops read it.

table = even_table(priced)
watts = table_watts(table, share, cross, load)     # W at full speed, inside compiled code
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from planner.arrays import Array
from planner.search.certificate.dual_power import PricedPower

FINE = 14
"""Steps of the fine table between the prices at which driven and driving gears are paid off."""


class PriceField(NamedTuple):
    """Prices of force at the nodes: A = [[share + b1, b2], [b2, share - b1]] times the velocity."""

    share: Array
    rotor: Array
    b1: Array
    b2: Array


class PriceTable(NamedTuple):
    """The table of dual_power on even grids, as compiled loops read it."""

    watts: Array
    standing: Array
    low: float
    step: float
    cross: float
    cross_step: float
    load: float
    load_step: float
    speed: float
    weight: float
    moving: float
    rotors: float
    efficiency: float
    rotor_slack: float
    heavier: bool
    """Whether more load never takes less power."""


def even_table(priced: PricedPower) -> PriceTable:
    """The table on even grids. Q is concave, so that interpolated values are below it as well."""
    share, cross = _even_grid(priced)
    nodes = priced.shares, priced.cross
    watts = even_watts(priced, *nodes, priced.watts)
    return PriceTable(
        watts,
        even_watts(priced, *nodes, priced.standing[..., None])[..., 0].copy(),
        float(share[0]),
        float(share[1] - share[0]),
        float(cross[0]),
        float(cross[1] - cross[0]),
        float(priced.loads[0]),
        float(priced.loads[1] - priced.loads[0]),
        priced.speed,
        priced.weight,
        priced.moving,
        priced.rotors,
        priced.efficiency,
        priced.rotor_slack,
        bool((watts[..., 1] >= watts[..., 0]).all()),
    )


def _even_grid(priced: PricedPower) -> tuple[Array, Array]:
    """Shares and cross shares of the even table."""
    forward, backward = 1.0 / priced.efficiency, 2.0 - 1.0 / priced.efficiency
    # Both kinks of the rotors' price are nodes; a gear without loss has none.
    step = (forward - backward) / FINE if forward > backward + 0.01 else 0.05
    below = math.floor((backward - priced.shares[0]) / step)
    above = math.floor((priced.shares[-1] - backward) / step)
    cross = np.linspace(-priced.cross[-1], priced.cross[-1], 49)
    return backward + step * np.arange(-below, above + 1), cross


def even_watts(priced: PricedPower, shares: Array, cross: Array, watts: Array) -> Array:
    """Values (a, b, loads) at such prices on the even grid."""
    share, across = _even_grid(priced)
    at = np.abs(across) if priced.cross[0] >= 0.0 else across

    def spread(values: Array) -> Array:
        along = np.stack([np.interp(share, shares, column) for column in values.T], axis=1)
        return np.stack([np.interp(at, cross, row) for row in along])

    return np.stack([spread(values) for values in np.moveaxis(watts, -1, 0)], axis=2)


@njit(cache=True, error_model="numpy", inline="always")
def table_watts(t: Any, share: float, cross: float, load: float) -> float:
    """Q with idle power, W; prices beyond the table give minus infinity."""
    i, a, j, b = node_of(t, share, cross)
    c = (load - t.load) / t.load_step if t.load_step > 0.0 else 0.0
    if i < 0 or c < -1e-6 or c > 1.0 + 1e-6:
        return -np.inf
    return between(t.watts, i, a, j, b, c)


@njit(cache=True, error_model="numpy", inline="always")
def node_of(t: Any, share: float, cross: float) -> tuple[int, float, int, float]:
    """Where prices lie on the grid: two nodes and the shares of the next ones; -1 beyond it."""
    a = (share - t.low) / t.step
    b = (cross - t.cross) / t.cross_step
    rows, columns = t.watts.shape[0], t.watts.shape[1]
    if a < -1e-9 or b < -1e-9 or a > rows - 1.0 + 1e-9 or b > columns - 1.0 + 1e-9:
        return -1, 0.0, -1, 0.0
    i = min(max(int(a), 0), rows - 2)
    j = min(max(int(b), 0), columns - 2)
    return i, a - i, j, b - j


@njit(cache=True, error_model="numpy", inline="always")
def between(watts: Any, i: int, a: float, j: int, b: float, c: float) -> float:
    """Values (a, b, 2) on the grid of the table, linear in both prices and the load."""
    value = 0.0
    for k in range(2):
        w = c if k else 1.0 - c
        value += w * (
            (1.0 - a) * ((1.0 - b) * watts[i, j, k] + b * watts[i, j + 1, k])
            + a * ((1.0 - b) * watts[i + 1, j, k] + b * watts[i + 1, j + 1, k])
        )
    return value


@njit(cache=True, error_model="numpy", inline="always")
def rotor_price(share: float, efficiency: float) -> float:
    """dual_power.rotor_share for one share."""
    backward = 2.0 - 1.0 / efficiency
    return min(1.0, share / backward) + max(0.0, share * efficiency - 1.0)


@njit(cache=True, error_model="numpy")
def least_standing(t: Any, share: float, size: float) -> float:
    """W left at rest for any direction, prices share ± size along and ± size across."""
    least = np.inf
    i0 = int(math.floor((share - size - t.low) / t.step))
    i1 = int(math.ceil((share + size - t.low) / t.step))
    j0 = int(math.floor((-size - t.cross) / t.cross_step))
    j1 = int(math.ceil((size - t.cross) / t.cross_step))
    for i in range(max(i0, 0), min(i1, t.standing.shape[0] - 1) + 1):
        for j in range(max(j0, 0), min(j1, t.standing.shape[1] - 1) + 1):
            least = min(least, t.standing[i, j])
    return least
