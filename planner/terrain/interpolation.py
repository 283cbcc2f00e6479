"""Height and gradient between the nodes of a grid: cubic convolution, compiled.

In each axis, with a = -1/2 and t the place within the cell,

    z(x, y) = sum_m sum_n w_m(v) w_n(u) Z[j + m, i + n],   m, n = -1 .. 2,
    w_-1 = (-t^3 + 2 t^2 - t)/2     w_0 = (3 t^3 - 5 t^2 + 2)/2
    w_1  = (-3 t^3 + 4 t^2 + t)/2   w_2 = (t^3 - t^2)/2,

and the gradient is the analytic derivative of exactly this. So the height gained along any path is
the line integral of the slope, and energy spent against gravity cannot depend on the path. The
surface runs through the nodes, has a continuous gradient and reproduces planes and quadratics
exactly (within a cell of the border: planes). Beyond the border nodes the grid goes on straight.

Source: R. G. Keys, Cubic convolution interpolation for digital image processing, IEEE Trans.
Acoustics, Speech, and Signal Processing 29(6), 1981, doi:10.1109/TASSP.1981.1163711.
Left out: the sharp edge of a step, which the cubic rounds over two cells and overshoots by up to
7 % of its height beside it; steps are the business of obstacles.py.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.compiled_code import njit


def cubic_weights(t: Any) -> tuple[Any, Any, Any, Any, Any, Any, Any, Any]:
    """Four weights of the cubic convolution at t in [0, 1), then their derivatives.

    Numbers or arrays; compiled loops call it for numbers.
    """
    t2 = t * t
    t3 = t2 * t
    return (
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
        0.5 * (-3.0 * t2 + 4.0 * t - 1.0),
        0.5 * (9.0 * t2 - 10.0 * t),
        0.5 * (-9.0 * t2 + 8.0 * t + 1.0),
        0.5 * (3.0 * t2 - 2.0 * t),
    )


_weights = njit("UniTuple(float64, 8)(float64)", cache=True, inline="always")(cubic_weights)


@njit("UniTuple(int64, 3)(int64, int64)", cache=True, inline="always")
def _border(k: int, last: int) -> tuple[int, int, int]:
    """The index nearest to k on the grid, its neighbour inwards, and how far k lies beyond."""
    nearest = min(max(k, 0), last)
    return nearest, 1 if k < 0 else last - 1, abs(k - nearest)


@njit("float64(float64[:, ::1], int64, int64)", cache=True)
def _along_row(heights: NDArray[np.float64], j: int, i: int) -> float:
    """Height at column i of row j, continued along a straight line beyond the border."""
    near, inner, beyond = _border(i, heights.shape[1] - 1)
    return float(heights[j, near] + beyond * (heights[j, near] - heights[j, inner]))


@njit("float64(float64[:, ::1], int64, int64)", cache=True)
def _continued(heights: NDArray[np.float64], j: int, i: int) -> float:
    """Height at any row and column, continued along straight lines beyond the border."""
    near, inner, beyond = _border(j, heights.shape[0] - 1)
    outwards = beyond * _along_row(heights, inner, i)
    return (1 + beyond) * _along_row(heights, near, i) - outwards


@njit(
    "UniTuple(float64, 3)(float64[:, ::1], float64, float64, float64, float64, float64, float64)",
    cache=True,
)
def interpolate(
    heights: NDArray[np.float64], x0: float, y0: float, dx: float, dy: float, x: float, y: float
) -> tuple[float, float, float]:
    """Height and gradient at one point, for use inside compiled loops.

    Args:
        heights: (ny, nx) m, row 0 the south row, at least 4 by 4, C order.
        x0, y0: position of node [0, 0], m.
        dx, dy: cell size, m.
        x, y: the point, m; anywhere, beyond the border the ground goes on straight.

    Returns:
        z (m), dz/dx, dz/dy (dimensionless); NaN for a point that is not finite or further than
        a thousand million cells away.
    """
    u, v = (x - x0) / dx, (y - y0) / dy
    # Written so that NaN fails it too: no index may be taken from such a number.
    if not (abs(u) < 1e9 and abs(v) < 1e9):
        return math.nan, math.nan, math.nan
    i, j = int(math.floor(u)), int(math.floor(v))
    a0, a1, a2, a3, da0, da1, da2, da3 = _weights(u - i)
    across = _weights(v - j)
    b, db = across[:4], across[4:]
    z, gx, gy = 0.0, 0.0, 0.0
    inside = 1 <= i < heights.shape[1] - 2 and 1 <= j < heights.shape[0] - 2
    for m in range(4):
        if inside:
            h0 = heights[j + m - 1, i - 1]
            h1 = heights[j + m - 1, i]
            h2 = heights[j + m - 1, i + 1]
            h3 = heights[j + m - 1, i + 2]
        else:
            h0 = _continued(heights, j + m - 1, i - 1)
            h1 = _continued(heights, j + m - 1, i)
            h2 = _continued(heights, j + m - 1, i + 1)
            h3 = _continued(heights, j + m - 1, i + 2)
        row = a0 * h0 + a1 * h1 + a2 * h2 + a3 * h3
        z += b[m] * row
        gx += b[m] * (da0 * h0 + da1 * h1 + da2 * h2 + da3 * h3)
        gy += db[m] * row
    return z, gx / dx, gy / dy


@njit(
    "float64[:, ::1](float64[:, ::1], float64, float64, float64, float64, "
    "float64[::1], float64[::1])",
    cache=True,
    nogil=True,
)
def interpolate_many(
    heights: NDArray[np.float64],
    x0: float,
    y0: float,
    dx: float,
    dy: float,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
) -> NDArray[np.float64]:
    """`interpolate` at n points: (3, n) with the rows z, dz/dx, dz/dy."""
    out = np.empty((3, x.size))
    for k in range(x.size):
        out[0, k], out[1, k], out[2, k] = interpolate(heights, x0, y0, dx, dy, x[k], y[k])
    return out
