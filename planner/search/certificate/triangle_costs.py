"""A floor of the cost of steady driving through each triangle of a map, by direction.

    costs = triangle_costs(floor, mesh)      # (cells y, cells x, 2, DIRECTIONS) J per horizontal m

A gradient g with -g·e ≤ costs for the directions e = (cos, sin)(k·2π/DIRECTIONS) keeps to the floor
for every direction and every slope in the triangle. Infinity marks walls.

In a cell the slopes lie in a rectangle. Seen along a direction it turns; the least of the bilinear
table over a box round it is at the box's corners or on the table's lines, so it is found exactly. A
wide rectangle is cut in parts, whose boxes stand out less.

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

DIRECTIONS = 48
"""Directions of travel in which a triangle has a cost."""
PART, MOST_PARTS = 8.0, 3
"""Steps of the table from which a rectangle of slopes is cut, and parts of a side at most."""

SECONDS_PER_STEP = 5e-9
"""s for a step of the table in one direction, as measured on steep relief with two cores."""


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
def _fill(
    tables: Any, steepest: float, ranges: Any, classes: Any, wall: Any, costs: Any, a: int, b: int
) -> None:
    """Costs of the rows of cells from ``a`` to ``b``."""
    count = costs.shape[3]
    step, per_slope = math.pi / count, 0.5 * (tables.shape[1] - 1) / steepest
    looked = np.empty(2 * count)
    widening = 1.0 / math.cos(step)
    for j in range(a, b):
        for i in range(costs.shape[1]):
            if wall[j, i, 0] and wall[j, i, 1]:
                costs[j, i] = np.inf
                continue
            x0, x1, y0, y1 = ranges[j, i, 0], ranges[j, i, 1], ranges[j, i, 2], ranges[j, i, 3]
            x0, x1 = min(max(x0, -steepest), steepest), min(max(x1, -steepest), steepest)
            y0, y1 = min(max(y0, -steepest), steepest), min(max(y1, -steepest), steepest)
            nx = int(min(max((x1 - x0) * per_slope / PART + 1.0, 1.0), MOST_PARTS))
            ny = int(min(max((y1 - y0) * per_slope / PART + 1.0, 1.0), MOST_PARTS))
            half_x, half_y = 0.5 * (x1 - x0) / nx, 0.5 * (y1 - y0) / ny
            looked[:] = np.inf
            for part in range(nx * ny):
                x, y = x0 + (2 * (part % nx) + 1) * half_x, y0 + (2 * (part // nx) + 1) * half_y
                if math.hypot(max(abs(x) - half_x, 0.0), max(abs(y) - half_y, 0.0)) > steepest:
                    continue
                for k in range(2 * count):
                    c, s = math.cos(k * step), math.sin(k * step)
                    u, v = (
                        (x * c + y * s + steepest) * per_slope,
                        (y * c - x * s + steepest) * per_slope,
                    )
                    du = (half_x * abs(c) + half_y * abs(s)) * per_slope
                    dv = (half_x * abs(s) + half_y * abs(c)) * per_slope
                    for ground in range(tables.shape[0]):
                        if classes[j, i] >> np.uint64(ground) & np.uint64(1):
                            least = _box_least(tables[ground], u - du, u + du, v - dv, v + dv)
                            looked[k] = min(looked[k], least)
            for half in range(2):
                for k in range(count):
                    cost = looked[2 * k]
                    short = 0.0
                    for side in (-1, 1):
                        other = looked[(2 * k + 2 * side) % (2 * count)]
                        middle = looked[(2 * k + side) % (2 * count)]
                        bent = max(0.5 * (cost + other) - middle, 0.0)
                        short = max(short, 2.0 * bent + (widening - 1.0) * max(cost, other))
                    costs[j, i, half, k] = np.inf if wall[j, i, half] else cost - short


def seconds_of_costs(floor: SteadyFloor, mesh: Mesh) -> float:
    """About how long ``triangle_costs`` takes, s: steep ground has wide rectangles of slopes."""
    per_slope = 0.5 * (floor.least.shape[1] - 1) / floor.steepest
    sides = np.diff(np.clip(mesh.ranges, -floor.steepest, floor.steepest).reshape(-1, 2, 2))
    steps = np.prod(sides[..., 0] * per_slope + 1.0, axis=-1)[~mesh.wall.all(axis=-1).ravel()]
    return float(steps.sum()) * DIRECTIONS * len(floor.least) * SECONDS_PER_STEP


def triangle_costs(floor: SteadyFloor, mesh: Mesh) -> Array:
    """Costs of all triangles, on both cores; see the module's head."""
    costs = np.empty((*mesh.wall.shape, DIRECTIONS))
    there = floor.least, floor.steepest, mesh.ranges, mesh.classes, mesh.wall, costs
    in_halves(len(costs), partial(_fill, *there))
    return costs
