"""An anisotropic first-arrival solver: ttcrpy, with an ellipse of costs in every cell.

    tensors = prepare(case)
    found = shortest(case, tensors)           # seconds and path, or None without ttcrpy

ttcrpy (seismic ray tracing) takes a tilted ellipse of slownesses a cell, and finds rays through
nodes on the cells' sides. An ellipse is the same both ways, so uphill and downhill share the mean
of their dissipated costs. It is measured where it can be imported: its wheel needs OpenCL's loader
(Debian's ocl-icd-libopencl1), so it is not among the locked packages. Others from PyPI: agd has no
solver for the CPU in its wheel, hfmpy was not to be had, scikit-fmm, eikonalfm and fteikpy know no
direction, fim-python is built from source and took two minutes for 512² nodes.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from tests.benchmarks.peers.case import HEADINGS, Array, Case, node_costs

NO_WAY = 1e3
"""Cost of a cell without a way, over the dearest of the others."""
SIDE_NODES = 5
"""Nodes on each side of a cell, beside its corners: finer took longer and found the same."""


class Ellipses(NamedTuple):
    """Cost by direction in every cell: c² = along²·cos² + across²·sin² round the axis."""

    along: Array
    """(ny, nx) J/m along the axis."""
    ratio: Array
    """(ny, nx) J/m across the axis over that along it."""
    axis: Array
    """(ny, nx) rad."""


def prepare(case: Case) -> Ellipses:
    """The ellipse nearest to each node's squared costs, opposite directions taken together."""
    costs = node_costs(case.field)
    both = 0.5 * (costs + np.roll(costs, HEADINGS // 2, axis=2))
    way = np.isfinite(both).all(axis=2)
    angles = 2.0 * np.pi * np.arange(HEADINGS) / HEADINGS
    terms = np.column_stack([np.cos(angles) ** 2, np.sin(2.0 * angles), np.sin(angles) ** 2])
    both[~way] = 1.0
    xx, xy, yy = np.moveaxis(both**2 @ np.linalg.pinv(terms).T, 2, 0)
    axis = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    middle, half = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    along, across = np.sqrt(middle + half), np.sqrt(np.maximum(middle - half, 0.01 * middle))
    along[~way] = NO_WAY * along[way].max()
    return Ellipses(along, np.where(way, across / along, 1.0), np.where(way, axis, 0.0))


def shortest(case: Case, ellipses: Ellipses) -> tuple[float, Array] | None:
    """CPU seconds, and the ray (k, 2) of least cost; None where ttcrpy cannot be imported."""
    try:
        from ttcrpy.rgrid import Grid2d_d
    except ImportError:
        return None
    field = case.field
    ny, nx = field.heights.shape
    begun = time.process_time()
    grid = Grid2d_d(
        field.x0 + field.dx * (np.arange(nx + 1) - 0.5),
        field.y0 + field.dy * (np.arange(ny + 1) - 0.5),
        cell_slowness=True,
        method="SPM",
        aniso="tilted_elliptical",
        nsnx=SIDE_NODES,
        nsnz=SIDE_NODES,
    )
    grid.set_slowness(ellipses.along.T.ravel())
    grid.set_xi(ellipses.ratio.T.ravel())
    grid.set_tilt_angle(ellipses.axis.T.ravel())
    _, rays = grid.raytrace(np.array([case.start]), np.array([case.goal]), return_rays=True)
    return time.process_time() - begun, np.asarray(rays[0], float)
