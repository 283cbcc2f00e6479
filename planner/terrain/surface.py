"""Ground classes, and heights averaged over a footprint.

A ground class multiplies the vehicle's coefficients of rolling drag and traction. Both factors are
1 on the floor for which the vehicle's values were measured.

Footprint.  A robot on contacts a distance l ahead of and behind its centre feels the slope

    (z(s + l) - z(s - l)) / 2l  =  d/ds of the mean of z over [s - l, s + l],

so a crease in the ground is felt as a ramp of slope of length 2l, not as a step. One smoothed
surface does this for every driving direction alike: the isotropic average with the kernel

    f(r) = 1 / (2 pi l sqrt(l^2 - r^2)),  r < l,

which is a sphere's area projected on its equator. By Archimedes' hat-box theorem its projection on
any axis is a box of half length l. Because the result is a surface, the slope felt is the gradient
of one potential, and height gained does not depend on the path taken.

Source: the identity above is elementary; the hat-box theorem is Archimedes, On the Sphere and
Cylinder I. Holds for: bodies whose length and width are of one size, slopes that are small over a
footprint. Left out: the difference between half length and half width; suspension travel; the part
of the roughness below the footprint, which belongs to the ground class's rolling factor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.compiled_code import njit

# Above this many kernel cells a transform is quicker than the direct sum.
_DIRECT_SUM_LIMIT = 700


@dataclass(frozen=True)
class GroundClass:
    """A kind of ground: its name and its factors on the vehicle's coefficients (1 = as measured).

    Attributes:
        name: what a user calls it, "carpet".
        rolling: factor on rolling drag, dimensionless, 0 or more.
        traction: factor on the friction coefficient of the contacts, dimensionless, above 0.
    """

    name: str
    rolling: float = 1.0
    traction: float = 1.0


PLAIN_GROUND = (GroundClass("ground"),)


def footprint_kernel(*, half_length: float, cell: tuple[float, float]) -> NDArray[np.float64]:
    """Share of the footprint's weight that falls on each cell round the centre one.

    Args:
        half_length: l, half the distance between front and rear contacts, m.
        cell: dx, dy of the grid, m.

    Returns:
        (2 ry + 1, 2 rx + 1) weights that add up to 1, symmetric in both axes; a single 1 when the
        footprint lies within one cell.
    """
    dx, dy = cell
    reach_x = max(0, int(np.ceil(half_length / dx - 0.5)))
    reach_y = max(0, int(np.ceil(half_length / dy - 0.5)))
    if reach_x == 0 and reach_y == 0:
        return np.ones((1, 1))
    # With x = l sin(a) the integral over y is an arcsine and the integrand over a is bounded: the
    # square root's pole at the rim is gone. One quarter is integrated, the rest is symmetry.
    edges_x = (np.arange(reach_x + 1) + 0.5) * dx
    edges_y = (np.arange(reach_y + 1) + 0.5) * dy
    # Between these angles a chord lies in one column and crosses one set of rows: no kinks.
    at_columns = np.arcsin(np.minimum(edges_x / half_length, 1.0))
    at_rows = np.arccos(np.minimum(edges_y / half_length, 1.0))
    breaks = np.unique(np.concatenate([[0.0, 0.5 * np.pi], at_columns, at_rows]))
    nodes, shares = np.polynomial.legendre.leggauss(24)
    middle, half = 0.5 * (breaks[1:] + breaks[:-1]), 0.5 * np.diff(breaks)
    angle = middle[:, None] + half[:, None] * nodes
    # Share of each chord's weight with |y| below a row's upper edge; the cosine is dx / da.
    chord = half_length * np.cos(angle)
    inside = np.arcsin(np.minimum(edges_y[:, None, None] / chord, 1.0)) * np.cos(angle)
    per_piece = np.diff(inside @ shares * half, axis=0, prepend=0.0)
    column = np.searchsorted(edges_x, half_length * np.sin(middle))
    quarter = np.zeros((reach_y + 1, reach_x + 1))
    for piece, i in enumerate(column):
        quarter[:, i] += per_piece[:, piece]
    # A row or column off the axis stands for two; the centre ones are shared by both halves.
    quarter[1:, :] *= 0.5
    quarter[:, 1:] *= 0.5
    top = np.concatenate([quarter[:, :0:-1], quarter], axis=1)
    kernel: NDArray[np.float64] = np.concatenate([top[:0:-1], top], axis=0)
    kernel /= kernel.sum()
    return kernel


def footprint_heights(
    heights: NDArray[np.float64], *, half_length: float, cell: tuple[float, float]
) -> NDArray[np.float64]:
    """Heights as a footprint of the given half length feels them.

    Args:
        heights: (ny, nx) m, finite everywhere.
        half_length: l of the module's head, m; below half a cell nothing changes.
        cell: dx, dy, m.

    Returns:
        (ny, nx) m, a new array. Planes come back unchanged up to the border, beyond which the
        ground is continued by point reflection.
    """
    kernel = footprint_kernel(half_length=half_length, cell=cell)
    if kernel.size == 1:
        return np.array(heights, dtype=np.float64, order="C")
    pad_y, pad_x = kernel.shape[0] // 2, kernel.shape[1] // 2
    # Taking the mean off first keeps rounding at the size of the relief, not of the altitude.
    level = float(heights.mean())
    padded = np.pad(
        heights - level, ((pad_y, pad_y), (pad_x, pad_x)), mode="reflect", reflect_type="odd"
    )
    if kernel.size <= _DIRECT_SUM_LIMIT:
        smooth: NDArray[np.float64] = _weighted_sum(np.ascontiguousarray(padded), kernel)
    else:
        from scipy.signal import oaconvolve

        smooth = np.ascontiguousarray(oaconvolve(padded, kernel, mode="valid"))
    smooth += level
    return smooth


@njit("float64[:, ::1](float64[:, ::1], float64[:, ::1])", cache=True, fastmath=False)
def _weighted_sum(padded: NDArray[np.float64], kernel: NDArray[np.float64]) -> NDArray[np.float64]:
    rows = padded.shape[0] - kernel.shape[0] + 1
    columns = padded.shape[1] - kernel.shape[1] + 1
    out = np.zeros((rows, columns))
    for j in range(rows):
        for m in range(kernel.shape[0]):
            for n in range(kernel.shape[1]):
                weight = kernel[m, n]
                if weight != 0.0:
                    for i in range(columns):
                        out[j, i] += weight * padded[j + m, i + n]
    return out
