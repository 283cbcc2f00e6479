"""A proven floor of the cost of driving through each triangle of a map, by direction.

Every cell of the grid is cut in two triangles. In each, the riding surface (planner.terrain.
interpolation) is a bicubic polynomial, whose heights and slopes stay between their Bernstein
coefficients. With multipliers that are linear on the triangle (``PriceField``), the table of
dual_power, and what start and stop ask for (``Ramp``), the compiled loops here find for each of
DIRECTIONS unit vectors e

    costs[j, i, half, k] ≤ J dissipated per horizontal metre along e, anywhere in the triangle,

less what may happen between two of the directions: a gradient g with -g·e ≤ costs for all of them
keeps to it for every direction. Infinity marks triangles where the robot cannot be.
docs/lower-bound.md has the inequalities.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.certificate.price_table import (
    PriceField,
    least_at_rest,
    rotor_price,
    table_watts,
)

DIRECTIONS = 48
"""Directions of travel in which a triangle is priced: between two of them a slope may exceed its
cost by a part in 470."""
LENGTHENING = 0.545
"""Largest sin a·(1 + cos² a)/2."""


class Ground(NamedTuple):
    """Nodes and cells of a grid of triangles.

    Attributes:
        heights: (ny, nx) m at the nodes.
        ranges: (ny - 1, nx - 1, 6) slopes and heights of the cells.
        rolling: (ny, nx, 2) least and largest rolling factor round each node.
        wall: (ny - 1, nx - 1, 2) triangles where the robot cannot be.
        dx, dy: m.
        steepest: largest tan(slope) that is driven; steeper points do not count.
    """

    heights: Array
    ranges: Array
    rolling: Array
    wall: NDArray[np.bool_]
    dx: float
    dy: float
    steepest: float

    def part(self, nodes: Any, cells: Any) -> Ground:
        """A part of the grid, given as slices of nodes and of cells."""
        arrays = (self.heights[nodes], self.ranges[cells], self.rolling[nodes], self.wall[cells])
        heights, ranges, rolling, wall = (np.ascontiguousarray(values) for values in arrays)
        return Ground(heights, ranges, rolling, wall, self.dx, self.dy, self.steepest)


class Ramp(NamedTuple):
    """Demands of one end on the triangles round it; start_and_stop chooses them.

    Attributes:
        sign: 1 at the start, -1 at the goal.
        place: (ny, nx) from 0 to 1, at the nodes.
        watts: (parts, a, b, 2) the table at the speeds ``parts``, shares of full speed.
        held: (parts - 1,) W between two parts.
        fall: (parts,) J.
    """

    sign: float
    place: Array
    watts: Array
    parts: Array
    held: Array
    fall: Array


def no_ramp(shape: tuple[int, ...]) -> Ramp:
    """No demands anywhere on the nodes."""
    none = np.zeros(0)
    return Ramp(1.0, np.zeros(shape), np.zeros((0, 2, 2, 2)), none, none, none)


class Slopes(NamedTuple):
    """Ranges of one cell.

    Attributes:
        x0, x1, y0, y1: least and largest slope along x and y, as far as it is driven.
        z0, z1: m, least and largest height.
        steep: largest slope.
        stretch: largest length of a horizontal metre along the ground.
        most_cosine: of the gentlest slope.
    """

    x0: float
    x1: float
    y0: float
    y1: float
    z0: float
    z1: float
    steep: float
    stretch: float
    most_cosine: float


class Corners(NamedTuple):
    """Multipliers and loads at the three nodes of a triangle, and their gradients.

    The right angle comes first, then its neighbours along x and along y.

    Attributes:
        share, rotor, b1, b2: (3,) of the PriceField.
        place: (3,) of the Ramp.
        gradients: (5, 2) change of these per metre along x and y.
        lift: (2,) J/m, gradient of what prices times heights add.
        off: N, most that heights between the nodes may add to that.
        low, high: least and largest load.
    """

    share: Array
    rotor: Array
    b1: Array
    b2: Array
    place: Array
    gradients: Array
    lift: Array
    off: float
    low: float
    high: float


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
def cell_ranges(heights: Any, dx: float, dy: float) -> Any:
    """Least and largest slope along x and y and height of every cell, (ny - 3, nx - 3, 6).

    ``heights`` has one ring more than the cells' nodes on every side.
    """
    ny, nx = heights.shape
    out = np.empty((ny - 3, nx - 3, 6))
    b = np.empty((4, 4))
    for j in range(ny - 3):
        for i in range(nx - 3):
            _bezier(heights, j + 1, i + 1, b)
            r = out[j, i]
            r[0], r[1], r[2], r[3], r[4], r[5] = np.inf, -np.inf, np.inf, -np.inf, np.inf, -np.inf
            for m in range(4):
                for n in range(4):
                    r[4], r[5] = min(r[4], b[m, n]), max(r[5], b[m, n])
                    if n < 3:
                        slope = 3.0 * (b[m, n + 1] - b[m, n]) / dx
                        r[0], r[1] = min(r[0], slope), max(r[1], slope)
                    if m < 3:
                        slope = 3.0 * (b[m + 1, n] - b[m, n]) / dy
                        r[2], r[3] = min(r[2], slope), max(r[3], slope)
    return out


@njit(cache=True, error_model="numpy")
def _slopes(r: Any, steepest: float) -> Slopes:
    x0, x1 = min(max(r[0], -steepest), steepest), min(max(r[1], -steepest), steepest)
    y0, y1 = min(max(r[2], -steepest), steepest), min(max(r[3], -steepest), steepest)
    far_x, far_y = max(abs(x0), abs(x1)), max(abs(y0), abs(y1))
    near_x = 0.0 if x0 * x1 <= 0.0 else min(abs(x0), abs(x1))
    near_y = 0.0 if y0 * y1 <= 0.0 else min(abs(y0), abs(y1))
    steep = min(math.hypot(far_x, far_y), steepest)
    near = min(math.hypot(near_x, near_y), steepest)
    stretch, most_cosine = math.sqrt(1.0 + steep * steep), 1.0 / math.sqrt(1.0 + near * near)
    return Slopes(x0, x1, y0, y1, r[4], r[5], steep, stretch, most_cosine)


@njit(cache=True, error_model="numpy")
def _corners(
    t: Any,
    prices: PriceField,
    place: Any,
    ground: Ground,
    slopes: Slopes,
    j: int,
    i: int,
    half: int,
) -> Corners:
    """Multipliers and loads of a triangle."""
    side = 1 - 2 * half
    nodes = ((j + half, i + half), (j + half, i + half + side), (j + half + side, i + half))
    values = np.empty((5, 3))
    heights, rolling = ground.heights, ground.rolling
    low, high, z = np.inf, 0.0, 0.0
    for n in range(3):
        q = nodes[n]
        low, high = min(low, rolling[q][0]), max(high, rolling[q][1])
        z += heights[q] / 3.0
        values[0, n], values[1, n] = prices.share[q], prices.rotor[q]
        values[2, n], values[3, n], values[4, n] = prices.b1[q], prices.b2[q], place[q]
    # Under every point lies the cell of one of the four corners.
    other = rolling[j + 1 - half, i + 1 - half]
    low, high = min(low, other[0]) * (1.0 / slopes.stretch), max(high, other[1])
    gx, gy = 1.0 / (ground.dx * side), 1.0 / (ground.dy * side)
    gradients, lift = np.empty((5, 2)), np.empty(2)
    for n in range(5):
        gradients[n, 0] = (values[n, 1] - values[n, 0]) * gx
        gradients[n, 1] = (values[n, 2] - values[n, 0]) * gy
    share = values[0]
    lift0 = (share[0] - 1.0) * (heights[nodes[0]] - z)
    lift_x = (share[1] - 1.0) * (heights[nodes[1]] - z) - lift0
    lift_y = (share[2] - 1.0) * (heights[nodes[2]] - z) - lift0
    mg = t.robot.weight
    lift[0], lift[1] = mg * lift_x * gx, mg * lift_y * gy
    off = mg * max(slopes.z1 - z, z - slopes.z0)
    return Corners(
        *(share, values[1], values[2], values[3], values[4]),
        *(gradients, lift, off, low, high * slopes.most_cosine),
    )


@njit(cache=True, error_model="numpy", inline="always")
def _least_watts(
    t: Any, watts: Any, share: float, cross: float, low: float, high: float, stretch: float
) -> float:
    """Least of a table over loads and stretches."""
    value: float = np.inf
    for load in (low, high):
        for part in (1.0, stretch):
            value = min(value, table_watts(t, watts, share, cross / part, load))
            if cross == 0.0:
                break
        if t.heavier:
            break
    return value


@njit(cache=True, error_model="numpy")
def _ramp_watts(
    t: Any,
    ramp: Ramp,
    corners: Corners,
    slopes: Slopes,
    prices: Any,
    place: float,
    ramp_slope: float,
    change: float,
    standing: float,
) -> float:
    """W at full speed at most for which start and stop are paid for.

    Args:
        t, ramp, corners, slopes: of the triangle.
        prices: along and across the travel, W by which the rotors' price is off, W at full speed.
        place: of the ramp, at the node.
        onward: its change with a metre of travel, times the ramp's sign.
        change: W at most that falling prices earn at full speed; with the third power of speed.
        standing: W left at rest.
    """
    share, cross, off, steady = prices
    parts, fall, v = ramp.parts, ramp.fall, t.robot.speed
    found: float = np.inf
    for k in range(parts.shape[0] - 1):
        if fall[k] == 0.0:
            break
        # The third power lies below its chord.
        bend = 0.75 * parts[k + 1] * (parts[k + 1] - parts[k]) ** 2
        for end in (k, k + 1):
            part = parts[end]
            watts = _least_watts(
                t, ramp.watts[end], share, cross, corners.low, corners.high, slopes.stretch
            )
            watts = max(watts - off * part, part * steady + (1.0 - part) * standing)
            watts -= change * (part - part**3 + bend) + place * ramp.held[k]
            if part == 0.0:
                if watts < 0.0:
                    return -np.inf
                continue
            metre = watts / (part * v) * (1.0 if watts >= 0.0 else slopes.stretch)
            metre += ramp_slope * (fall[end] if ramp_slope > 0.0 else fall[k])
            found = min(found, metre)
    return float(v * found)


@njit(cache=True, error_model="numpy")
def _watts(
    t: Any, ramp: Ramp, corners: Corners, slopes: Slopes, earning: float, standing: float, out: Any
) -> None:
    """Least W of a triangle at every direction, and between it and the next one, into (2, k)."""
    count = out.shape[1]
    step = 2.0 * math.pi / count
    robot, place, on = t.robot, corners.place, corners.gradients[4]
    ramped = place[0] != 0.0 or place[1] != 0.0 or place[2] != 0.0
    for middle in range(2):
        # Between two directions the prices run on an arc; the corner outside it.
        outer = 1.0 / math.cos(step) if middle else 1.0
        # Opposite directions see the same prices, but not the same way from the start.
        for k in range(count if ramped else count // 2):
            angle = (k + 0.5 * middle) * step
            c2, s2 = math.cos(2.0 * angle), math.sin(2.0 * angle)
            ex, ey = math.cos(angle), math.sin(angle)
            least = np.inf
            for n in range(3):
                share, rotor = corners.share[n], corners.rotor[n]
                b1, b2 = corners.b1[n] * outer, corners.b2[n] * outer
                along, across = b1 * c2 + b2 * s2, b2 * c2 - b1 * s2
                watts = _least_watts(
                    t, t.watts, share + along, across, corners.low, corners.high, slopes.stretch
                )
                # The rotors' price in the table belongs to the price along this very direction.
                off = abs(
                    rotor_price(share + along, robot.efficiency) - rotor - robot.efficiency * along
                )
                watts -= robot.rotor_slack * off
                least = min(least, watts)
                if ramped:
                    known = share + along, across, robot.rotor_slack * off, watts
                    ramp_slope = ramp.sign * (on[0] * ex + on[1] * ey)
                    asked = _ramp_watts(
                        t, ramp, corners, slopes, known, place[n], ramp_slope, earning, standing
                    )
                    least = min(least, asked)
            out[middle, k] = least
            if not ramped:
                out[middle, k + count // 2] = least


@njit(cache=True, error_model="numpy")
def _taken(v: float, change: float, standing: float) -> float:
    """W that changing prices take from moving mass, of ``change``, W for each (m/s)³."""
    taken = 0.5 * v * v * v * change
    if taken >= 0.0:
        return taken
    # Slow motion earns less from falling prices: a tangent stands in for it.
    earned = -taken
    if 2.0 * earned > standing:
        at = (standing / (2.0 * earned)) ** (1.0 / 3.0)
        earned = 3.0 * earned * at * at - standing
    return -earned


@njit(cache=True, error_model="numpy")
def _fill_triangle(
    t: Any, ramp: Ramp, corners: Corners, slopes: Slopes, watts: Any, cost: Any
) -> None:
    """Costs (DIRECTIONS,) of one triangle; ``watts`` (2, DIRECTIONS) is scratch."""
    count = cost.shape[0]
    step = 2.0 * math.pi / count
    robot, g, lift = t.robot, corners.gradients, corners.lift
    v, mg = robot.speed, robot.weight
    both = robot.moving + robot.efficiency * robot.rotors
    standing, most_b = np.inf, 0.0
    for n in range(3):
        size = math.hypot(corners.b1[n], corners.b2[n])
        most_b = max(most_b, size)
        standing = min(standing, least_at_rest(t, corners.share[n], size))
    if standing < 0.0:
        # Slow motion could beat these prices: they are of no use here.
        cost[:] = -1.0
        return
    by_share, by_rotor = math.hypot(g[0, 0], g[0, 1]), math.hypot(g[1, 0], g[1, 1])
    by_b = math.hypot(g[2, 0], g[2, 1]) + math.hypot(g[3, 0], g[3, 1])
    # W that changing prices may earn at full speed in any direction.
    earning = robot.moving * by_share + robot.rotors * by_rotor + both * by_b
    earning *= 0.5 * v**3
    _watts(t, ramp, corners, slopes, earning, standing, watts)
    at, between = watts[0], watts[1]
    # Bending of the other terms between two directions.
    bend = mg * most_b * slopes.steep * 9.0 + 0.5 * v * v * 9.0 * both * by_b
    bend += math.hypot(lift[0], lift[1]) + corners.off * by_share
    bend += 0.5 * v * v * (robot.moving * by_share + robot.rotors * by_rotor)
    if ramp.fall.shape[0]:
        bend += ramp.fall[0] * math.hypot(g[4, 0], g[4, 1])
    bent = step * step / 8.0 * bend
    for k in range(count):
        angle = k * step
        ex, ey = math.cos(angle), math.sin(angle)
        c2, s2 = math.cos(2.0 * angle), math.sin(2.0 * angle)
        least = at[k]
        for turn in (-1, 0):
            m = (k + turn) % count
            a, b = at[m], at[(m + 1) % count]
            short = max(0.0, 0.5 * (a + b) - between[m]) + 0.02 * abs(a - b)
            least = min(least, at[k] - short)
        change = robot.moving * (ex * g[0, 0] + ey * g[0, 1])
        change += robot.rotors * (ex * g[1, 0] + ey * g[1, 1])
        change += both * ((ex * g[2, 0] + ey * g[2, 1]) * c2 + (ex * g[3, 0] + ey * g[3, 1]) * s2)
        # The prices' odd part times the slope, at its least in the cell.
        lowest = np.inf
        for n in range(3):
            wx = corners.b1[n] * ex + corners.b2[n] * ey
            wy = corners.b2[n] * ex - corners.b1[n] * ey
            fall = min(wx * slopes.x0, wx * slopes.x1) + min(wy * slopes.y0, wy * slopes.y1)
            lowest = min(lowest, fall)
        metre = least / v * (1.0 if least >= 0.0 else slopes.stretch)
        metre -= _taken(v, change, standing) / v
        metre += mg * (lowest - LENGTHENING * most_b * slopes.steep**3)
        metre += lift[0] * ex + lift[1] * ey - corners.off * abs(g[0, 0] * ex + g[0, 1] * ey)
        cost[k] = (metre - bent) * (1.0 - 0.5 * (0.5 * step) ** 2)


@njit(cache=True, error_model="numpy", nogil=True)
def triangle_costs(t: Any, prices: PriceField, ramp: Ramp, ground: Ground, costs: Any) -> None:
    """Fill costs (cells y, cells x, 2, DIRECTIONS); see the module's head.

    Args:
        t: PriceTable.
        prices: at the nodes.
        ramp: of one end, or none.
        ground: nodes and cells.
        costs: written.
    """
    watts = np.empty((2, costs.shape[3]))
    for j in range(costs.shape[0]):
        for i in range(costs.shape[1]):
            slopes = _slopes(ground.ranges[j, i], ground.steepest)
            for half in range(2):
                if ground.wall[j, i, half]:
                    costs[j, i, half, :] = np.inf
                    continue
                corners = _corners(t, prices, ramp.place, ground, slopes, j, i, half)
                _fill_triangle(t, ramp, corners, slopes, watts, costs[j, i, half])
