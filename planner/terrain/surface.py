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
of one potential, and height gained does not depend on the path taken. What is averaged is the
surface between the nodes, not the nodes alone: cells may be larger than the footprint.

Source: the identity above is elementary; the hat-box theorem is Archimedes, On the Sphere and
Cylinder I. Holds for: bodies whose length and width are of one size, slopes that are small over a
footprint. Left out: the difference between half length and half width; suspension travel; the part
of the roughness below the footprint, which belongs to the ground class's rolling factor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.compiled_code import njit
from planner.terrain.interpolation import cubic_weights

# Above this many kernel cells a transform is quicker than the direct sum.
_DIRECT_SUM_LIMIT = 700
RINGS, MOST_RINGS = 6, 240
"""Rings of points for each cell of a footprint's radius, and of all; 4 times as many points are on
a ring. Weights are good to 1e-5 with the first; the second is a point for each of 300 cells."""


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
    """Weights of the nodes round one in the mean height under a footprint.

    The mean is that of the surface between the nodes (interpolation.py), by quadrature: z is even
    over a sphere's height (hat-box theorem), so Gauss's nodes in it and even angles serve.

    Args:
        half_length: l, half the distance between front and rear contacts, m.
        cell: dx, dy of the grid, m.

    Returns:
        (2 ry + 1, 2 rx + 1) weights that add up to 1, symmetric in both axes. Their second moments
        are those of the footprint, l^2 / 3, because the cubic reproduces quadratics.
    """
    rings = min(RINGS * math.ceil(half_length / min(cell) + 2.0), MOST_RINGS)
    height, share = np.polynomial.legendre.leggauss(rings)
    angle = np.pi * (2 * np.arange(4 * rings) + 1) / (4 * rings)
    radius = half_length * np.sqrt(1.0 - height**2)
    (at_x, in_x), (at_y, in_y) = (
        _nodes_round((radius[:, None] * direction).ravel() / size)
        for direction, size in ((np.cos(angle), cell[0]), (np.sin(angle), cell[1]))
    )
    reach_x, reach_y = (math.floor(half_length / size) + 2 for size in cell)
    kernel = np.zeros((2 * reach_y + 1, 2 * reach_x + 1))
    weight = np.repeat(0.5 * share / len(angle), len(angle))
    for m in range(4):
        for n in range(4):
            np.add.at(kernel, (at_y[m] + reach_y, at_x[n] + reach_x), weight * in_y[m] * in_x[n])
    # Rounding leaves the halves a little apart.
    kernel += kernel[::-1, ::-1]
    kernel /= kernel.sum()
    return kernel


def _nodes_round(offset: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The four nodes round points on a line (n,), in cells, and their weights; (4, n) each."""
    first = np.floor(offset)
    weights = np.array(cubic_weights(offset - first)[:4])
    return first.astype(np.int64) + np.arange(-1, 3)[:, None], weights


def footprint_heights(
    heights: NDArray[np.float64], *, half_length: float, cell: tuple[float, float]
) -> NDArray[np.float64]:
    """Heights as a footprint of the given half length feels them.

    Args:
        heights: (ny, nx) m, finite everywhere.
        half_length: l of the module's head, m.
        cell: dx, dy, m.

    Returns:
        (ny, nx) m, a new array. Planes come back unchanged up to the border, beyond which the
        ground is continued by point reflection.
    """
    kernel = footprint_kernel(half_length=half_length, cell=cell)
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
