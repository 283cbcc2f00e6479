"""The table of dual_power on even grids, as compiled loops read it.

table = even_table(priced)
watts = table_watts(table, table.watts, share, cross, load)    # W, inside compiled code
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.certificate.dual_power import PricedPower, Robot

GEAR_STEPS = 14
"""Steps of the even table between the prices at which driven and driving gears are paid off."""


class PriceField(NamedTuple):
    """Multipliers at the nodes: A = [[share + b1, b2], [b2, share - b1]] times the velocity."""

    share: Array
    rotor: Array
    b1: Array
    b2: Array


class PriceTable(NamedTuple):
    """The table of dual_power on even grids, as compiled loops read it.

    Attributes:
        watts: (a, b, 2) W at full speed, by price along and across the travel, and load.
        standing: (a, b) W that is left at rest.
        low, step, cross, cross_step, load, load_step: first nodes of the grid, and its steps.
        robot: speed and masses.
        heavier: whether more load never takes less power.
    """

    watts: Array
    standing: Array
    low: float
    step: float
    cross: float
    cross_step: float
    load: float
    load_step: float
    robot: Robot
    heavier: bool


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
        priced.robot,
        bool((watts[..., 1] >= watts[..., 0]).all()),
    )


def _even_grid(priced: PricedPower) -> tuple[Array, Array]:
    """Shares and cross shares of the even table."""
    forward, backward = 1.0 / priced.robot.efficiency, 2.0 - 1.0 / priced.robot.efficiency
    # Both kinks of the rotors' price are nodes; a gear without loss has none.
    step = (forward - backward) / GEAR_STEPS if forward > backward + 0.01 else 0.05
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
def table_watts(t: Any, watts: Any, share: float, cross: float, load: float) -> float:
    """Values (a, b, 2) on the grid of a table, interpolated; minus infinity beyond it.

    ``watts`` are those of the table itself, or of one below full speed.
    """
    a = (share - t.low) / t.step
    b = (cross - t.cross) / t.cross_step
    c = (load - t.load) / t.load_step if t.load_step > 0.0 else 0.0
    rows, columns = watts.shape[0], watts.shape[1]
    if a < -1e-9 or b < -1e-9 or a > rows - 1.0 + 1e-9 or b > columns - 1.0 + 1e-9:
        return -np.inf
    if c < -1e-6 or c > 1.0 + 1e-6:
        return -np.inf
    i, j = min(max(int(a), 0), rows - 2), min(max(int(b), 0), columns - 2)
    a, b = a - i, b - j
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
def least_at_rest(t: Any, share: float, size: float) -> float:
    """W left at rest in any direction, for prices share ± size along and ± size across."""
    least = np.inf
    i0 = int(math.floor((share - size - t.low) / t.step))
    i1 = int(math.ceil((share + size - t.low) / t.step))
    j0 = int(math.floor((-size - t.cross) / t.cross_step))
    j1 = int(math.ceil((size - t.cross) / t.cross_step))
    for i in range(max(i0, 0), min(i1, t.standing.shape[0] - 1) + 1):
        for j in range(max(j0, 0), min(j1, t.standing.shape[1] - 1) + 1):
            least = min(least, t.standing[i, j])
    return least
