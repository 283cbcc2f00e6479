"""The grid of triangles of the certified lower bound: nodes, what lies between them, and walls.

    mesh = mesh_of(field, conditions, steepest, parts)      # parts cells of the map make one of it
    coarse = coarse_field(field, mesh)                  # map and costs at its nodes alone

Slopes and heights of a cell are kept as ranges, so that leaving nodes out leaves the bound one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from planner.arrays import Array
from planner.quantities import INDEX
from planner.search.certificate.triangle_costs import Ground, cell_ranges
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.resolution import SPARE

Place = tuple[float, float]


@dataclass(frozen=True)
class Mesh:
    """The grid of triangles, with a ring of continued ground round the map.

    Attributes:
        ground: nodes and cells.
        origin: x, y of the first node, m.
        picked: rows and columns of the map, clipped, that the nodes are.
    """

    ground: Ground
    origin: Place
    picked: tuple[NDArray[np.int64], NDArray[np.int64]]

    @property
    def cell(self) -> Place:
        """dx, dy, m."""
        return self.ground.dx, self.ground.dy


def mesh_of(field: CostField, conditions: OperatingConditions, steepest: float, parts: int) -> Mesh:
    """Nodes and triangles of a map; ``parts`` cells of the map make one of the mesh."""
    ny, nx = field.heights.shape
    dx, dy = field.dx, field.dy
    # As many rings as make the cells' number a multiple, at least one on every side.
    after = [(-(count + 1)) % parts + 1 for count in (ny, nx)]
    heights = field.heights
    for _ in range(max(*after, 1) + 1):
        heights = np.pad(heights, 1, mode="reflect", reflect_type="odd")
    rings = max(*after, 1) + 1
    inner = heights[rings - 2 : rings + ny + after[0] + 1, rings - 2 : rings + nx + after[1] + 1]
    ranges = cell_ranges(np.ascontiguousarray(inner), dx, dy)
    nodes = inner[1:-1, 1:-1][::parts, ::parts]
    rows = np.clip(np.arange(-1, ny + after[0])[::parts], 0, ny - 1)
    columns = np.clip(np.arange(-1, nx + after[1])[::parts], 0, nx - 1)
    factors = conditions.class_rows[:, INDEX["rolling_factor"]]
    factor = np.pad(factors[field.ground], ((1, after[0]), (1, after[1])), mode="edge")
    wall = _walls(field, ranges, steepest, after)
    if parts == 1:
        rolling = np.stack([factor, factor], axis=2)
    else:
        rolling = np.empty((*nodes.shape, 2))
        rolling[..., 0], rolling[..., 1] = factor.min(), factor.max()
        blocks = (nodes.shape[0] - 1, parts, nodes.shape[1] - 1, parts)
        split = [ranges[..., k].reshape(blocks) for k in range(6)]
        ranges = np.stack(
            [
                part.min(axis=(1, 3)) if k % 2 == 0 else part.max(axis=(1, 3))
                for k, part in enumerate(split)
            ],
            axis=2,
        )
        solid = wall.all(axis=2).reshape(blocks).min(axis=(1, 3))
        wall = np.stack([solid, solid], axis=2)
    whole = Ground(nodes, ranges, rolling, wall, dx * parts, dy * parts, steepest)
    ground = whole.part(slice(None), slice(None))
    return Mesh(ground, (field.x0 - dx, field.y0 - dy), (rows, columns))


def coarse_field(field: CostField, mesh: Mesh) -> CostField:
    """Map and costs at the nodes of the mesh alone: enough to find where good routes lead."""
    nodes = np.ix_(*mesh.picked)
    return field._replace(
        heights=np.ascontiguousarray(field.heights[nodes]),
        mask=np.ascontiguousarray(field.mask[nodes]),
        blocked=np.ascontiguousarray(field.blocked[nodes]),
        ground=np.ascontiguousarray(field.ground[nodes]),
        steep=np.ascontiguousarray(field.steep[nodes]),
        factor=np.ascontiguousarray(field.factor[nodes]) if field.factor.size > 1 else field.factor,
        x0=mesh.origin[0],
        y0=mesh.origin[1],
        dx=mesh.cell[0],
        dy=mesh.cell[1],
        step=field.step * mesh.cell[0] / field.dx,
    )


def _walls(field: CostField, ranges: Array, steepest: float, after: list[int]) -> NDArray[np.bool_]:
    """Triangles (cells y, cells x, 2) that are too steep or too near something everywhere."""
    gentlest = [
        np.where(low * high <= 0.0, 0.0, np.minimum(np.abs(low), np.abs(high)))
        for low, high in ((ranges[..., 0], ranges[..., 1]), (ranges[..., 2], ranges[..., 3]))
    ]
    steep = np.hypot(*gentlest) > steepest
    wall = np.stack([steep, steep], axis=2)
    if not field.blocked.any():
        return wall
    blocked = np.pad(field.blocked, ((1, after[0]), (1, after[1])))
    apart = distance_transform_edt(~blocked, sampling=(field.dy, field.dx))
    # A disc round the centre lies in the body whatever its yaw; one in a cell lies in the cell.
    inner = min(field.half_length, field.half_width) - SPARE + 0.5 * min(field.dx, field.dy)
    within = apart + math.hypot(field.dx, field.dy) <= inner
    corners = within[:-1, :-1], within[:-1, 1:], within[1:, :-1], within[1:, 1:]
    wall[..., 0] |= corners[0] | corners[1] | corners[2]
    wall[..., 1] |= corners[3] | corners[1] | corners[2]
    return wall
