"""A terrain seen from one vehicle: where it drives, where it fits, where a limit may be near.

ground = driving_ground(terrain, vehicle)
field = ground.field(costs)                # what the compiled search reads
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from planner.compiled_code import njit
from planner.power.vehicles import Vehicle
from planner.search.field import CostField
from planner.search.resolution import DIRECTIONS, MARGIN, YAW_BINS
from planner.search.second_core import in_halves
from planner.search.steady import SteadyCosts
from planner.terrain.heightmap import Terrain
from planner.terrain.interpolation import interpolate, interpolate_many
from planner.terrain.obstacles import yaw_mask

MOST_DIVIDED_NODES = 1_000_000
"""Nodes that a map with divided cells has at most, for time and memory."""
NEAR_LIMIT = 0.94
"""Share of the safe slope from which a limit may be near between the points that are looked at."""


@dataclass(frozen=True)
class DrivingGround:
    """A terrain seen from one vehicle.

    Where the map has cells too coarse for the body to find its way between obstacles, they are
    divided, and all arrays here are of the finer grid.

    Attributes:
        origin, cell: m, centre of node [0, 0] and distance of the nodes.
        ground: (ny, nx) ground class of the cells.
        heights: (ny, nx) m, averaged over the footprint: the height at which the robot rides.
        blocked: (ny, nx) cells that no part of the body may cover.
        mask: (ny, nx) bit k is set where the body fits with yaw k·π/YAW_BINS.
        half_length, half_width: m, of the body with clearance.
        step_height: m, edge that counts as a ledge.
        steepest: (ny, nx) largest tan(slope) within three cells of a node.
    """

    terrain: Terrain
    origin: tuple[float, float]
    cell: tuple[float, float]
    ground: NDArray[np.uint8]
    heights: NDArray[np.float64]
    blocked: NDArray[np.bool_]
    mask: NDArray[np.uint32]
    half_length: float
    half_width: float
    step_height: float
    steepest: NDArray[np.float32]

    @property
    def nbytes(self) -> int:
        """Cached bytes."""
        arrays = (self.ground, self.heights, self.blocked, self.mask, self.steepest)
        return sum(array.nbytes for array in arrays)

    def clearance_penalty(self, weight: float) -> NDArray[np.float64]:
        """Factor (ny, nx) on the cost: 1 in the open, 1 + weight where hardly any yaw fits."""
        free = np.bitwise_count(self.mask).astype(np.float64) / YAW_BINS
        return np.asarray(1.0 + weight * (1.0 - free))

    def field(
        self,
        costs: SteadyCosts,
        *,
        extra: NDArray[np.float64] | None = None,
        factor: NDArray[np.float64] | None = None,
        margin: float = MARGIN,
    ) -> CostField:
        """What the compiled search reads, with these tables of steady costs."""
        # The limit is negative on ground that cannot be driven at all: no slope is safe then.
        safe = max(0.0, min(costs.reach, margin * float(costs.limit.min())))
        same = ("heights", "mask", "blocked", "ground", "half_length", "half_width")
        return CostField(
            **{name: getattr(self, name) for name in same},
            **vars(costs),
            x0=self.origin[0],
            y0=self.origin[1],
            dx=self.cell[0],
            dy=self.cell[1],
            extra=np.zeros(DIRECTIONS) if extra is None else extra,
            factor=np.ones((1, 1)) if factor is None else factor,
            margin=margin,
            step=0.5 * min(self.cell),
            steep=self.steepest > NEAR_LIMIT * safe,
            safe=safe,
        )


def driving_ground(terrain: Terrain, vehicle: Vehicle) -> DrivingGround:
    """Work out what one vehicle feels on a terrain; kept by the caller for further routes."""
    heights = np.ascontiguousarray(terrain.riding_surface(vehicle.half_footprint))
    blocked = terrain.blocked_cells(vehicle.step_height)
    clearance = vehicle.limits.clearance
    half_length = 0.5 * vehicle.length + clearance
    half_width = 0.5 * vehicle.width + clearance
    parts = _division(blocked, terrain.cell, half_width, vehicle.length)
    origin, cell, ground = terrain.origin, terrain.cell, terrain.ground
    if parts > 1:
        origin = (
            origin[0] - 0.5 * cell[0] * (1.0 - 1.0 / parts),
            origin[1] - 0.5 * cell[1] * (1.0 - 1.0 / parts),
        )
        ny, nx = heights.shape
        x = origin[0] + cell[0] / parts * np.arange(nx * parts)
        y = origin[1] + cell[1] / parts * np.arange(ny * parts)
        grid_x, grid_y = np.meshgrid(x, y)
        heights = interpolate_many(
            heights, *terrain.origin, *terrain.cell, grid_x.ravel(), grid_y.ravel()
        )[0].reshape(grid_x.shape)
        blocked = blocked.repeat(parts, 0).repeat(parts, 1)
        ground = ground.repeat(parts, 0).repeat(parts, 1)
        cell = (cell[0] / parts, cell[1] / parts)
    return DrivingGround(
        terrain,
        origin,
        cell,
        np.ascontiguousarray(ground),
        np.ascontiguousarray(heights),
        np.ascontiguousarray(blocked),
        yaw_mask(blocked, *cell, half_length, half_width, YAW_BINS).astype(np.uint32),
        half_length,
        half_width,
        vehicle.step_height,
        maximum_filter(_steepest(np.ascontiguousarray(heights), *cell), size=7),
    )


def _steepest(heights: NDArray[np.float64], dx: float, dy: float) -> NDArray[np.float32]:
    """Largest tan(slope) at nine points of every cell."""
    result = np.empty(heights.shape, np.float32)
    in_halves(len(heights), partial(_fill_steepest, heights, dx, dy, result))
    return result


@njit(cache=True, error_model="numpy", nogil=True)
def _fill_steepest(heights: Any, dx: float, dy: float, result: Any, first: int, last: int) -> None:
    for j in range(first, last):
        for i in range(heights.shape[1]):
            most = 0.0
            for b in (-1.0, 0.0, 1.0):
                for a in (-1.0, 0.0, 1.0):
                    x, y = (i + a / 3.0) * dx, (j + b / 3.0) * dy
                    _, px, py = interpolate(heights, 0.0, 0.0, dx, dy, x, y)
                    most = max(most, px * px + py * py)
            result[j, i] = math.sqrt(most)


def _division(
    blocked: NDArray[np.bool_], cell: tuple[float, float], half_width: float, length: float
) -> int:
    """Into how many parts to divide a cell's sides, so that the body finds gaps between cells."""
    coarse = max(cell)
    if not blocked.any() or coarse > 2.0 * length:
        return 1
    parts = math.ceil(coarse / (0.5 * half_width) - 1e-9)
    while parts > 1 and blocked.size * parts**2 > MOST_DIVIDED_NODES:
        parts -= 1
    return parts
