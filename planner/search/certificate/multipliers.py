"""Multipliers at every node: those that a good motion would pay there.

Any prices give a valid bound (triangle_costs); these make it a good one. At a node, they make the
floor of the cost largest for the direction in which the best route would pass, on the slope there.
Changing prices cost. So they are smoothed over the length of driving that costs as much as the
robot's kinetic energy. Ground that does not matter takes them over from ground that does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, maximum_filter

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.certificate.price_table import PriceField, PriceTable, table_watts
from planner.search.certificate.triangle_costs import Ground

TABLE_SLOPES = 41
"""Slopes along and across for which the best prices are tabulated."""
WORTH_EXCESS = 0.02
"""Excess over the best route, as a share of it, at which ground matters half as much or less."""
MILDER = 0.4
"""Share by which prices near a bad cell come nearer to those of no dissipation, each time."""
MILDER_STRETCH = 3.0
"""Width of that, in lengths of driving that cost as much as the robot's kinetic energy."""
AVERAGING = ((1.0, 1.0), (2.5, 0.1), (6.0, 0.01))
"""Lengths over which prices are averaged, and the weight of each."""
MOST_EARNING = 0.75
"""Share of the level cost that descending at the price may earn."""


@dataclass(frozen=True)
class BestPrices:
    """The best prices by slope.

    Attributes:
        table: (TABLE_SLOPES, TABLE_SLOPES, 2) share along and across, by slope along and across.
        steepest: slope at the table's borders.
        level: J/m of the floor on level ground; where it is not above 0, prices do not help.
    """

    table: Array
    steepest: float
    level: float


@njit(cache=True, error_model="numpy", nogil=True)
def _fill_best(t: Any, steepest: float, best: Any, metres: Any) -> None:
    count = best.shape[0]
    # The largest rolling factor on the map, where all ground rolls more easily than as measured.
    factor = min(1.0, t.load + t.load_step)
    for a in range(count):
        along = steepest * (2.0 * a / (count - 1) - 1.0)
        stretch = math.sqrt(1.0 + along * along)
        for b in range(count):
            across = steepest * (2.0 * b / (count - 1) - 1.0)
            # Nobody drives ground steeper than at the table's least load: as for that load.
            normal = math.sqrt(1.0 + along * along + across * across)
            load = max(factor / normal, t.load)
            for i in range(t.watts.shape[0]):
                share = t.low + i * t.step
                for j in range(t.watts.shape[1]):
                    cross = t.cross + j * t.cross_step
                    metre = table_watts(t, t.watts, share, cross, load) * stretch / t.robot.speed
                    rise = (share - 1.0) * along + cross * across / (normal * stretch)
                    metre += t.robot.weight * rise
                    if metre > metres[a, b]:
                        metres[a, b] = metre
                        best[a, b, 0], best[a, b, 1] = share, cross


def best_prices(t: PriceTable, steepest: float) -> BestPrices:
    """Tabulate the best prices for slopes up to ``steepest`` along and across."""
    table = np.empty((TABLE_SLOPES, TABLE_SLOPES, 2))
    metres = np.full((TABLE_SLOPES, TABLE_SLOPES), -np.inf)
    _fill_best(t, steepest, table, metres)
    return BestPrices(table, steepest, float(metres[TABLE_SLOPES // 2, TABLE_SLOPES // 2]))


def filled(values: Array) -> Array:
    """Costs (ny, nx) with the nearest finite one where there is no path."""
    reached = np.isfinite(values)
    if reached.all():
        return values
    nearest = distance_transform_edt(~reached, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])


def travel(to_goal: Array, from_start: Array, cell: tuple[float, float]) -> tuple[Array, Array]:
    """Direction (2, ny, nx) of a good route through every node, and how much the node matters.

    Args:
        to_goal: (ny, nx) least cost from each node to the goal, finite.
        from_start: the same from the start to each node.
        cell: dx, dy, m.
    """
    total = to_goal + from_start
    least = max(float(total.min()), 1e-9)
    worth = (1.0 + (total - least) / (WORTH_EXCESS * least)) ** -4.0
    goal_y, goal_x = np.gradient(gaussian_filter(to_goal, 1.0), cell[1], cell[0])
    start_y, start_x = np.gradient(gaussian_filter(from_start, 1.0), cell[1], cell[0])
    # Near the goal the cost-to-come has the better direction, near the start the cost-to-go.
    along = np.stack(
        [start_x * from_start - goal_x * to_goal, start_y * from_start - goal_y * to_goal]
    )
    return along / np.maximum(np.hypot(*along), 1e-12), worth


def _lookup(best: BestPrices, along: Array, across: Array) -> Array:
    """Prices (..., 2) for slopes, bilinear."""
    half = 0.5 * (TABLE_SLOPES - 1)
    a = np.clip((along / best.steepest + 1.0) * half, 0.0, TABLE_SLOPES - 1.0)
    b = np.clip((across / best.steepest + 1.0) * half, 0.0, TABLE_SLOPES - 1.0)
    i, j = np.minimum(a.astype(int), TABLE_SLOPES - 2), np.minimum(b.astype(int), TABLE_SLOPES - 2)
    u, w = (a - i)[..., None], (b - j)[..., None]
    low = best.table[i, j] * (1.0 - w) + best.table[i, j + 1] * w
    high = best.table[i + 1, j] * (1.0 - w) + best.table[i + 1, j + 1] * w
    return np.asarray(low * (1.0 - u) + high * u)


def _reach(
    t: PriceTable,
    level: float,
    cell: tuple[float, float],
    shape: tuple[int, ...],
    stretch: float,
) -> tuple[float, float]:
    """Standard deviation of the averaging, in nodes along y and x; the map's size at most."""
    length = stretch * 0.5 * t.robot.moving * t.robot.speed**2 / level
    ny, nx = shape
    return min(max(1.0, length / cell[1]), ny), min(max(1.0, length / cell[0]), nx)


def force_multipliers(
    t: PriceTable,
    best: BestPrices,
    ground: Ground,
    direction: Array,
    worth: Array,
    stretch: float,
) -> PriceField:
    """Prices at the nodes.

    Args:
        t, best: tables of the model.
        ground: nodes and cells.
        direction: (2, ny, nx) unit vectors in which a good route passes.
        worth: (ny, nx) above 0, how much each node matters.
        stretch: length of averaging, in lengths of driving that cost the robot's kinetic energy.
    """
    ranges, cell = ground.ranges, (ground.dx, ground.dy)
    slope_y, slope_x = np.gradient(ground.heights, cell[1], cell[0])
    ex, ey = direction
    chosen = _lookup(best, slope_x * ex + slope_y * ey, slope_y * ex - slope_x * ey)
    far = np.hypot(np.abs(ranges[..., :2]).max(axis=2), np.abs(ranges[..., 2:4]).max(axis=2))
    steepest = maximum_filter(np.pad(far, ((0, 1), (0, 1)), mode="edge"), size=3)
    # A price at which a descent earns more than it costs would leave no room for a potential.
    room = np.minimum(MOST_EARNING * best.level / np.maximum(t.robot.weight * steepest, 1e-9), 9.0)
    share = np.minimum(chosen[..., 0], 1.0 + room)
    odd = (-2.0 * ex * ey * chosen[..., 1], (ex * ex - ey * ey) * chosen[..., 1])
    sums = [np.zeros_like(share) for _ in range(3)]
    weights = np.zeros_like(share)
    reach = _reach(t, best.level, cell, share.shape, stretch)
    for scale, weight in AVERAGING:
        sigma = scale * reach[0], scale * reach[1]
        weights += weight * gaussian_filter(worth, sigma, mode="nearest")
        for total, field in zip(sums, (share, *odd), strict=True):
            total += weight * gaussian_filter(worth * field, sigma, mode="nearest")
    share, b1, b2 = (total / weights for total in sums)
    share = np.minimum(share, 1.0 + room)
    left = np.maximum(1.0 + room - share, 0.05) / np.maximum(np.hypot(b1, b2), 1e-9)
    return _prices(t, share, b1 * np.minimum(1.0, left), b2 * np.minimum(1.0, left))


def milder(
    t: PriceTable,
    prices: PriceField,
    bad: NDArray[np.bool_],
    level: float,
    cell: tuple[float, float],
) -> PriceField:
    """Prices nearer to those of no dissipation round the cells (ny - 1, nx - 1) that are bad."""
    at = np.zeros(prices.share.shape)
    for down in (0, 1):
        for left in (0, 1):
            at[down : down + bad.shape[0], left : left + bad.shape[1]] += bad
    reach = _reach(t, level, cell, at.shape, MILDER_STRETCH)
    # All round a bad cell the same first: what is averaged from one node alone is next to nothing.
    wide = maximum_filter(at > 0.0, size=[2 * math.ceil(2.0 * r) + 1 for r in reach])
    near = gaussian_filter(wide.astype(float), reach, mode="nearest")
    kept = 1.0 - MILDER * near
    share = 1.0 + (prices.share - 1.0) * kept
    return _prices(t, share, prices.b1 * kept, prices.b2 * kept)


def _prices(t: PriceTable, share: Array, b1: Array, b2: Array) -> PriceField:
    """A field within the table, with the rotors' share that belongs to it."""
    last = t.low + t.step * (t.watts.shape[0] - 1)
    edge = 0.98 * min(-t.cross, 0.45 * (last - t.low))
    shrink = np.minimum(1.0, edge / np.maximum(np.hypot(b1, b2), 1e-9))
    b1, b2 = b1 * shrink, b2 * shrink
    size = 1.01 * np.hypot(b1, b2)
    share = np.clip(share, t.low + size, last - size)
    backward = 2.0 - 1.0 / t.robot.efficiency
    rotor = np.minimum(1.0, share / backward) + np.maximum(0.0, share * t.robot.efficiency - 1.0)
    return PriceField(*(np.ascontiguousarray(f) for f in (share, rotor, b1, b2)))
