"""The map as one robot feels it, and what driving over it costs in any direction.

``driving_ground`` turns a terrain and a vehicle into arrays: the footprint-averaged heights, their
gradient at the nodes, where the body fits and with which yaw. Together with the tables of
``planner.search.steady`` they form a ``CostField``, which answers one question fast:

    travel_cost(field, x, y, direction) → cost per horizontal metre, yaw chosen as is cheapest

Where something stands near, only yaw angles count at which the body's rectangle, grown by the
clearance, is free: a passage narrower than the robot is long is entered lengthwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from planner.power.kinematics import X, Y
from planner.power.vehicle import Vehicle
from planner.search.steady import (
    DIRECTIONS,
    MARGIN,
    YAWS,
    SteadyCosts,
    cost_for_best_yaw,
    cost_for_yaw,
)
from planner.terrain.heightmap import Terrain
from planner.terrain.interpolation import interpolate, interpolate_many
from planner.terrain.obstacles import blocked_cells, rectangle_free, yaw_mask

YAW_BINS = 32
"""Bins of the body's yaw in the mask; its rectangle looks the same after half a turn."""
SPARE = 0.02
"""m beyond the clearance that the search keeps, for what happens between its samples."""
MOST_NODES = 1_000_000
"""Nodes that dividing cells may lead to."""
ALL_YAWS = np.uint64((1 << YAW_BINS) - 1)


class CostField(NamedTuple):
    """Arrays that the compiled search reads; row 0 is the southern row."""

    heights: NDArray[np.float64]
    slope_x: NDArray[np.float64]
    slope_y: NDArray[np.float64]
    mask: NDArray[np.uint64]
    blocked: NDArray[np.bool_]
    ground: NDArray[np.uint8]
    x0: float
    y0: float
    dx: float
    dy: float
    half_length: float
    half_width: float
    by_yaw: NDArray[np.float64]
    yaw_limit: NDArray[np.float64]
    best: NDArray[np.float64]
    limit: NDArray[np.float64]
    extra: NDArray[np.float64]
    """(DIRECTIONS,) added per metre by azimuth of travel: wind."""
    factor: NDArray[np.float64]
    """(ny, nx) factor on the cost, or (1, 1): ground to be avoided."""
    margin: float
    """Share of the slope limit that may be used."""
    step: float
    """m between the points at which a path is priced."""
    steep: NDArray[np.bool_]
    """(ny, nx) nodes round which a limit may be near: moves there are priced closely."""


@dataclass(frozen=True)
class DrivingGround:
    """A terrain seen from one vehicle.

    Where the map has cells too coarse for the body to find its way between obstacles, they are
    divided, and all arrays here are of the finer grid.

    Attributes:
        origin, cell: m, centre of node [0, 0] and distance of the nodes.
        ground: (ny, nx) ground class of the cells.
        heights: (ny, nx) m, averaged over the footprint: the height at which the robot rides.
        slope_x, slope_y: (ny, nx) gradient of ``heights`` at the nodes.
        blocked: (ny, nx) cells that no part of the body may cover.
        mask: (ny, nx) bit k is set where the body fits with yaw k·π/YAW_BINS.
        half_length, half_width: m, of the body with clearance and ``SPARE``.
        step_height: m, edge that counts as a ledge.
        steepest: (ny, nx) largest tan(slope) within three cells of a node.
    """

    terrain: Terrain
    origin: tuple[float, float]
    cell: tuple[float, float]
    ground: NDArray[np.uint8]
    heights: NDArray[np.float64]
    slope_x: NDArray[np.float64]
    slope_y: NDArray[np.float64]
    blocked: NDArray[np.bool_]
    mask: NDArray[np.uint64]
    half_length: float
    half_width: float
    step_height: float
    steepest: NDArray[np.float64]

    def preferring_room(self, weight: float) -> NDArray[np.float64]:
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
        return CostField(
            self.heights,
            self.slope_x,
            self.slope_y,
            self.mask,
            self.blocked,
            self.ground,
            float(self.origin[0]),
            float(self.origin[1]),
            float(self.cell[0]),
            float(self.cell[1]),
            self.half_length,
            self.half_width,
            costs.by_yaw,
            costs.yaw_limit,
            costs.best,
            costs.limit,
            np.zeros(DIRECTIONS) if extra is None else extra,
            np.ones((1, 1)) if factor is None else factor,
            margin,
            0.5 * float(min(self.cell)),
            self.steepest > 0.8 * float(costs.limit.min()),
        )


def step_height(vehicle: Vehicle) -> float:
    """Largest step, m, that a wheel climbs without a run: half its radius."""
    return 0.5 * vehicle.layout.radius


def driving_ground(terrain: Terrain, vehicle: Vehicle) -> DrivingGround:
    """Work out what one vehicle feels on a terrain; kept by the caller for further routes."""
    table = vehicle.layout.table
    half_footprint = 0.5 * (np.abs(table[:, X]).max() + np.abs(table[:, Y]).max())
    heights = np.ascontiguousarray(terrain.riding_surface(half_footprint))
    blocked = blocked_cells(terrain, step_height(vehicle))
    clearance = vehicle.limits.clearance
    half_length = 0.5 * vehicle.length + clearance + SPARE
    half_width = 0.5 * vehicle.width + clearance + SPARE
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
    slope_y, slope_x = np.gradient(heights, cell[1], cell[0])
    return DrivingGround(
        terrain,
        origin,
        cell,
        np.ascontiguousarray(ground),
        np.ascontiguousarray(heights),
        np.ascontiguousarray(slope_x),
        np.ascontiguousarray(slope_y),
        np.ascontiguousarray(blocked),
        yaw_mask(blocked, *cell, half_length, half_width, YAW_BINS),
        half_length,
        half_width,
        step_height(vehicle),
        maximum_filter(_steepest(np.ascontiguousarray(heights), *cell), size=7),
    )


@njit(cache=True, error_model="numpy")
def _steepest(heights: Any, dx: float, dy: float) -> Any:
    """Largest tan(slope) at nine points of every cell."""
    ny, nx = heights.shape
    result = np.zeros((ny, nx))
    for j in range(ny):
        for i in range(nx):
            for b in (-1.0, 0.0, 1.0):
                for a in (-1.0, 0.0, 1.0):
                    x, y = (i + a / 3.0) * dx, (j + b / 3.0) * dy
                    _, px, py = interpolate(heights, 0.0, 0.0, dx, dy, x, y)
                    result[j, i] = max(result[j, i], math.sqrt(px * px + py * py))
    return result


def _division(
    blocked: NDArray[np.bool_], cell: tuple[float, float], half_width: float, length: float
) -> int:
    """Into how many parts to divide a cell's sides, so that the body finds gaps between cells."""
    coarse = max(cell)
    if not blocked.any() or coarse > 2.0 * length:
        return 1
    parts = math.ceil(coarse / (0.5 * half_width) - 1e-9)
    while parts > 1 and blocked.size * parts**2 > MOST_NODES:
        parts -= 1
    return parts


@njit(cache=True, error_model="numpy", inline="always")
def _node(offset: float, cell: float, count: int) -> int:
    return min(max(int(math.floor(offset / cell + 0.5)), 0), count - 1)


@njit(cache=True, error_model="numpy")
def slope_at(field: Any, x: float, y: float) -> tuple[float, float]:
    """Gradient at a point, bilinear between the nodes' gradients."""
    ny, nx = field.slope_x.shape
    u = min(max((x - field.x0) / field.dx, 0.0), nx - 1.0)
    v = min(max((y - field.y0) / field.dy, 0.0), ny - 1.0)
    i, j = min(int(u), nx - 2), min(int(v), ny - 2)
    a, b = u - i, v - j
    px = (field.slope_x[j, i] * (1 - a) + field.slope_x[j, i + 1] * a) * (1 - b) + (
        field.slope_x[j + 1, i] * (1 - a) + field.slope_x[j + 1, i + 1] * a
    ) * b
    py = (field.slope_y[j, i] * (1 - a) + field.slope_y[j, i + 1] * a) * (1 - b) + (
        field.slope_y[j + 1, i] * (1 - a) + field.slope_y[j + 1, i + 1] * a
    ) * b
    return px, py


@njit(cache=True, error_model="numpy")
def mask_bit(yaw: float) -> Any:
    """Bit of the yaw mask that is nearest to a yaw angle."""
    k = int(math.floor(yaw / math.pi * YAW_BINS + 0.5)) % YAW_BINS
    return np.uint64(1) << np.uint64(k)


@njit(cache=True, error_model="numpy")
def masked_cost(
    field: Any,
    ground: int,
    mask: Any,
    direction: float,
    azimuth: float,
    steepness: float,
    x: float,
    y: float,
    exact: bool,
) -> float:
    """Cheapest cost per metre among yaw angles at which the body is free.

    With ``exact`` the rectangle is tested at (x, y) itself, cheapest yaw first; otherwise the mask
    of the node speaks for the point.
    """
    tried = np.uint64(0)
    one = np.uint64(1)
    while True:
        least, at = np.inf, -1
        for t in range(YAWS):
            if (tried >> np.uint64(t)) & one:
                continue
            yaw = direction + 2.0 * math.pi * t / YAWS
            if not mask & mask_bit(yaw):
                continue
            cost = cost_for_yaw(
                field.by_yaw, field.yaw_limit, ground, t, azimuth, steepness, field.margin
            )
            if cost < least:
                least, at = cost, t
        if at < 0 or not exact:
            return least
        yaw = direction + 2.0 * math.pi * at / YAWS
        if rectangle_free(
            field.blocked,
            field.x0,
            field.y0,
            field.dx,
            field.dy,
            x,
            y,
            yaw,
            field.half_length,
            field.half_width,
        ):
            return least
        tried |= one << np.uint64(at)


@njit(cache=True, error_model="numpy")
def wind_cost(field: Any, direction: float) -> float:
    """Cost per metre that depends on the direction of travel over ground alone."""
    if field.extra[0] == 0.0 and field.extra[DIRECTIONS // 4] == 0.0:
        return 0.0
    a = direction / (2.0 * math.pi) * DIRECTIONS
    a -= DIRECTIONS * math.floor(a / DIRECTIONS)
    k = int(a) % DIRECTIONS
    w = a - int(a)
    extra: float = (1.0 - w) * field.extra[k] + w * field.extra[(k + 1) % DIRECTIONS]
    return extra


@njit(cache=True, error_model="numpy")
def travel_cost(field: Any, x: float, y: float, direction: float, exact: bool) -> float:
    """Cost per horizontal metre at a point when driving in a direction; infinity if impossible.

    ``exact`` takes slope and room at the point itself instead of those of the nodes round it.
    """
    ny, nx = field.heights.shape
    i = _node(x - field.x0, field.dx, nx)
    j = _node(y - field.y0, field.dy, ny)
    if exact:
        # The very slope that the finished motion is checked on.
        _, px, py = interpolate(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
    else:
        px, py = slope_at(field, x, y)
    steepness = math.sqrt(px * px + py * py)
    azimuth = math.atan2(py, px) - direction
    ground = field.ground[j, i]
    mask = field.mask[j, i]
    if mask == ALL_YAWS:
        cost = cost_for_best_yaw(field.best, field.limit, ground, azimuth, steepness, field.margin)
    else:
        if exact:
            # A yaw that is free here may be masked at the nearest node, not at all its neighbours.
            for b in range(max(j - 1, 0), min(j + 2, ny)):
                for a in range(max(i - 1, 0), min(i + 2, nx)):
                    mask |= field.mask[b, a]
        if mask == np.uint64(0):
            return np.inf
        cost = masked_cost(field, ground, mask, direction, azimuth, steepness, x, y, exact)
    if field.factor.shape[0] > 1:
        cost *= field.factor[j, i]
    return max(cost + wind_cost(field, direction), 1e-3)


@njit(cache=True, error_model="numpy")
def segment_cost(
    field: Any, xa: float, ya: float, xb: float, yb: float, step: float, exact: bool
) -> float:
    """Cost of a straight segment by the midpoint rule with steps of at most ``step`` metres."""
    ex, ey = xb - xa, yb - ya
    length = math.sqrt(ex * ex + ey * ey)
    if length < 1e-12:
        return 0.0
    direction = math.atan2(ey, ex)
    count = max(1, int(math.ceil(length / step)))
    total = 0.0
    ny, nx = field.heights.shape
    for k in range(count):
        w = (k + 0.5) / count
        i = _node(xa + w * ex - field.x0, field.dx, nx)
        j = _node(ya + w * ey - field.y0, field.dy, ny)
        # Where a limit may be near, two points instead of one: no stepping over what is too steep.
        points = 2 if field.steep[j, i] else 1
        for point in range(points):
            u = (k + (point + 0.5) / points) / count
            cost = travel_cost(field, xa + u * ex, ya + u * ey, direction, exact)
            if cost == np.inf:
                return np.inf
            total += cost / points
    return total * length / count


@njit(cache=True, error_model="numpy")
def polyline_cost(field: Any, points: Any, step: float, exact: bool) -> float:
    """Cost of a polyline (k, 2)."""
    total = 0.0
    for k in range(points.shape[0] - 1):
        total += segment_cost(
            field,
            points[k, 0],
            points[k, 1],
            points[k + 1, 0],
            points[k + 1, 1],
            step,
            exact,
        )
    return total
