"""What moves of the grid cost where nodes say little about what lies between them.

    price_closely(field, lattice, j, i, wanted, back)      # several moves at a node; kept
    cost = close_cost(field, j, i, di, dj)                 # one move
    can_be_driven(field, lattice, j, i, m)

Something stands near there, or a limit may be near. On steep ground, one look at the ground prices
a move for all objectives at once.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.compiled_code import njit
from planner.search.field import CostField, masked_cost, segment_cost, wind_cost
from planner.search.resolution import ALL_YAWS, GENTLE, LEAST_COST, MOVES
from planner.search.steady import cost_for_best_yaw
from planner.terrain.interpolation import cubic_weights

FROM_BORDER = 4
"""Nodes from the border on from which all nodes that a move's ground hangs on lie on the map."""


class Points(NamedTuple):
    """Points at which moves on steep ground are priced; the same at every node of a map.

    A move is cut in pieces, and looked at in the middle of each, or at a quarter and three quarters
    of it.
    """

    pieces: NDArray[np.int64]
    """(COUNT,) of each move."""
    nodes: NDArray[np.int64]
    """(COUNT, pieces, 3, 2) columns and rows from the move's node to the first one that the ground
    at a point is interpolated from."""
    weights: NDArray[np.float64]
    """(COUNT, pieces, 3, 4, 4) by axis: weights of four nodes for the height and, in 1/m, for its
    slope, along x and along y."""


class Together(NamedTuple):
    """What moves on steep ground cost for several objectives, whose slope limits are the same.

    Most of a price is the ground's slope at the points of the move.
    """

    best: NDArray[np.float64]
    """(objectives, grounds) as of their cost fields."""
    gentle: NDArray[np.float64]
    """(objectives, grounds, GENTLE, GENTLE) as of their cost fields."""
    close: NDArray[np.float32]
    """(objectives, rows, COUNT) costs of moves priced closely, NaN until they are asked for."""
    points: Points

    @property
    def nbytes(self) -> int:
        """Cached bytes; each lattice counts its own part of ``close``, which it keeps alive."""
        return self.best.nbytes + self.gentle.nbytes


def move_points(field: CostField) -> Points:
    """Points of every move of a field's map, as ``segment_cost`` places them."""
    cell = np.array([field.dx, field.dy])
    lengths = np.hypot(*(MOVES * cell).T)
    count = np.maximum(np.ceil(lengths / field.step).astype(np.int64), 1)
    pieces = np.arange(count.max())[None, :, None]
    shares = (pieces + np.array([0.5, 0.25, 0.75])) / count[:, None, None]
    at = shares[..., None] * MOVES[:, None, None, :]
    before = np.floor(at)
    weights = np.stack(cubic_weights(at - before), axis=-1).reshape(*at.shape, 2, 4)
    weights[..., 1, :] /= cell[:, None]
    nodes = before.astype(np.int64) - 1
    return Points(count, nodes, weights.reshape(*at.shape[:3], 4, 4))


@njit(cache=True, error_model="numpy", inline="always")
def _price_steep(
    field: Any, together: Any, row: int, m: int, j: int, i: int, di: int, dj: int
) -> bool:
    """Price a move on steep ground for all objectives; False where it is not for this to price.

    As ``segment_cost``, in the open, without wind, and inside the map.
    """
    heights, mask, steep = field.heights, field.mask, field.steep
    ny, nx = heights.shape
    if not (steep[j, i] or steep[j + dj, i + di]) or field.extra.any():
        return False
    if min(j, i, ny - 1 - j, nx - 1 - i) < FROM_BORDER:
        return False
    best, gentle, close = together.best, together.gentle, together.close
    nodes, weights = together.points.nodes[m], together.points.weights[m]
    grounds, limit, reach, safe = field.ground, field.limit, field.reach, field.safe
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    x, y = x0 + i * dx, y0 + j * dy
    ex, ey = x + di * dx - x, y + dj * dy - y  # rounded as for a line between two places
    length = math.sqrt(ex * ex + ey * ey)
    direction, scale = math.atan2(ey, ex), 0.5 * (GENTLE - 1) / reach
    ux, uy = ex / length, ey / length
    count = together.points.pieces[m]
    if int(math.ceil(length / field.step)) != count:
        return False  # between these two places, rounding makes it a piece more
    margin, total = field.margin, np.zeros(best.shape[0])
    for k in range(count):
        points, point = 1, 0
        while point < points:
            w = (k + (point + 0.5) / points) / count
            a = int(math.floor((x + w * ex - x0) / dx + 0.5))
            b = int(math.floor((y + w * ey - y0) / dy + 0.5))
            if points == 1 and steep[b, a]:
                points = 2
                continue
            if mask[b, a] != ALL_YAWS:
                return False
            at = point if points == 1 else point + 1
            b, a, g = j + nodes[k, at, 1], i + nodes[k, at, 0], grounds[b, a]
            point += 1
            px, py, w = 0.0, 0.0, weights[k, at]
            for n in range(4):
                h0, h1, h2, h3 = (
                    heights[b + n, a],
                    heights[b + n, a + 1],
                    heights[b + n, a + 2],
                    heights[b + n, a + 3],
                )
                px += w[2, n] * (w[1, 0] * h0 + w[1, 1] * h1 + w[1, 2] * h2 + w[1, 3] * h3)
                py += w[3, n] * (w[0, 0] * h0 + w[0, 1] * h1 + w[0, 2] * h2 + w[0, 3] * h3)
            share = 1.0 / points
            steepness = math.sqrt(px * px + py * py)
            if steepness < safe:
                u = (px * ux + py * uy + reach) * scale
                v = (py * ux - px * uy + reach) * scale
                c, d = int(u), int(v)
                u -= c
                v -= d
                for n in range(total.size):
                    t = gentle[n, g]
                    cost = (t[c, d] * (1.0 - u) + t[c + 1, d] * u) * (1.0 - v)
                    cost += (t[c, d + 1] * (1.0 - u) + t[c + 1, d + 1] * u) * v
                    total[n] += share * max(cost, LEAST_COST)
                continue
            azimuth = math.atan2(py, px) - direction
            for n in range(total.size):
                cost = cost_for_best_yaw(best[n], limit, g, azimuth, steepness, margin)
                if cost == np.inf:
                    close[:, row, m] = np.inf
                    return True
                total[n] += share * max(cost, LEAST_COST)
    for n in range(total.size):
        close[n, row, m] = total[n] * length / count
    return True


@njit(cache=True, error_model="numpy", inline="always")
def price_closely(field: Any, lattice: Any, j: int, i: int, wanted: int, back: int) -> None:
    """Price moves at a node closely, and keep that.

    Several at once: a call with so many arrays takes as long as a price.

    Args:
        field, lattice: map, costs and moves; with room for such prices.
        j, i: the node.
        wanted: bit m is set for each move that is asked for.
        back: moves into the node for -1, out of it for 0.
    """
    row, close, moves = lattice.row, lattice.close, lattice.moves
    for m in range(moves.shape[0]):
        if not wanted >> m & 1:
            continue
        di, dj = moves[m, 0], moves[m, 1]
        b, a = j + back * dj, i + back * di
        if not _price_steep(field, lattice.together, row[b, a], m, b, a, di, dj):
            close[row[b, a], m] = close_cost(field, b, a, di, dj)


@njit(cache=True, error_model="numpy")
def can_be_driven(field: Any, lattice: Any, j: int, i: int, m: int) -> bool:
    """Whether some yaw holds all along move number ``m`` from a node, priced closely."""
    if lattice.row.shape[0] == 1:
        return bool(close_cost(field, j, i, lattice.moves[m, 0], lattice.moves[m, 1]) < np.inf)
    row = lattice.row[j, i]
    if math.isnan(lattice.close[row, m]):
        price_closely(field, lattice, j, i, 1 << m, 0)
    return bool(lattice.close[row, m] < np.inf)


@njit(cache=True, error_model="numpy")
def close_cost(field: Any, j: int, i: int, di: int, dj: int) -> float:
    """Cost of the straight move from node (j, i) by (di, dj); infinity if anything is in the way.

    Slopes are the means of the nodes beside each piece, or those that the finished motion is
    checked on where a limit may be near.
    """
    ny, nx = field.heights.shape
    dx, dy = field.dx, field.dy
    ex, ey = di * dx, dj * dy
    x, y = field.x0 + i * dx, field.y0 + j * dy
    if field.steep[j, i] or field.steep[j + dj, i + di]:
        return segment_cost(field, x, y, x + ex, y + ey, field.step)
    pieces = max(abs(di), abs(dj))
    length = math.sqrt(ex * ex + ey * ey)
    direction = math.atan2(ey, ex)
    ground = field.ground[j, i]
    total = 0.0
    for k in range(pieces):
        u0, v0 = i + di * k / pieces, j + dj * k / pieces
        u1, v1 = i + di * (k + 1) / pieces, j + dj * (k + 1) / pieces
        px, py, mask = 0.0, 0.0, ALL_YAWS
        for u, v in ((u0, v0), (u1, v1)):
            # Off the nodes both neighbours across the move count, for slope and for room.
            a0, b0 = int(math.floor(u)), int(math.floor(v))
            a1, b1 = min(int(math.ceil(u)), nx - 1), min(int(math.ceil(v)), ny - 1)
            for a, b in ((a0, b0), (a1, b1)):
                qx, qy = node_slope(field, b, a)
                px, py = px + 0.25 * qx, py + 0.25 * qy
                mask &= field.mask[b, a]
        if mask == np.uint64(0):
            return np.inf
        steepness = math.sqrt(px * px + py * py)
        azimuth = math.atan2(py, px) - direction
        if mask == ALL_YAWS:
            cost = cost_for_best_yaw(
                field.best, field.limit, ground, azimuth, steepness, field.margin
            )
        else:
            exact = np.bool_(False)
            cost = masked_cost(field, ground, mask, direction, azimuth, steepness, 0.0, 0.0, exact)
        if cost == np.inf:
            return np.inf
        total += max(cost + wind_cost(field, direction), LEAST_COST)
    return total * length / pieces


@njit(cache=True, error_model="numpy", inline="always")
def node_slope(field: Any, j: int, i: int) -> tuple[float, float]:
    """Gradient at a node: central differences, one-sided at the border."""
    ny, nx = field.heights.shape
    west, east = max(i - 1, 0), min(i + 1, nx - 1)
    south, north = max(j - 1, 0), min(j + 1, ny - 1)
    return (
        (field.heights[j, east] - field.heights[j, west]) / ((east - west) * field.dx),
        (field.heights[north, i] - field.heights[south, i]) / ((north - south) * field.dy),
    )
