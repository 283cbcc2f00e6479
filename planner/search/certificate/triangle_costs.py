"""A proven floor of the cost of driving through each triangle of a map, by direction.

Every cell of the grid is cut in two triangles. In each, the riding surface (planner.terrain.
interpolation) is a bicubic polynomial, whose heights and slopes stay between their Bernstein
coefficients. With prices of force that are linear on the triangle (``PriceField``), the table of
dual_power, and what start and stop ask for
(ramps), the compiled loops here find for each of DIRECTIONS unit vectors
e

    costs[j, i, half, k] ≤ J dissipated per horizontal metre along e, anywhere in the triangle,

less what may happen between two of the directions: a gradient g with -g·e ≤ costs for all of them
keeps to it for every direction. Infinity marks triangles where the robot cannot be.
docs/lower-bound.md has the inequalities.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from planner.search.certificate.price_table import least_standing, rotor_price, table_watts
from planner.search.certificate.ramps import ramp_cost

DIRECTIONS = 48
LENGTHENING = 0.545
"""Largest sin a·(1 + cos² a)/2."""


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


@njit(cache=True, error_model="numpy", inline="always")
def _vertex_watts(
    t: Any,
    share: float,
    rotor: float,
    b1: float,
    b2: float,
    c2: float,
    s2: float,
    low: float,
    high: float,
    stretch: float,
) -> float:
    """Q at one node for one direction (double angle), the least over loads and stretches."""
    along = b1 * c2 + b2 * s2
    across = b2 * c2 - b1 * s2
    value: float = np.inf
    for load in (low, high):
        for part in (1.0, stretch):
            value = min(value, table_watts(t, share + along, across / part, load))
            if across == 0.0:
                break
        if t.heavier:
            break
    # The rotors' price in the table belongs to the price along this very direction.
    off = abs(rotor_price(share + along, t.efficiency) - rotor - t.efficiency * along)
    value -= t.rotor_slack * off
    return value


@njit(cache=True, error_model="numpy", nogil=True)
def triangle_costs(
    t: Any,
    prices: Any,
    ramp: Any,
    heights: Any,
    ranges: Any,
    rolling: Any,
    wall: Any,
    dx: float,
    dy: float,
    steepest: float,
    costs: Any,
) -> None:
    """Fill costs (cells y, cells x, 2, DIRECTIONS); see the module's head.

    Args:
        t: PriceTable.
        prices: PriceField at the nodes.
        ramp: ramps.Ramp, with ``place`` at the nodes.
        heights: (ny, nx) m at the nodes.
        ranges: (ny - 1, nx - 1, 6) slopes and heights of the cells.
        rolling: (ny, nx, 2) least and largest rolling factor round each node.
        wall: (ny - 1, nx - 1, 2) triangles where the robot cannot be.
        dx, dy: m.
        steepest: largest tan(slope) that is driven; steeper points do not count.
    """
    count = costs.shape[3]
    step = 2.0 * math.pi / count
    v, mg = t.speed, t.weight
    at_k, at_middle = np.empty(count), np.empty(count)
    node = np.empty((3, 2), np.int64)
    r = np.empty(6)
    for j in range(ranges.shape[0]):
        for i in range(ranges.shape[1]):
            for k in range(6):
                r[k] = ranges[j, i, k]
                if k < 4:
                    r[k] = min(max(r[k], -steepest), steepest)
            far_x, far_y = max(abs(r[0]), abs(r[1])), max(abs(r[2]), abs(r[3]))
            near_x = 0.0 if r[0] * r[1] <= 0.0 else min(abs(r[0]), abs(r[1]))
            near_y = 0.0 if r[2] * r[3] <= 0.0 else min(abs(r[2]), abs(r[3]))
            steep = min(math.hypot(far_x, far_y), steepest)
            stretch_most = math.sqrt(1.0 + steep * steep)
            least_cosine = 1.0 / stretch_most
            near = min(math.hypot(near_x, near_y), steepest)
            most_cosine = 1.0 / math.sqrt(1.0 + near * near)
            for half in range(2):
                cost = costs[j, i, half]
                if wall[j, i, half]:
                    cost[:] = np.inf
                    continue
                # Vertices: the right angle first, then its neighbours along x and along y.
                side = 1 - 2 * half
                node[0, 0], node[0, 1] = j + half, i + half
                node[1, 0], node[1, 1] = j + half, i + half + side
                node[2, 0], node[2, 1] = j + half + side, i + half
                low, high = np.inf, 0.0
                z = 0.0
                for n in range(3):
                    low = min(low, rolling[node[n, 0], node[n, 1], 0])
                    high = max(high, rolling[node[n, 0], node[n, 1], 1])
                    z += heights[node[n, 0], node[n, 1]] / 3.0
                # Under every point lies the cell of one of the four corners.
                other = rolling[j + 1 - half, i + 1 - half]
                low, high = min(low, other[0]) * least_cosine, max(high, other[1]) * most_cosine
                a0, a1, a2 = node[0], node[1], node[2]
                gx, gy = 1.0 / (dx * side), 1.0 / (dy * side)
                share = prices.share
                mu_x = (share[a1[0], a1[1]] - share[a0[0], a0[1]]) * gx
                mu_y = (share[a2[0], a2[1]] - share[a0[0], a0[1]]) * gy
                lift0 = (share[a0[0], a0[1]] - 1.0) * (heights[a0[0], a0[1]] - z)
                lift_x = (share[a1[0], a1[1]] - 1.0) * (heights[a1[0], a1[1]] - z) - lift0
                lift_y = (share[a2[0], a2[1]] - 1.0) * (heights[a2[0], a2[1]] - z) - lift0
                lift_x, lift_y = mg * lift_x * gx, mg * lift_y * gy
                off = mg * max(r[5] - z, z - r[4])
                rotor_x = (prices.rotor[a1[0], a1[1]] - prices.rotor[a0[0], a0[1]]) * gx
                rotor_y = (prices.rotor[a2[0], a2[1]] - prices.rotor[a0[0], a0[1]]) * gy
                b1x = (prices.b1[a1[0], a1[1]] - prices.b1[a0[0], a0[1]]) * gx
                b1y = (prices.b1[a2[0], a2[1]] - prices.b1[a0[0], a0[1]]) * gy
                b2x = (prices.b2[a1[0], a1[1]] - prices.b2[a0[0], a0[1]]) * gx
                b2y = (prices.b2[a2[0], a2[1]] - prices.b2[a0[0], a0[1]]) * gy
                both = t.moving + t.efficiency * t.rotors
                standing = np.inf
                most_b = 0.0
                for n in range(3):
                    q0, q1 = node[n, 0], node[n, 1]
                    size = math.hypot(prices.b1[q0, q1], prices.b2[q0, q1])
                    most_b = max(most_b, size)
                    standing = min(standing, least_standing(t, share[q0, q1], size))
                if standing < 0.0:
                    # Slow motion could beat these prices: they are of no use here.
                    cost[:] = -1.0
                    continue
                place = ramp.place
                p0, p1, p2 = place[a0[0], a0[1]], place[a1[0], a1[1]], place[a2[0], a2[1]]
                ramped = p0 != 0.0 or p1 != 0.0 or p2 != 0.0
                on_x, on_y = (p1 - p0) * gx, (p2 - p0) * gy
                # W that changing prices may earn at full speed in any direction.
                earning = (
                    t.moving * math.hypot(mu_x, mu_y)
                    + t.rotors * math.hypot(rotor_x, rotor_y)
                    + both * (math.hypot(b1x, b1y) + math.hypot(b2x, b2y))
                )
                earning *= 0.5 * v**3
                for middle in range(2):
                    # Opposite directions see the same prices, but not the same way from the start.
                    for k in range(count if ramped else count // 2):
                        angle = (k + 0.5 * middle) * step
                        c2, s2 = math.cos(2.0 * angle), math.sin(2.0 * angle)
                        # Between two directions the prices run on an arc; the corner outside it.
                        outer = 1.0 / math.cos(step) if middle else 1.0
                        least = np.inf
                        for n in range(3):
                            q0, q1 = node[n, 0], node[n, 1]
                            b1, b2 = prices.b1[q0, q1] * outer, prices.b2[q0, q1] * outer
                            rotor = prices.rotor[q0, q1]
                            watts = _vertex_watts(
                                t, share[q0, q1], rotor, b1, b2, c2, s2, low, high, stretch_most
                            )
                            least = min(least, watts)
                            if not ramped:
                                continue
                            ex, ey = math.cos(angle), math.sin(angle)
                            along, across = b1 * c2 + b2 * s2, b2 * c2 - b1 * s2
                            metre = ramp_cost(
                                t,
                                ramp,
                                place[q0, q1],
                                ramp.sign * (on_x * ex + on_y * ey),
                                share[q0, q1] + along,
                                across,
                                rotor + t.efficiency * along,
                                low,
                                high,
                                stretch_most,
                                earning,
                                watts,
                                standing,
                                min(ex * r[0], ex * r[1]) + min(ey * r[2], ey * r[3]),
                                max(ex * r[0], ex * r[1]) + max(ey * r[2], ey * r[3]),
                            )
                            least = min(least, v * metre)
                        if middle:
                            at_middle[k] = least
                        else:
                            at_k[k] = least
                        if not ramped:
                            at_k[k + count // 2] = at_k[k]
                            at_middle[k + count // 2] = at_middle[k]
                # Bending of the other terms between two directions.
                bend = mg * most_b * steep * 9.0 + 0.5 * v * v * 9.0 * both * (
                    math.hypot(b1x, b1y) + math.hypot(b2x, b2y)
                )
                bend += math.hypot(lift_x, lift_y) + off * math.hypot(mu_x, mu_y)
                bend += (
                    0.5
                    * v
                    * v
                    * (t.moving * math.hypot(mu_x, mu_y) + t.rotors * math.hypot(rotor_x, rotor_y))
                )
                if ramped:
                    bend += ramp.fall[0] * math.hypot(on_x, on_y)
                    bend += mg * np.abs(ramp.dearer).max() * steep
                bent = step * step / 8.0 * bend
                for k in range(count):
                    angle = k * step
                    ex, ey = math.cos(angle), math.sin(angle)
                    c2, s2 = math.cos(2.0 * angle), math.sin(2.0 * angle)
                    watts = at_k[k]
                    for turn in (-1, 0):
                        m = (k + turn) % count
                        a, b = at_k[m], at_k[(m + 1) % count]
                        short = max(0.0, 0.5 * (a + b) - at_middle[m]) + 0.02 * abs(a - b)
                        watts = min(watts, at_k[k] - short)
                    # What the changing prices take from moving mass, W for each m/s of speed.
                    change = t.moving * (ex * mu_x + ey * mu_y)
                    change += t.rotors * (ex * rotor_x + ey * rotor_y)
                    change += both * ((ex * b1x + ey * b1y) * c2 + (ex * b2x + ey * b2y) * s2)
                    taken = 0.5 * v * v * v * change
                    if taken < 0.0:
                        # Slow motion earns less from falling prices: a tangent stands in for it.
                        earned = -taken
                        if 2.0 * earned > standing:
                            at = (standing / (2.0 * earned)) ** (1.0 / 3.0)
                            earned = 3.0 * earned * at * at - standing
                        taken = -earned
                    # The prices' odd part times the slope, at its least in the cell.
                    wx = 0.0
                    wy = 0.0
                    lowest = np.inf
                    for n in range(3):
                        q0, q1 = node[n, 0], node[n, 1]
                        wx = prices.b1[q0, q1] * ex + prices.b2[q0, q1] * ey
                        wy = prices.b2[q0, q1] * ex - prices.b1[q0, q1] * ey
                        fall = min(wx * r[0], wx * r[1]) + min(wy * r[2], wy * r[3])
                        lowest = min(lowest, fall)
                    metre = watts / v * (1.0 if watts >= 0.0 else stretch_most) - taken / v
                    metre += mg * (lowest - LENGTHENING * most_b * steep**3)
                    metre += lift_x * ex + lift_y * ey - off * abs(mu_x * ex + mu_y * ey)
                    cost[k] = (metre - bent) * (1.0 - 0.5 * (0.5 * step) ** 2)
