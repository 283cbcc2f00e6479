"""The grid of triangles of the certified lower bound: nodes, what lies between them, and walls.

    mesh = mesh_of(field, steepest, parts)           # parts cells of the map make one of it
    coarse = coarse_field(field, mesh)                  # map and costs at its nodes alone

Slopes of a cell are kept as ranges: the riding surface over it is a bicubic polynomial
(planner.terrain.interpolation), whose slopes lie between their Bernstein coefficients. Where nodes
are left out, the ranges of several cells are united, so that the bound stays one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.field import CostField

Place = tuple[float, float]


@dataclass(frozen=True)
class Mesh:
    """The grid of triangles, with a ring of continued ground round the map.

    Attributes:
        heights: (ny, nx) m at the nodes.
        ranges: (ny - 1, nx - 1, 4) least and largest slope of the cells along x, and along y.
        classes: (ny - 1, nx - 1) bit c is set where the cell has ground of class c.
        wall: (ny - 1, nx - 1, 2) triangles where the robot cannot be.
        origin: x, y of the first node, m.
        cell: dx, dy, m.
        picked: rows and columns of the map, clipped, that the nodes are.
    """

    heights: Array
    ranges: Array
    classes: NDArray[np.uint64]
    wall: NDArray[np.bool_]
    origin: Place
    cell: Place
    picked: tuple[NDArray[np.int64], NDArray[np.int64]]


def mesh_of(field: CostField, steepest: float, parts: int) -> Mesh:
    """Nodes and triangles of a map; ``parts`` cells of the map make one of the mesh.

    Args:
        field: the map.
        steepest: largest tan(slope) that is driven; steeper ground is a wall.
        parts: along each axis.
    """
    ny, nx = field.heights.shape
    dx, dy = field.dx, field.dy
    # As many rings as make the cells' number a multiple, at least one on every side.
    after = [(-(count + 1)) % parts + 1 for count in (ny, nx)]
    rings = max(*after, 1) + 1
    heights = field.heights
    for _ in range(rings):
        heights = np.pad(heights, 1, mode="reflect", reflect_type="odd")
    inner = heights[rings - 2 : rings + ny + after[0] + 1, rings - 2 : rings + nx + after[1] + 1]
    ranges = slope_ranges(np.ascontiguousarray(inner), dx, dy)
    nodes = inner[1:-1, 1:-1][::parts, ::parts]
    rows = np.clip(np.arange(-1, ny + after[0])[::parts], 0, ny - 1)
    columns = np.clip(np.arange(-1, nx + after[1])[::parts], 0, nx - 1)
    bit = np.uint64(1) << np.pad(field.ground, ((1, after[0]), (1, after[1])), mode="edge").astype(
        np.uint64
    )
    # Under every point lies the class of one of the four nodes round it.
    classes = bit[:-1, :-1] | bit[:-1, 1:] | bit[1:, :-1] | bit[1:, 1:]
    wall = _walls(field, ranges, steepest, after)
    if parts > 1:
        blocks = (nodes.shape[0] - 1, parts, nodes.shape[1] - 1, parts)
        split = [ranges[..., k].reshape(blocks) for k in range(4)]
        ends = [
            part.min(axis=(1, 3)) if k % 2 == 0 else part.max(axis=(1, 3))
            for k, part in enumerate(split)
        ]
        ranges = np.stack(ends, axis=2)
        classes = np.bitwise_or.reduce(classes.reshape(blocks), axis=(1, 3))
        solid = wall.all(axis=2).reshape(blocks).min(axis=(1, 3))
        wall = np.stack([solid, solid], axis=2)
    origin, cell = (field.x0 - dx, field.y0 - dy), (dx * parts, dy * parts)
    return Mesh(np.ascontiguousarray(nodes), ranges, classes, wall, origin, cell, (rows, columns))


@njit(cache=True, error_model="numpy")
def _bezier(heights: Any, j: int, i: int, out: Any) -> None:
    """Bernstein coefficients (4, 4) of the surface over the cell whose south-west node is (j, i)
    of an array with two rings of continued ground round it."""
    rows = np.empty((4, 4))
    for m in range(4):
        h0, h1 = heights[j + m - 1, i - 1], heights[j + m - 1, i]
        h2, h3 = heights[j + m - 1, i + 1], heights[j + m - 1, i + 2]
        rows[m, 0], rows[m, 3] = h1, h2
        rows[m, 1], rows[m, 2] = h1 + (h2 - h0) / 6.0, h2 - (h3 - h1) / 6.0
    for n in range(4):
        out[0, n], out[3, n] = rows[1, n], rows[2, n]
        out[1, n] = rows[1, n] + (rows[2, n] - rows[0, n]) / 6.0
        out[2, n] = rows[2, n] - (rows[3, n] - rows[1, n]) / 6.0


@njit(cache=True, error_model="numpy", nogil=True)
def slope_ranges(heights: Any, dx: float, dy: float) -> Any:
    """Least and largest slope along x and along y of every cell, (ny - 3, nx - 3, 4).

    ``heights`` has one ring more than the cells' nodes on every side.
    """
    ny, nx = heights.shape
    out = np.empty((ny - 3, nx - 3, 4))
    b = np.empty((4, 4))
    for j in range(ny - 3):
        for i in range(nx - 3):
            _bezier(heights, j + 1, i + 1, b)
            r = out[j, i]
            r[0], r[1], r[2], r[3] = np.inf, -np.inf, np.inf, -np.inf
            for m in range(4):
                for n in range(4):
                    if n < 3:
                        slope = 3.0 * (b[m, n + 1] - b[m, n]) / dx
                        r[0], r[1] = min(r[0], slope), max(r[1], slope)
                    if m < 3:
                        slope = 3.0 * (b[m + 1, n] - b[m, n]) / dy
                        r[2], r[3] = min(r[2], slope), max(r[3], slope)
    return out


def coarse_field(field: CostField, mesh: Mesh) -> CostField:
    """Map and costs at the nodes of the mesh alone: enough to find where good routes lead."""
    nodes = np.ix_(*mesh.picked)
    names = ["heights", "mask", "blocked", "ground", "steep"]
    names += ["factor"] if field.factor.size > 1 else []
    picked: dict[str, Any] = {k: np.ascontiguousarray(getattr(field, k)[nodes]) for k in names}
    return field._replace(
        **picked,
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
    inner = min(field.half_length, field.half_width) + 0.5 * min(field.dx, field.dy)
    within = apart + math.hypot(field.dx, field.dy) <= inner
    corners = within[:-1, :-1], within[:-1, 1:], within[1:, :-1], within[1:, 1:]
    wall[..., 0] |= corners[0] | corners[1] | corners[2]
    wall[..., 1] |= corners[3] | corners[1] | corners[2]
    return wall
