"""What driving over a map costs in any direction, for compiled code.

``planner.search.situation.traversability`` turns a terrain and a vehicle into arrays; with the
tables of ``planner.search.steady.steady_cost`` they form a ``CostField``, which answers one
question fast:

    segment_cost(field, xa, ya, xb, yb, step) → cost of a straight line, yaw chosen as is cheapest

Well inside all limits and with room for every yaw the cost of a metre is a function of the slope
along and across the path, tabulated once more in these two (``gentle``): no angles to work out.

Where something stands near, only yaw angles count at which the body's rectangle, grown by the
clearance, is free: a passage narrower than the robot is long is entered lengthwise.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from planner.compiled_code import njit
from planner.search.resolution import (
    ALL_YAWS,
    DIRECTIONS,
    GENTLE,
    LEAST_COST,
    STEEPNESSES,
    YAW_BINS,
    YAWS,
)
from planner.search.steady import cost_for_best_yaw, polar
from planner.terrain.footprint import body_fits, middle_fits
from planner.terrain.interpolation import interpolate


class CostField(NamedTuple):
    """Arrays that the compiled search reads; row 0 is the southern row."""

    heights: NDArray[np.float64]
    mask: NDArray[np.uint32]
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
    crab_angle: NDArray[np.float64]
    best: NDArray[np.float64]
    limit: NDArray[np.float64]
    order: NDArray[np.uint8]
    """(grounds, DIRECTIONS, STEEPNESSES, YAWS) numbers of the yaws, cheapest first."""
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
    gentle: NDArray[np.float64]
    """(grounds, GENTLE, GENTLE) cost per metre by slope along and across, with the best yaw."""
    reach: float
    """Slope up to which ``gentle`` goes."""
    safe: float
    """Slope up to which no limit is broken whatever the direction."""

    def nodes_at(self, points: ArrayLike) -> tuple[Any, Any]:
        """Rows and columns of the nodes nearest to points (..., 2), m."""
        ny, nx = self.heights.shape
        cells = (np.asarray(points, float) - (self.x0, self.y0)) / (self.dx, self.dy)
        i, j = np.floor(cells + 0.5).astype(np.int64).T
        return j.clip(0, ny - 1), i.clip(0, nx - 1)

    def body_frame(self) -> NDArray[np.float64]:
        """What ``touches`` needs in addition to blocked cells, (6,): origin, cell, half sides."""
        return np.array([self.x0, self.y0, self.dx, self.dy, self.half_length, self.half_width])

    def least_cost(self) -> float:
        """Cost of a metre that no metre on this map goes below, in any direction, with any yaw."""
        tables = (self.gentle, self.best, self.by_yaw)
        least = min(float(table.min(initial=np.inf)) for table in tables)
        least *= min(1.0, float(self.factor.min()))
        # Rounding of the sum over a segment's points is far below this.
        return (1.0 - 1e-9) * max(least + float(self.extra.min()), LEAST_COST)


@njit(cache=True, error_model="numpy", inline="always")
def _node(offset: float, cell: float, count: int) -> int:
    return min(max(int(math.floor(offset / cell + 0.5)), 0), count - 1)


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
    exact: bool | np.bool_,
) -> float:
    """Cheapest cost per metre among yaw angles at which the body is free.

    With ``exact`` the rectangle is tested at (x, y) itself; otherwise the mask of the node speaks
    for the point. Yaws are tried in the order of their costs at the nearest entry of the tables.
    """
    f = int(math.floor(azimuth / (2.0 * math.pi) * DIRECTIONS + 0.5)) % DIRECTIONS
    edge = field.limit[ground, f]
    s = 0
    if edge > 0.0:
        s = min(int(steepness / edge * (STEEPNESSES - 1) + 0.5), STEEPNESSES - 1)
    order, margin = field.order[ground, f, s], field.margin
    by_yaw, yaw_limit = field.by_yaw[ground], field.yaw_limit[ground]
    # Number of the nearest bin, before whole turns are taken off.
    forward = int(math.floor(direction / math.pi * YAW_BINS + 0.5))
    looked = False
    for rank in range(YAWS):
        t = order[rank]
        # Angles of the body are as far apart as bins.
        bit = np.uint64(1) << np.uint64((forward + t) % YAW_BINS)
        if not mask & bit:
            continue
        cost: float = polar(by_yaw[t], yaw_limit[t], azimuth, steepness, margin)
        if cost == np.inf:
            continue
        if not exact or body_fits(field, x, y, direction + 2.0 * math.pi * t / YAWS):
            return cost
        if not looked and not middle_fits(field, x, y):
            return np.inf
        looked = True
        # After half a turn the body looks the same.
        mask &= ~bit
    return np.inf


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


@njit(cache=True, error_model="numpy", inline="always")
def _free_round(mask: Any, j: int, i: int) -> Any:
    """Yaws (bits) that are free at node (j, i) or at a neighbour.

    A yaw that is free at a point may be masked at the nearest node, not at all its neighbours.
    """
    ny, nx = mask.shape
    free = np.uint64(0)
    for b in range(max(j - 1, 0), min(j + 2, ny)):
        for a in range(max(i - 1, 0), min(i + 2, nx)):
            free |= mask[b, a]
    return free


@njit(cache=True, error_model="numpy")
def _tight_cost(
    field: Any, j: int, i: int, x: float, y: float, px: float, py: float, direction: float
) -> float:
    """Cost per metre near node (j, i), where a limit or something solid may be near.

    Args:
        field: map and costs.
        j, i: the nearest node.
        x, y: the point, m.
        px, py: gradient there.
        direction: rad, of the travel.
    """
    ground, mask = field.ground[j, i], field.mask[j, i]
    steepness = math.sqrt(px * px + py * py)
    azimuth = math.atan2(py, px) - direction
    if mask == ALL_YAWS:
        return cost_for_best_yaw(field.best, field.limit, ground, azimuth, steepness, field.margin)
    mask = _free_round(field.mask, j, i)
    if mask == np.uint64(0):
        return np.inf
    exact = np.bool_(True)  # a literal would be compiled beside what others ask for
    return masked_cost(field, ground, mask, direction, azimuth, steepness, x, y, exact)


@njit(cache=True, error_model="numpy")
def _masked_out(
    field: Any, xa: float, ya: float, ex: float, ey: float, begun: int, count: int, finer: int
) -> bool:
    """Whether no yaw is free round a point that ``segment_cost`` would price, by masks alone.

    Args:
        field: map and costs.
        xa, ya, ex, ey: m, where the segment begins, and the way to its end.
        begun: number of the piece that is looked at first.
        count: pieces of the segment.
        finer: points on each of them where something may be near.
    """
    mask, steep = field.mask, field.steep
    ny, nx = mask.shape
    for k in range(begun, count):
        w = (k + 0.5) / count
        i = _node(xa + w * ex - field.x0, field.dx, nx)
        j = _node(ya + w * ey - field.y0, field.dy, ny)
        points = 1
        if steep[j, i]:
            points = 2 * finer
        elif mask[j, i] != ALL_YAWS:
            points = finer
        for point in range(points):
            if points > 1:
                w = (k + (point + 0.5) / points) / count
                i = _node(xa + w * ex - field.x0, field.dx, nx)
                j = _node(ya + w * ey - field.y0, field.dy, ny)
            if mask[j, i] == 0 and _free_round(mask, j, i) == np.uint64(0):
                return True
    return False


@njit(cache=True, error_model="numpy")
def segment_cost(field: Any, xa: float, ya: float, xb: float, yb: float, step: float) -> float:
    """Cost of a straight segment by the midpoint rule with steps of at most ``step`` metres.

    A ``step`` above the field's own holds in the open only.
    """
    ex, ey = xb - xa, yb - ya
    length = math.sqrt(ex * ex + ey * ey)
    if length < 1e-12:
        return 0.0
    # Arrays by names of their own: taking them out of the tuple costs more than a look-up.
    heights, mask, grounds, steep = field.heights, field.mask, field.ground, field.steep
    gentle, factor, reach, safe = field.gentle, field.factor, field.reach, field.safe
    best, limit, margin = field.best, field.limit, field.margin
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    ny, nx = heights.shape
    direction = math.atan2(ey, ex)
    ux, uy = ex / length, ey / length
    wind = 0.0
    if field.extra[0] != 0.0 or field.extra[DIRECTIONS // 4] != 0.0:
        wind = wind_cost(field, direction)
    scale = 0.5 * (GENTLE - 1) / reach
    count = max(1, int(math.ceil(length / step)))
    finer = max(1, int(step / field.step + 0.5))
    total = 0.0
    doubtful = False
    for k in range(count):
        w = (k + 0.5) / count
        i = _node(xa + w * ex - x0, dx, nx)
        j = _node(ya + w * ey - y0, dy, ny)
        # Where something may be near, as close as ever, and twice as close where that is a limit:
        # no stepping over what is too steep.
        points = 1
        if steep[j, i]:
            points = 2 * finer
        elif mask[j, i] != ALL_YAWS:
            points = finer
        for point in range(points):
            if points > 1:
                w = (k + (point + 0.5) / points) / count
                i = _node(xa + w * ex - x0, dx, nx)
                j = _node(ya + w * ey - y0, dy, ny)
            x, y = xa + w * ex, ya + w * ey
            # The very slope that the finished motion is checked on.
            _, px, py = interpolate(heights, x0, y0, dx, dy, x, y)
            if mask[j, i] == ALL_YAWS and px * px + py * py < safe * safe:
                # Bilinear in the slope along and across the path.
                u = (px * ux + py * uy + reach) * scale
                v = (py * ux - px * uy + reach) * scale
                a, b = int(u), int(v)
                u -= a
                v -= b
                g = grounds[j, i]
                cost = (gentle[g, a, b] * (1.0 - u) + gentle[g, a + 1, b] * u) * (1.0 - v) + (
                    gentle[g, a, b + 1] * (1.0 - u) + gentle[g, a + 1, b + 1] * u
                ) * v
            elif mask[j, i] == ALL_YAWS:
                azimuth = math.atan2(py, px) - direction
                cost = cost_for_best_yaw(
                    best, limit, grounds[j, i], azimuth, math.sqrt(px * px + py * py), margin
                )
                if cost == np.inf:
                    return np.inf
            else:
                if not doubtful:
                    # Masks settle most of what is impassable, much faster than the body's outline.
                    doubtful = True
                    if _masked_out(field, xa, ya, ex, ey, k, count, finer):
                        return np.inf
                cost = _tight_cost(field, j, i, x, y, px, py, direction)
                if cost == np.inf:
                    return np.inf
            if factor.shape[0] > 1:
                cost *= factor[j, i]
            total += max(cost + wind, LEAST_COST) / points
    return total * length / count


@njit(cache=True, error_model="numpy")
def passable(field: Any, x: float, y: float, direction: float) -> bool:
    """Whether a point can be driven over in a direction."""
    ny, nx = field.heights.shape
    i = _node(x - field.x0, field.dx, nx)
    j = _node(y - field.y0, field.dy, ny)
    _, px, py = interpolate(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
    return _tight_cost(field, j, i, x, y, px, py, direction) < np.inf


@njit(cache=True, error_model="numpy", nogil=True)
def polyline_cost(field: Any, points: Any, step: float) -> float:
    """Cost of a polyline (k, 2)."""
    total = 0.0
    for k in range(points.shape[0] - 1):
        total += segment_cost(
            field, points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1], step
        )
    return total
