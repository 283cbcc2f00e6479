"""A floor of the cost of steady driving through each triangle of a map, by direction.

    costs = triangle_costs(floor, mesh)      # (cells y, cells x, 2, directions) J per horizontal m

A gradient g with -g·e ≤ costs for e = (cos, sin)(k·2π/TRAVEL_DIRECTIONS), each k, keeps to the
floor for every direction and every slope in the triangle. Infinity marks walls.

In a cell the slopes lie in a rectangle. Seen along a direction it turns, and a box round it lets in
slopes that are not there. So the table is turned instead, once for each direction: squares of
slopes, each with the least of the bilinear table over a box round it. The least over the squares
that a rectangle meets comes from the minima over windows of 1, 2, 4, ... squares a side, however
large it is. Where a rectangle is small, a turned box in the table itself is closer: the least over
it is at its corners or on the table's lines.

Between two directions -g·e is a sine, at most 1/cos(Δ/2) of its chord. The floor may be below its
own chord. It is looked up in the middle between two directions as well; twice of what it falls
short there is taken off at both: as much as one kink anywhere between them may lack.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.certificate.mesh import Mesh
from planner.search.certificate.steady_floor import SteadyFloor
from planner.search.second_core import in_halves

TRAVEL_DIRECTIONS = 48
"""Directions of travel in which a triangle has a cost."""
SMALL, LARGE = 2.0, 8.0
"""Steps of the table: up to the first, a rectangle's longer side is closer to a turned box than to
squares; beyond the second, the box takes long. In between, the larger of both floors counts."""


@njit(cache=True, error_model="numpy", inline="always")
def _box_least(table: Any, u0: float, u1: float, v0: float, v1: float) -> float:
    """Least of a bilinear table over a box, given in steps from its first node."""
    last = table.shape[0] - 1
    u0, u1, v0, v1 = max(u0, 0.0), min(u1, last), max(v0, 0.0), min(v1, last)
    least: float = np.inf
    if u0 > u1 or v0 > v1:
        return least
    u = u0
    while True:
        i = min(int(u), last - 1)
        w = u - i
        v = v0
        while True:
            j = min(int(v), last - 1)
            t = v - j
            low = table[i, j] + t * (table[i, j + 1] - table[i, j])
            high = table[i + 1, j] + t * (table[i + 1, j + 1] - table[i + 1, j])
            least = min(least, low + w * (high - low))
            if v >= v1:
                break
            v = min(math.floor(v) + 1.0, v1)
        if u >= u1:
            break
        u = min(math.floor(u) + 1.0, u1)
    return least


@njit(cache=True, error_model="numpy", nogil=True)
def _turned(table: Any, steepest: float, c: float, s: float, windows: Any) -> None:
    """Minima over windows of 2ⁿ squares a side, (sizes, squares x, squares y), seen along (c, s).

    A window is known by its first square. Squares that no slope up to ``steepest`` is in are
    infinite.
    """
    count = windows.shape[1]
    step = 2.0 * steepest / count
    per_slope = (table.shape[0] - 1) / (2.0 * steepest)
    reach = 0.5 * step * (abs(c) + abs(s)) * per_slope * (1.0 + 1e-9)
    for i in range(count):
        x = (i + 0.5) * step - steepest
        for j in range(count):
            y = (j + 0.5) * step - steepest
            nearest = math.hypot(max(abs(x) - 0.5 * step, 0.0), max(abs(y) - 0.5 * step, 0.0))
            windows[0, i, j] = np.inf
            if nearest <= steepest * (1.0 + 1e-9):
                u, v = (
                    (x * c + y * s + steepest) * per_slope,
                    (y * c - x * s + steepest) * per_slope,
                )
                windows[0, i, j] = _box_least(table, u - reach, u + reach, v - reach, v + reach)
    for size in range(1, windows.shape[0]):
        half = 1 << (size - 1)
        most = count - 2 * half
        for i in range(most + 1):
            for j in range(most + 1):
                windows[size, i, j] = min(
                    min(windows[size - 1, i, j], windows[size - 1, i + half, j]),
                    min(windows[size - 1, i, j + half], windows[size - 1, i + half, j + half]),
                )


@njit(cache=True, error_model="numpy", inline="always")
def _window_least(windows: Any, x0: int, x1: int, y0: int, y1: int) -> float:
    """Least over the squares from (x0, y0) to (x1, y1), both included."""
    size, shorter = 0, min(x1 - x0, y1 - y0) + 1
    while 2 << size <= shorter and size + 1 < windows.shape[0]:
        size += 1
    wide = 1 << size
    least: float = np.inf
    i = x0
    while True:
        i = min(i, x1 + 1 - wide)
        j = y0
        while True:
            j = min(j, y1 + 1 - wide)
            least = min(least, windows[size, i, j])
            if j + wide > y1:
                break
            j += wide
        if i + wide > x1:
            break
        i += wide
    return least


@njit(cache=True, error_model="numpy", nogil=True)
def _look_up(
    tables: Any, steepest: float, ranges: Any, classes: Any, wall: Any, costs: Any, a: int, b: int
) -> None:
    """The least of the cells in directions ``a`` to ``b``, and in the middle after each.

    The former into ``costs`` of the first triangle, the latter of the second.
    """
    last = tables.shape[1] - 1
    per_slope = last / (2.0 * steepest)
    windows = np.empty((int(math.log2(last)) + 1, last, last))
    for direction in range(2 * a, 2 * b):
        c, s = (
            math.cos(direction * math.pi / TRAVEL_DIRECTIONS),
            math.sin(direction * math.pi / TRAVEL_DIRECTIONS),
        )
        for ground in range(tables.shape[0]):
            table, turned = tables[ground], False
            for j in range(costs.shape[0]):
                for i in range(costs.shape[1]):
                    if ground == 0:
                        costs[j, i, direction % 2, direction // 2] = np.inf
                    if wall[j, i, 0] and wall[j, i, 1]:
                        continue
                    if not classes[j, i] >> np.uint64(ground) & np.uint64(1):
                        continue
                    x0 = (min(max(ranges[j, i, 0], -steepest), steepest) + steepest) * per_slope
                    x1 = (min(max(ranges[j, i, 1], -steepest), steepest) + steepest) * per_slope
                    y0 = (min(max(ranges[j, i, 2], -steepest), steepest) + steepest) * per_slope
                    y1 = (min(max(ranges[j, i, 3], -steepest), steepest) + steepest) * per_slope
                    longer, least = max(x1 - x0, y1 - y0), -np.inf
                    if longer <= LARGE:
                        x, y = 0.5 * (x0 + x1 - last), 0.5 * (y0 + y1 - last)
                        u, v = x * c + y * s + 0.5 * last, y * c - x * s + 0.5 * last
                        du = 0.5 * ((x1 - x0) * abs(c) + (y1 - y0) * abs(s))
                        dv = 0.5 * ((x1 - x0) * abs(s) + (y1 - y0) * abs(c))
                        least = _box_least(table, u - du, u + du, v - dv, v + dv)
                    if longer > SMALL:
                        if not turned:
                            _turned(table, steepest, c, s, windows)
                            turned = True
                        met = _window_least(
                            windows,
                            min(int(x0), last - 1),
                            min(int(x1), last - 1),
                            min(int(y0), last - 1),
                            min(int(y1), last - 1),
                        )
                        least = max(least, met)
                    cost = costs[j, i, direction % 2, direction // 2]
                    costs[j, i, direction % 2, direction // 2] = min(cost, least)


@njit(cache=True, error_model="numpy", nogil=True)
def _below_chords(wall: Any, costs: Any, a: int, b: int) -> None:
    """From what ``_look_up`` finds, the costs of the rows of cells from ``a`` to ``b``."""
    count = costs.shape[3]
    widening = 1.0 / math.cos(math.pi / count)
    at, middle = np.empty(count), np.empty(count)
    for j in range(a, b):
        for i in range(costs.shape[1]):
            for k in range(count):
                at[k], middle[k] = costs[j, i, 0, k], costs[j, i, 1, k]
            for half in range(2):
                if wall[j, i, half]:
                    costs[j, i, half] = np.inf
                    continue
                for k in range(count):
                    short = 0.0
                    for other, between in (
                        (at[k - 1], middle[k - 1]),
                        (at[(k + 1) % count], middle[k]),
                    ):
                        bent = max(0.5 * (at[k] + other) - between, 0.0)
                        short = max(short, 2.0 * bent + (widening - 1.0) * max(at[k], other))
                    costs[j, i, half, k] = at[k] - short


def triangle_costs(floor: SteadyFloor, mesh: Mesh) -> Array:
    """Costs of all triangles, on both cores; see the module's head."""
    costs = np.empty((*mesh.wall.shape, TRAVEL_DIRECTIONS))
    there = floor.least, floor.steepest, mesh.ranges, mesh.classes, mesh.wall, costs
    in_halves(TRAVEL_DIRECTIONS, partial(_look_up, *there))
    in_halves(len(costs), partial(_below_chords, mesh.wall, costs))
    return costs
