"""Where the robot's body fits: an oriented rectangle among blocked cells (Terrain.blocked_cells).

Everything beyond the border counts as blocked.

The body is a rectangle of half length a and half width b, centre (x, y), yaw psi (its long axis at
psi from +x). Rectangle and cell square are apart if and only if their projections are apart on one
of four axes, the cell's two and the rectangle's two (separating-axis theorem for convex bodies).
Contact counts as free up to a micrometre, so that a wall on a cell's border leaves the full aisle.

One test answers for a short motion as well (`motion_free`): an axis that parts both at its ends
parts them on the way, but for the little by which points leave straight lines as the body turns.
What a rectangle sweeps without turning is a hexagon, whose third axis is across the motion.

`yaw_mask` answers for all cell centres and yaw bins at once. Seen from a cell's centre, which
neighbours a rectangle covers does not depend on the cell: the table of these bits is made once and
stamped round each blocked cell. Only the rim of a blocked region is stamped: a rectangle whose
centre is on free ground cannot reach the inside of a region without covering part of its rim.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree, SIGGRAPH 1996, doi:10.1145/237170.237244
(the separating-axis test). Left out: overhangs (an obstacle blocks at every height), ground
clearance between the wheels, the body's tilt, which shortens its outline by 4 % at 16 degrees.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.compiled_code import njit

# Overlap below this counts as contact, m.
CONTACT = 1e-6
MOST_YAW_BINS = 64
"""Yaws of one mask, which holds one bit for each in 64."""


@njit(cache=True, inline="always")
def _covers(
    centre: tuple[float, float],
    half_cell: tuple[float, float],
    heading: tuple[float, float],
    half_body: tuple[float, float],
) -> bool:
    """Whether a rectangle covers part of a cell.

    Args:
        centre: of the cell, m east and north of the rectangle's.
        half_cell: half its sides, m.
        heading: cosine and sine of the rectangle's yaw.
        half_body: half its length and width, m.
    """
    (east, north), (half_dx, half_dy) = centre, half_cell
    (cosine, sine), (half_length, half_width) = heading, half_body
    c, s = abs(cosine), abs(sine)
    if abs(east) >= half_dx + half_length * c + half_width * s - CONTACT:
        return False
    if abs(north) >= half_dy + half_length * s + half_width * c - CONTACT:
        return False
    if abs(east * cosine + north * sine) >= half_length + half_dx * c + half_dy * s - CONTACT:
        return False
    return abs(north * cosine - east * sine) < half_width + half_dx * s + half_dy * c - CONTACT


@njit(cache=True, inline="always")
def _beside(first: float, last: float, reach_first: float, reach_last: float) -> bool:
    """Whether one thing stays on one side of another, from how far it is off at both ends."""
    return (first >= reach_first and last >= reach_last) or (
        -first >= reach_first and -last >= reach_last
    )


@njit(cache=True, inline="always")
def _may_meet(
    centre: tuple[float, float],
    half_cell: tuple[float, float],
    first: tuple[float, float],
    last: tuple[float, float],
    half_body: tuple[float, float],
    half_move: tuple[float, float],
    slack: tuple[float, float],
) -> bool:
    """Whether a rectangle that moves straight and turns evenly may meet a cell.

    It does not where one axis parts them at both ends by more than what lies between may bulge:
    along the cell's sides and across the way, points of the body leave the lines between their
    ends; along the body's sides, the cell's corners do, as the body sees them.

    Args:
        centre: of the cell, m east and north of the middle of the way.
        half_cell: half its sides, m.
        first, last: cosine and sine of the yaw at both ends.
        half_body: half its length and width, m.
        half_move: half the way, m east and north.
        slack: m that the body's points, and the cell's corners as the body sees them, may bulge.
    """
    (east, north), (half_dx, half_dy) = centre, half_cell
    (half_length, half_width), (move_x, move_y) = half_body, half_move
    (c1, s1), (c2, s2) = first, last
    a1, b1, a2, b2 = abs(c1), abs(s1), abs(c2), abs(s2)
    outer = slack[0] - CONTACT
    reach1 = half_dx + half_length * a1 + half_width * b1 + outer
    reach2 = half_dx + half_length * a2 + half_width * b2 + outer
    if _beside(east + move_x, east - move_x, reach1, reach2):
        return False
    reach1 = half_dy + half_length * b1 + half_width * a1 + outer
    reach2 = half_dy + half_length * b2 + half_width * a2 + outer
    if _beside(north + move_y, north - move_y, reach1, reach2):
        return False
    # The cell from both ends, as the body sees it.
    x1, y1, x2, y2 = east + move_x, north + move_y, east - move_x, north - move_y
    inner = slack[1] - CONTACT
    reach1 = half_length + half_dx * a1 + half_dy * b1 + inner
    reach2 = half_length + half_dx * a2 + half_dy * b2 + inner
    if _beside(x1 * c1 + y1 * s1, x2 * c2 + y2 * s2, reach1, reach2):
        return False
    reach1 = half_width + half_dx * b1 + half_dy * a1 + inner
    reach2 = half_width + half_dx * b2 + half_dy * a2 + inner
    if _beside(y1 * c1 - x1 * s1, y2 * c2 - x2 * s2, reach1, reach2):
        return False
    length = math.sqrt(move_x * move_x + move_y * move_y)
    if length == 0.0:
        return True
    ux, uy = move_x / length, move_y / length
    reach1 = half_length * abs(uy * c1 - ux * s1) + half_width * abs(ux * c1 + uy * s1)
    reach2 = half_length * abs(uy * c2 - ux * s2) + half_width * abs(ux * c2 + uy * s2)
    across = abs(north * ux - east * uy)
    return across < max(reach1, reach2) + half_dx * abs(uy) + half_dy * abs(ux) + outer


@njit(cache=True)
def _cells_within(
    blocked: Any, frame: Any, west: float, east: float, south: float, north: float
) -> tuple[int, int, int, int]:
    """First and last column and row of the cells that a box covers; none if it leaves the map.

    The box is in m. Contact with the map's border is no leaving.
    """
    x0, y0, dx, dy = frame
    ny, nx = blocked.shape
    west, east = (west - x0) / dx, (east - x0) / dx
    south, north = (south - y0) / dy, (north - y0) / dy
    slack_x, slack_y = CONTACT / dx, CONTACT / dy
    # Written so that NaN fails it.
    inside = (
        west >= -0.5 - slack_x
        and east <= nx - 0.5 + slack_x
        and south >= -0.5 - slack_y
        and north <= ny - 0.5 + slack_y
    )
    if not inside:
        return 0, -1, 0, -1
    return (
        max(0, int(math.floor(west + 0.5))),
        min(nx - 1, int(math.floor(east + 0.5))),
        max(0, int(math.floor(south + 0.5))),
        min(ny - 1, int(math.floor(north + 0.5))),
    )


@njit(
    "boolean(boolean[:, ::1], float64, float64, float64, float64, "
    "float64, float64, float64, float64, float64)",
    cache=True,
)
def rectangle_free(
    blocked: NDArray[np.bool_],
    x0: float,
    y0: float,
    dx: float,
    dy: float,
    x: float,
    y: float,
    yaw: float,
    half_length: float,
    half_width: float,
) -> bool:
    """Whether the rectangle covers no blocked cell and stays on the map.

    Args:
        blocked: (ny, nx) bool, row 0 the south row.
        x0, y0: centre of cell [0, 0], m.
        dx, dy: cell size, m.
        x, y: the rectangle's centre, m.
        yaw: direction of its long axis from +x, rad.
        half_length, half_width: half its sides, m, clearance included.

    Returns:
        False for any covered blocked cell, any part beyond the border, any input not finite.
    """
    frame = x0, y0, dx, dy
    heading = math.cos(yaw), math.sin(yaw)
    c, s = abs(heading[0]), abs(heading[1])
    reach_x, reach_y = half_length * c + half_width * s, half_length * s + half_width * c
    first_i, last_i, first_j, last_j = _cells_within(
        blocked, frame, x - reach_x, x + reach_x, y - reach_y, y + reach_y
    )
    half_cell, half_body = (0.5 * dx, 0.5 * dy), (half_length, half_width)
    for j in range(first_j, last_j + 1):
        for i in range(first_i, last_i + 1):
            if blocked[j, i]:
                centre = x0 + i * dx - x, y0 + j * dy - y
                if _covers(centre, half_cell, heading, half_body):
                    return False
    return last_i >= first_i


@njit(cache=True, error_model="numpy")
def motion_free(
    blocked: Any, frame: Any, x: Any, y: Any, yaw: Any, half_body: Any, slack: Any
) -> bool:
    """Whether a rectangle that moves straight and turns evenly covers nothing and stays on the map.

    Where it says so, it is so. It may say no where the rectangle and a cell pass each other within
    ``slack`` or the arc of a corner.

    Args:
        blocked: as for ``rectangle_free``.
        frame: x0, y0, dx, dy of it.
        x, y, yaw: m and rad, of the centre at both ends of the way.
        half_body: half its length and width, m.
        slack: m that points may leave the lines between their ends: those of the body, and those
            of cells as the body sees them.
    """
    x0, y0, dx, dy = frame
    half_length, half_width = half_body
    first = math.cos(yaw[0]), math.sin(yaw[0])
    last = math.cos(yaw[1]), math.sin(yaw[1])
    x1 = half_length * abs(first[0]) + half_width * abs(first[1]) + slack[0]
    x2 = half_length * abs(last[0]) + half_width * abs(last[1]) + slack[0]
    y1 = half_length * abs(first[1]) + half_width * abs(first[0]) + slack[0]
    y2 = half_length * abs(last[1]) + half_width * abs(last[0]) + slack[0]
    first_i, last_i, first_j, last_j = _cells_within(
        *(blocked, frame),
        *(min(x[0] - x1, x[1] - x2), max(x[0] + x1, x[1] + x2)),
        *(min(y[0] - y1, y[1] - y2), max(y[0] + y1, y[1] + y2)),
    )
    middle_x, middle_y = 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])
    half_move = 0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0])
    half_cell = 0.5 * dx, 0.5 * dy
    for j in range(first_j, last_j + 1):
        for i in range(first_i, last_i + 1):
            if blocked[j, i]:
                centre = x0 + i * dx - middle_x, y0 + j * dy - middle_y
                if _may_meet(centre, half_cell, first, last, half_body, half_move, slack):
                    return False
    return bool(last_i >= first_i)


@njit(cache=True, error_model="numpy")
def rim_near(blocked: Any, frame: Any, x: float, y: float, reach: float, rim: Any) -> int:
    """Blocked cells that a rectangle at a free place can meet, whatever its yaw, and their number.

    A rectangle whose centre is free meets the rim of a blocked region before its inside.

    Args:
        blocked, frame: as for ``motion_free``.
        x, y: m, of the place. The map's border is not listed.
        reach: m, half the rectangle's diagonal.
        rim: (k, 2) written: centres of the cells, m east and north of the place; it has room for
            all cells about it.
    """
    x0, y0, dx, dy = frame
    u, v = (x - x0) / dx, (y - y0) / dy
    ny, nx = blocked.shape
    first_i, last_i = max(0, int(u - reach / dx)), min(nx - 1, int(u + reach / dx + 1.0))
    first_j, last_j = max(0, int(v - reach / dy)), min(ny - 1, int(v + reach / dy + 1.0))
    count = 0
    for j in range(first_j, last_j + 1):
        for i in range(first_i, last_i + 1):
            if not blocked[j, i]:
                continue
            if 0 < i < nx - 1 and 0 < j < ny - 1:
                across = blocked[j, i - 1] and blocked[j, i + 1]
                if across and blocked[j - 1, i] and blocked[j + 1, i]:
                    continue
            rim[count, 0], rim[count, 1] = (i - u) * dx, (j - v) * dy
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def clear_of(rim: Any, half_cell: Any, yaw: float, half_body: Any) -> bool:
    """Whether a rectangle covers none of the cells from ``rim_near``."""
    heading = math.cos(yaw), math.sin(yaw)
    for k in range(rim.shape[0]):
        if _covers((rim[k, 0], rim[k, 1]), half_cell, heading, half_body):
            return False
    return True


@njit("uint64[:, ::1](boolean[:, ::1], float64, float64, float64, float64, int64)", cache=True)
def yaw_mask(
    blocked: NDArray[np.bool_],
    dx: float,
    dy: float,
    half_length: float,
    half_width: float,
    n_bins: int,
) -> NDArray[np.uint64]:
    """Free yaws of the rectangle at every cell's centre.

    Args:
        blocked: (ny, nx) bool, C order.
        dx, dy: cell size, m.
        half_length, half_width: half the rectangle's sides, m, clearance included.
        n_bins: number of yaw bins over half a turn, 1 to 64.

    Returns:
        (ny, nx) uint64; bit k is set when yaw k pi / n_bins is free. A rectangle looks the same
        after half a turn, so these are all yaws.

    Raises:
        ValueError: n_bins is out of range.
    """
    if not 1 <= n_bins <= MOST_YAW_BINS:
        raise ValueError("n_bins must lie in 1 .. 64")
    ny, nx = blocked.shape
    radius = math.hypot(half_length, half_width)
    reach_i = int(math.ceil(radius / dx + 0.5))
    reach_j = int(math.ceil(radius / dy + 0.5))
    half_cell, half_body = (0.5 * dx, 0.5 * dy), (half_length, half_width)
    table = np.zeros((2 * reach_j + 1, 2 * reach_i + 1), dtype=np.uint64)
    within_x = np.zeros(nx, dtype=np.uint64)
    within_y = np.zeros(ny, dtype=np.uint64)
    for k in range(n_bins):
        yaw = k * math.pi / n_bins
        cosine, sine = math.cos(yaw), math.sin(yaw)
        bit = np.uint64(1) << np.uint64(k)
        for dj in range(-reach_j, reach_j + 1):
            for di in range(-reach_i, reach_i + 1):
                centre = di * dx, dj * dy
                if _covers(centre, half_cell, (cosine, sine), half_body):
                    table[dj + reach_j, di + reach_i] |= bit
        reach_x = half_length * abs(cosine) + half_width * abs(sine) - CONTACT
        reach_y = half_length * abs(sine) + half_width * abs(cosine) - CONTACT
        for i in range(nx):
            if reach_x <= (i + 0.5) * dx and reach_x <= (nx - 0.5 - i) * dx:
                within_x[i] |= bit
        for j in range(ny):
            if reach_y <= (j + 0.5) * dy and reach_y <= (ny - 0.5 - j) * dy:
                within_y[j] |= bit
    mask = np.empty((ny, nx), dtype=np.uint64)
    for j in range(ny):
        for i in range(nx):
            mask[j, i] = np.uint64(0) if blocked[j, i] else within_x[i] & within_y[j]
    for j in range(ny):
        for i in range(nx):
            if not blocked[j, i]:
                continue
            rim = (
                (j > 0 and not blocked[j - 1, i])
                or (j < ny - 1 and not blocked[j + 1, i])
                or (i > 0 and not blocked[j, i - 1])
                or (i < nx - 1 and not blocked[j, i + 1])
            )
            if not rim:
                continue
            for row in range(max(0, j - reach_j), min(ny, j + reach_j + 1)):
                for column in range(max(0, i - reach_i), min(nx, i + reach_i + 1)):
                    mask[row, column] &= ~table[j - row + reach_j, i - column + reach_i]
    return mask
