"""The ground under points of a map: height, slope and class, as the robot feels them.

heights, gradients = sample_surface(field, points)
classes = ground_classes(field, points)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.field.cost_field import CostField
from planner.terrain.interpolation import interpolate_many


def ground_classes(field: CostField, points: Array) -> NDArray[np.int64]:
    """Ground class (n,) of the cells under points (n, 2)."""
    classes: NDArray[np.int64] = field.ground[field.nodes_at(points)].astype(np.int64)
    return classes


def sample_surface(field: CostField, points: Array) -> tuple[Array, Array]:
    """Height (n,) and gradient (n, 2) of the riding surface at points (n, 2)."""
    x, y = np.ascontiguousarray(np.asarray(points, float).T)
    z, px, py = interpolate_many(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
    return z, np.column_stack([px, py])
