"""The steepest potential that no direction of travel outruns: maximise ψ(start) - ψ(goal).

ψ is linear on every triangle of the grid, with -∇ψ·e ≤ cost for each direction e. This is the dual
of the least-cost path, continuous in space, and a linear programme with a great many rows. It is
solved by the alternating direction method of multipliers: a Poisson equation for ψ, solved exactly
by cosine transforms, in turn with the projection of each gradient onto its polygon of admissible
ones. ``levelled`` makes what comes out admissible to the last bit, by slowing ψ down at each of its
levels as much as the worst triangle there asks for.

Source: Benamou and Carlier, Augmented Lagrangian methods for transport optimization, mean field
games and degenerate elliptic equations, J. Optimization Theory and Applications 167, 2015.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.fft import dctn

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.second_core import CORE

LEVELS = 4096
"""Levels of ψ that are slowed down one by one."""
FLOW_WIDTH = 4.0
"""Cells over which the flow from start to goal is thought to spread; any number converges."""
MOST_ITERATIONS, LOOK_EVERY = 2000, 20
"""Iterations at most, and those from one look at the potential to the next."""
OVER_RELAXATION = 1.7
"""Of the gradients: between 1, none, and 2, where the method need not converge."""


@njit(cache=True, error_model="numpy", nogil=True)
def admissible(costs: Any) -> tuple[Any, Any]:
    """Corners (cells y, cells x, 2, most, 2) of the polygons {g : -g·e_k ≤ cost_k}, and their
    number: -1 where the cost is infinite, 0 where a cost is not positive."""
    ny, nx, _, count = costs.shape
    corners = np.zeros((ny, nx, 2, count, 2), np.float32)
    number = np.zeros((ny, nx, 2), np.int64)
    step = 2.0 * math.pi / count
    hull = np.empty(count, np.int64)
    for j in range(ny):
        for i in range(nx):
            for half in range(2):
                cost = costs[j, i, half]
                if cost[0] == np.inf:
                    number[j, i, half] = -1
                    continue
                if cost.min() <= 0.0:
                    continue
                # In polar duality: the points e_k/cost_k, their convex hull, and its edges' poles.
                size = 0
                first = 0
                for k in range(count):
                    if cost[k] < cost[first]:
                        first = k
                for turn in range(count + 1):
                    k = (first + turn) % count
                    while size >= 2:
                        a, b = hull[size - 2], hull[size - 1]
                        ax, ay = math.cos(a * step) / cost[a], math.sin(a * step) / cost[a]
                        bx, by = math.cos(b * step) / cost[b], math.sin(b * step) / cost[b]
                        cx, cy = math.cos(k * step) / cost[k], math.sin(k * step) / cost[k]
                        if (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > 0.0:
                            break
                        size -= 1
                    if turn < count:
                        hull[size] = k
                        size += 1
                for n in range(size):
                    a, b = hull[n], hull[(n + 1) % size]
                    ax, ay = math.cos(a * step), math.sin(a * step)
                    bx, by = math.cos(b * step), math.sin(b * step)
                    det = ax * by - ay * bx
                    corners[j, i, half, n, 0] = -(cost[a] * by - cost[b] * ay) / det
                    corners[j, i, half, n, 1] = -(cost[b] * ax - cost[a] * bx) / det
                number[j, i, half] = size
    return corners, number


@njit(cache=True, error_model="numpy", inline="always")
def _nearest(polygon: Any, size: int, x: float, y: float) -> tuple[float, float]:
    """The point of a convex polygon, counter-clockwise, that is nearest to (x, y)."""
    best, px, py = np.inf, x, y
    inside = True
    for n in range(size):
        ax, ay = polygon[n, 0], polygon[n, 1]
        m = n + 1 if n + 1 < size else 0
        ex, ey = polygon[m, 0] - ax, polygon[m, 1] - ay
        if ex * (y - ay) - ey * (x - ax) >= 0.0:
            continue
        inside = False
        long = ex * ex + ey * ey
        w = ((x - ax) * ex + (y - ay) * ey) / long if long > 0.0 else 0.0
        w = min(max(w, 0.0), 1.0)
        qx, qy = ax + w * ex, ay + w * ey
        apart = (qx - x) ** 2 + (qy - y) ** 2
        if apart < best:
            best, px, py = apart, qx, qy
    if inside:
        return x, y
    return px, py


@njit(cache=True, error_model="numpy", nogil=True)
def _project(
    psi: Any, corners: Any, number: Any, dual: Any, pushed: Any, dx: float, dy: float, over: float
) -> float:
    """One step: project the gradients, update the multipliers, and collect the new right side.

    Returns the largest distance of a gradient from its projection.
    """
    ny, nx = psi.shape
    pushed[:] = 0.0
    apart = 0.0
    for j in range(ny - 1):
        for i in range(nx - 1):
            for half in range(2):
                side = 1 - 2 * half
                j0, i0 = j + half, i + half
                gx = (psi[j0, i0 + side] - psi[j0, i0]) * side / dx
                gy = (psi[j0 + side, i0] - psi[j0, i0]) * side / dy
                u = dual[j, i, half]
                size = number[j, i, half]
                if size < 0:
                    px, py = gx, gy
                    u[0], u[1] = 0.0, 0.0
                else:
                    # Over-relaxation: between the gradient and its last projection.
                    rx = over * gx + (1.0 - over) * u[2]
                    ry = over * gy + (1.0 - over) * u[3]
                    px, py = _nearest(corners[j, i, half], size, rx + u[0], ry + u[1])
                    u[0] += rx - px
                    u[1] += ry - py
                    apart = max(apart, abs(gx - px) + abs(gy - py))
                u[2], u[3] = px, py
                fx, fy = 0.5 * dy * side * (px - u[0]), 0.5 * dx * side * (py - u[1])
                pushed[j0, i0 + side] += fx
                pushed[j0, i0] -= fx
                pushed[j0 + side, i0] += fy
                pushed[j0, i0] -= fy
    return apart


class Poisson:
    """Solves the grid's Laplace equation with free borders, by cosine transforms."""

    def __init__(self, shape: tuple[int, int], dx: float, dy: float) -> None:
        ny, nx = shape
        self.mass = np.ones(shape)
        self.mass[[0, -1], :] *= 0.5
        self.mass[:, [0, -1]] *= 0.5
        x = (2.0 - 2.0 * np.cos(np.pi * np.arange(nx) / (nx - 1))) * dy / dx
        y = (2.0 - 2.0 * np.cos(np.pi * np.arange(ny) / (ny - 1))) * dx / dy
        self.values = y[:, None] + x[None, :]
        self.values[0, 0] = 1.0
        self.scale = 1.0 / (4.0 * (nx - 1) * (ny - 1))

    def solve(self, right: Array) -> Array:
        """ψ of mean zero with -∇·∇ψ = right, where right adds up to zero."""
        spectrum = dctn(right / self.mass, type=1)
        spectrum /= self.values
        spectrum[0, 0] = 0.0
        return np.asarray(dctn(spectrum, type=1)) * self.scale


def halves(rows: int) -> list[tuple[slice, slice]]:
    """Nodes and cells of two parts of a grid with so many rows of cells, for two cores."""
    cuts = (0, rows // 2, rows)
    return [
        (slice(a, b + 1), slice(a, b)) for a, b in zip(cuts[:-1], cuts[1:], strict=True) if b > a
    ]


def weights_at(
    point: tuple[float, float],
    origin: tuple[float, float],
    cell: tuple[float, float],
    shape: tuple[int, ...],
) -> tuple[list[tuple[int, int]], list[float]]:
    """The three nodes (j, i) round a point, and their weights."""
    u = (point[0] - origin[0]) / cell[0]
    v = (point[1] - origin[1]) / cell[1]
    i = min(max(math.floor(u), 0), shape[1] - 2)
    j = min(max(math.floor(v), 0), shape[0] - 2)
    a, b = u - i, v - j
    if a + b <= 1.0:
        return [(j, i), (j, i + 1), (j + 1, i)], [1.0 - a - b, a, b]
    return [(j + 1, i + 1), (j + 1, i), (j, i + 1)], [a + b - 1.0, 1.0 - a, 1.0 - b]


@njit(cache=True, error_model="numpy", nogil=True)
def _worst_by_level(
    psi: Any, costs: Any, dx: float, dy: float, low: float, width: float, worst: Any
) -> None:
    ny, nx, _, count = costs.shape
    step = 2.0 * math.pi / count
    last = worst.shape[0] - 1
    for j in range(ny):
        for i in range(nx):
            for half in range(2):
                cost = costs[j, i, half]
                if cost[0] == np.inf:
                    continue
                side = 1 - 2 * half
                j0, i0 = j + half, i + half
                a, b, c = psi[j0, i0], psi[j0, i0 + side], psi[j0 + side, i0]
                gx, gy = (b - a) * side / dx, (c - a) * side / dy
                ratio = 0.0
                for k in range(count):
                    slope = -gx * math.cos(k * step) - gy * math.sin(k * step)
                    if slope > 0.0:
                        ratio = max(ratio, slope / cost[k] if cost[k] > 0.0 else np.inf)
                first = int(math.floor((min(a, b, c) - low) / width - 1e-6))
                final = int(math.floor((max(a, b, c) - low) / width + 1e-6))
                for n in range(max(first, 0), min(final, last) + 1):
                    worst[n] = max(worst[n], ratio)


def levelled(
    psi: Array, costs: Array, cell: tuple[float, float], top: float, bottom: float
) -> float:
    """J left of ψ(start) - ψ(goal) = top - bottom, once ψ is made admissible.

    ψ is cut off above ``top`` and below ``bottom``. Between, it is replaced by F(ψ), with F' = 1
    over the worst ratio of slope to cost in any triangle that takes that level.
    """
    if not top > bottom:
        return 0.0
    parts = halves(len(costs))
    each = np.zeros((len(parts), LEVELS))
    width = (top - bottom) / LEVELS
    CORE.all(
        [
            partial(_worst_by_level, psi[nodes], costs[cells], *cell, bottom, width, found)
            for (nodes, cells), found in zip(parts, each, strict=True)
        ]
    )
    worst = each.max(axis=0)
    # Rounding of slopes and sums is far below one part in a million million.
    return float((width / np.maximum(worst * (1.0 + 1e-12), 1.0)).sum()) * (1.0 - 1e-12)


def steepest_potential(
    costs: Array,
    psi: Array,
    cell: tuple[float, float],
    start: tuple[list[tuple[int, int]], list[float]],
    goal: tuple[list[tuple[int, int]], list[float]],
    *,
    more: Callable[[Array], bool],
) -> Array:
    """Improve ψ (ny, nx) towards the largest difference; ``more`` sees every LOOK_EVERY-th one.

    Args:
        costs: (ny - 1, nx - 1, 2, directions) J/m.
        psi: potential to begin with; a copy is worked on.
        cell: dx, dy, m.
        start, goal: nodes and weights of both places.
        more: takes ψ and says whether to go on.

    Returns:
        The last ψ.
    """
    ny, nx = psi.shape
    corners, number = admissible(costs)
    poisson = Poisson((ny, nx), *cell)
    source = np.zeros((ny, nx))
    for (nodes, weights), sign in ((start, 1.0), (goal, -1.0)):
        for place, weight in zip(nodes, weights, strict=True):
            source[place] += sign * weight
    dual = np.zeros((ny - 1, nx - 1, 2, 4))
    pushed = np.zeros((ny, nx))
    psi = psi.copy()
    finite = costs[..., 0][np.isfinite(costs[..., 0])]
    rate = 1.0 / (FLOW_WIDTH * min(cell) * float(np.median(finite)))
    parts = halves(ny - 1)
    pushes = [np.zeros((cells.stop - cells.start + 1, nx)) for _, cells in parts]

    def project(over: float) -> None:
        CORE.all(
            [
                partial(_project, psi[n], corners[c], number[c], dual[c], push, *cell, over)
                for (n, c), push in zip(parts, pushes, strict=True)
            ]
        )
        pushed[:] = 0.0
        for (nodes, _), push in zip(parts, pushes, strict=True):
            pushed[nodes] += push

    project(1.0)
    for k in range(MOST_ITERATIONS):
        psi = poisson.solve(source / rate + pushed)
        project(OVER_RELAXATION)
        if (k + 1) % LOOK_EVERY == 0 and not more(psi):
            break
    return psi
