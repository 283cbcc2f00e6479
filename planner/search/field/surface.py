"""The ground under points of a map: height, slope and class, as the robot feels them.

heights, gradients = sample_surface(field, points)
classes = ground_classes(field, points)
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.field.cost_field import CostField
from planner.terrain.interpolation import interpolate


def ground_classes(field: CostField, points: Array) -> NDArray[np.int64]:
    """Ground class (n,) of the cells under points (n, 2)."""
    ny, nx = field.ground.shape
    i = np.clip(np.floor((points[:, 0] - field.x0) / field.dx + 0.5).astype(int), 0, nx - 1)
    j = np.clip(np.floor((points[:, 1] - field.y0) / field.dy + 0.5).astype(int), 0, ny - 1)
    classes: NDArray[np.int64] = field.ground[j, i].astype(np.int64)
    return classes


@njit(cache=True, error_model="numpy", nogil=True)
def _surface(field: Any, points: Any) -> Any:
    out = np.empty((points.shape[0], 3))
    for k in range(points.shape[0]):
        z, px, py = interpolate(
            field.heights, field.x0, field.y0, field.dx, field.dy, points[k, 0], points[k, 1]
        )
        out[k, 0], out[k, 1], out[k, 2] = z, px, py
    return out


def sample_surface(field: CostField, points: Array) -> tuple[Array, Array]:
    """Height (n,) and gradient (n, 2) at which the robot rides over points (n, 2)."""
    values = _surface(field, np.ascontiguousarray(points, dtype=float))
    return values[:, 0].copy(), np.ascontiguousarray(values[:, 1:])
