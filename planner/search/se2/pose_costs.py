"""What poses cost on the ground: metres with a yaw, bends, and straight lines at a path's ends.

    left, right = bends_of(by_yaw, yaw_limit, margin, steepness, azimuth, yaw, direction)
    states_near(field, frame, End(x, y, costs), leaving)

Near the slope limit, what lies between two directions or two nodes may not hold, although both do.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.field import wind_cost
from planner.search.resolution import ALL_YAWS, LEAST_COST, STATES, YAW_BINS
from planner.search.steady import polar
from planner.terrain.footprint import touches
from planner.terrain.interpolation import interpolate

ANGLE = math.pi / YAW_BINS
"""rad from one angle of the body to the next."""
MOST_BEND = YAW_BINS // 2
"""Angles by which the travel may turn from one move to the next on steep ground: 90°."""
STRAIGHT_CELLS = 6
"""Cells from an end on steep ground within which nodes may be next: straight lines to more of them
have more directions than moves of the grid, and few directions may leave such a place."""
DIRECTION_ROUNDING = 1e-9
"""rad by which a bend may be larger, since directions are rounded."""


class End(NamedTuple):
    """Start or goal.

    Attributes:
        x, y: m.
        costs: (YAW_BINS,) cost of each angle there; infinite where it is impossible.
    """

    x: float
    y: float
    costs: Array


@njit(cache=True, error_model="numpy", inline="always")
def is_free(mask: Any, b: int) -> bool:
    """Whether an angle is free."""
    return bool((mask >> np.uint32(b)) & np.uint32(1))


@njit(cache=True, error_model="numpy", inline="always")
def as_polar(px: float, py: float) -> tuple[float, float]:
    """Steepness and azimuth, rad, of a gradient."""
    steepness = math.sqrt(px * px + py * py)
    return steepness, math.atan2(py, px) if steepness > 0.0 else 0.0


@njit(cache=True, error_model="numpy", inline="always")
def from_travel(b: int, direction: float) -> int:
    """The angle of the body to the travel, in steps."""
    return int(math.floor((b * ANGLE - direction) / ANGLE + 0.5)) % STATES


@njit(cache=True, error_model="numpy")
def metre_cost(
    by_yaw: Any,
    yaw_limit: Any,
    margin: float,
    steepness: float,
    azimuth: float,
    turned: int,
) -> float:
    """Cost per metre on a slope at an even yaw, ``turned`` angles from the travel or from behind.

    Args:
        by_yaw, yaw_limit: of the CostField, for the class of the ground.
        margin: share of the slope limit that may be used.
        steepness: tan(slope).
        azimuth: rad, of the slope to the travel.
        turned: in 0 to STATES - 1.
    """
    # The better end of the body goes first.
    best = np.inf
    for turn in (turned, (turned + STATES // 2) % STATES):
        best = min(best, polar(by_yaw[turn], yaw_limit[turn], azimuth, steepness, margin))
    return best


@njit(cache=True, error_model="numpy")
def bends_of(
    by_yaw: Any,
    yaw_limit: Any,
    margin: float,
    steepness: float,
    azimuth: float,
    yaw: int,
    direction: float,
) -> tuple[float, float]:
    """Largest bends to the left and to the right, rad, that the limits let the body follow.

    The travel passes every direction between two moves, the body keeps its yaw meanwhile.

    Args:
        by_yaw, yaw_limit, margin, steepness: as for ``metre_cost``.
        azimuth: rad, of the slope.
        yaw: angle of the body.
        direction: rad, of the move before the bend.
    """
    found = [0.0, 0.0]
    for side in range(2):
        for turned in range(1, MOST_BEND + 1):
            found[side] = turned * ANGLE
            between = direction + (1 - 2 * side) * turned * ANGLE
            cost = metre_cost(
                *(by_yaw, yaw_limit, margin, steepness),
                *(azimuth - between, from_travel(yaw, between)),
            )
            if cost == np.inf:
                break
    return found[0] + DIRECTION_ROUNDING, found[1] + DIRECTION_ROUNDING


@njit(cache=True, error_model="numpy")
def _straight_cost(
    field: Any, x: float, y: float, to_x: float, to_y: float, direction: float, yaw: int
) -> float:
    """Cost of a straight line between an end of the path and a node, at an even yaw."""
    length = math.hypot(to_x - x, to_y - y)
    count = int(math.ceil(2.0 * length / min(field.dx, field.dy)))
    turned, total = from_travel(yaw, direction), 0.0
    for k in range(count + 1):
        at_x, at_y = x + (to_x - x) * k / count, y + (to_y - y) * k / count
        _, slope_x, slope_y = interpolate(
            field.heights, field.x0, field.y0, field.dx, field.dy, at_x, at_y
        )
        i = int(math.floor((at_x - field.x0) / field.dx + 0.5))
        j = int(math.floor((at_y - field.y0) / field.dy + 0.5))
        ground, (steepness, azimuth) = field.ground[j, i], as_polar(slope_x, slope_y)
        cost = metre_cost(
            *(field.by_yaw[ground], field.yaw_limit[ground], field.margin),
            *(steepness, azimuth - direction, turned),
        )
        cost = max(cost + wind_cost(field, direction), LEAST_COST)
        if field.factor.shape[0] > 1:
            cost *= field.factor[j, i]
        total += cost
        if total == np.inf:
            break
    return total * length / (count + 1)


@njit(cache=True, error_model="numpy")
def states_near(field: Any, frame: Any, end: End, leaving: bool) -> list[tuple[int, int, float]]:
    """States round an end of the path: node, angle, and cost of the straight line between."""
    x, y = end.x, end.y
    ny, nx = field.heights.shape
    i0 = int(math.floor((x - field.x0) / field.dx))
    j0 = int(math.floor((y - field.y0) / field.dy))
    off = 1
    if field.steep[min(max(j0, 0), ny - 1), min(max(i0, 0), nx - 1)]:
        off = STRAIGHT_CELLS
    found = [(0, 0, 0.0) for _ in range(0)]
    for j in range(max(j0 - off, 0), min(j0 + off + 2, ny)):
        for i in range(max(i0 - off, 0), min(i0 + off + 2, nx)):
            px, py = field.x0 + i * field.dx, field.y0 + j * field.dy
            for b in range(YAW_BINS):
                if end.costs[b] == np.inf or not is_free(field.mask[j, i], b):
                    continue
                if field.mask[j, i] != ALL_YAWS and touches(
                    field.blocked, frame, x, y, px, py, b * ANGLE, 0.0
                ):
                    continue
                ex, ey = (px - x, py - y) if leaving else (x - px, y - py)
                cost = 0.0
                if math.hypot(ex, ey) > 1e-9:
                    cost = _straight_cost(field, x, y, px, py, math.atan2(ey, ex), b)
                if cost < np.inf:
                    found.append((j * nx + i, b, cost + end.costs[b]))
    return found
