"""The certified lower bound of a route's energy: a potential that no motion outruns.

    bound = certify(field, around, start, goal, seconds=30.0)
    bound.bound_j                     # J; no motion from start to goal takes less
    bound.how                         # "potential", or "floor" where only planner.search.bound holds

How it comes about, with the proof in docs/lower-bound.md:

    priced_power      what driving leaves of the power once forces are paid for, by price
    prices            at every node, the prices that a good motion would pay there
    triangle_costs    from both, a floor of the cost in every triangle and direction
    potential         the steepest function whose slope stays below it, made exact at the end
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, maximum_filter

from planner.errors import Cancelled
from planner.quantities import INDEX
from planner.search.bound import lower_bound
from planner.search.conditions import Circumstances
from planner.search.cost_to_go import cost_field_to
from planner.search.edge_energy import sample_surface
from planner.search.ground import SPARE, CostField
from planner.search.potential import levelled, steepest_potential, weights_at
from planner.search.priced_power import PricedPower, priced_power
from planner.search.triangle_costs import (
    DIRECTIONS,
    PriceField,
    PriceTable,
    _rotor,
    cell_ranges,
    even_table,
    table_watts,
    triangle_costs,
)

Array = NDArray[np.float64]
SLOPES = 49


_PRICED=priced_power


@dataclass(frozen=True)
class CertifiedBound:
    """A proven bound.

    Attributes:
        bound_j: J that every motion from start to goal takes from the source at least.
        seconds: that it took.
        how: "potential" or "floor".
    """

    bound_j: float
    seconds: float
    how: str


@njit(cache=True, error_model="numpy", nogil=True)
def _best_prices(t: Any, steepest: float, best: Any) -> None:
    """Prices (share, cross) that make the floor largest, by slope along and across the travel."""
    count = best.shape[0]
    for a in range(count):
        for b in range(count):
            along = steepest * (2.0 * a / (count - 1) - 1.0)
            across = steepest * (2.0 * b / (count - 1) - 1.0)
            stretch = math.sqrt(1.0 + along * along)
            normal = math.sqrt(1.0 + along * along + across * across)
            largest = -np.inf
            for i in range(t.watts.shape[0]):
                for j in range(t.watts.shape[1]):
                    share, cross = t.low + i * t.step, t.cross + j * t.cross_step
                    watts = table_watts(t, share, cross, 1.0 / normal)
                    metre = watts * stretch / t.speed + t.weight * (
                        (share - 1.0) * along + cross * across / (normal * stretch)
                    )
                    if metre > largest:
                        largest, best[a, b, 0], best[a, b, 1] = metre, share, cross
                        best[a, b, 2] = metre


def _bilinear(table: Array, a: Array, b: Array) -> Array:
    """Values of a table (n, n, k) at fractional places."""
    last = len(table) - 1
    a, b = np.clip(a, 0.0, last), np.clip(b, 0.0, last)
    i, j = np.minimum(a.astype(int), last - 1), np.minimum(b.astype(int), last - 1)
    u, w = (a - i)[..., None], (b - j)[..., None]
    low = table[i, j] * (1.0 - w) + table[i, j + 1] * w
    high = table[i + 1, j] * (1.0 - w) + table[i + 1, j + 1] * w
    return np.asarray(low * (1.0 - u) + high * u)


def _padded(heights: Array, rings: int) -> Array:
    """Heights with rings of ground that goes on straight, as the interpolation has it."""
    for _ in range(rings):
        heights = np.pad(heights, 1, mode="reflect", reflect_type="odd")
    return heights


def certify(
    field: CostField,
    around: Circumstances,
    start: tuple[float, float],
    goal: tuple[float, float],
    *,
    seconds: float = 30.0,
    smooth: float = 1.0,
    width: float = 10.0,
    spread: float = 0.03,
    trace: Any = None,
) -> CertifiedBound:
    began = time.perf_counter()
    steepest = float(field.limit.max())
    places = np.array([start, goal])
    z, _ = sample_surface(field, places)
    climb = float(z[1] - z[0])
    floor = lower_bound(around, math.dist(start, goal), climb, steepest)
    priced = _PRICED(around, steepest)
    if trace: trace("priced", time.perf_counter() - began)
    if priced is None:
        return CertifiedBound(floor, time.perf_counter() - began, "floor")
    t = even_table(priced)
    dx, dy = field.dx, field.dy
    nodes = _padded(field.heights, 1)
    ranges = cell_ranges(np.ascontiguousarray(_padded(field.heights, 2)), dx, dy)
    origin = (field.x0 - dx, field.y0 - dy)
    best = np.empty((SLOPES, SLOPES, 3))
    _best_prices(t, steepest, best)
    if trace: trace("best", time.perf_counter() - began)
    values = _filled(cost_field_to(field, goal, start, whole=True))
    since = _filled(cost_field_to(field, start, goal, whole=True, onward=True))
    if trace: trace("field", time.perf_counter() - began)
    total = values + since
    excess = total - total.min()
    worth = (1.0 + excess / (spread * total.min())) ** -4.0
    d_y, d_x = np.gradient(gaussian_filter(values, 1.0), dy, dx)
    u_y, u_x = np.gradient(gaussian_filter(since, 1.0), dy, dx)
    # Near the goal the way there is known best from where the robot comes from, and vice versa.
    ex, ey = -d_x * values + u_x * since, -d_y * values + u_y * since
    size = np.maximum(np.hypot(ex, ey), 1e-12)
    ex, ey, worth = (np.pad(f, 1, mode="edge") for f in (ex / size, ey / size, worth))
    values = np.pad(values, 1, mode="reflect", reflect_type="odd")
    slope_y, slope_x = np.gradient(nodes, dy, dx)
    along, across = slope_x * ex + slope_y * ey, slope_y * ex - slope_x * ey
    half = 0.5 * (SLOPES - 1)
    chosen = _bilinear(best[..., :2], (along / steepest + 1) * half, (across / steepest + 1) * half)
    share, cross = chosen[..., 0], chosen[..., 1]
    b1, b2 = -cross * 2.0 * ex * ey, cross * (ex * ex - ey * ey)
    lean = maximum_filter(np.hypot(slope_x, slope_y), size=3)
    # A price that makes a descent earn more than it costs would leave no room for a potential.
    most = 1.0 + np.minimum(0.8 * best[SLOPES // 2, SLOPES // 2, 2] / np.maximum(t.weight * lean, 1e-9), 9.0)
    share = np.minimum(share, most)
    share, b1, b2 = _smoothed((share, b1, b2), worth, smooth, dx, dy)
    share = np.minimum(share, most)
    room = np.maximum(most - share, 0.05) / np.maximum(np.hypot(b1, b2), 1e-9)
    b1, b2 = b1 * np.minimum(1.0, room), b2 * np.minimum(1.0, room)
    factor = around.class_rows[:, INDEX["rolling_factor"]][np.pad(field.ground, 1, mode="edge")]
    rolling = np.stack([factor, factor], axis=2)
    wall = _walls(field, nodes.shape, ranges, 1.02 * steepest)
    costs = np.empty((*ranges.shape[:2], 2, DIRECTIONS))
    for attempt in range(8):
        rotor = np.minimum(1.0, share / (2 - 1 / t.efficiency)) + np.maximum(0.0, share * t.efficiency - 1.0)
        prices = PriceField(share, rotor, b1, b2)
        triangle_costs(t, prices, nodes, ranges, np.ascontiguousarray(rolling), wall, dx, dy, costs)
        bad = (costs.min(axis=3) < 0.03 * np.median(costs[np.isfinite(costs[..., 0])])).any(axis=2)
        if not bad.any(): break
        if trace: trace("bad %d"%bad.sum(), time.perf_counter() - began)
        at = np.zeros(nodes.shape)
        for oy in (0, 1):
            for ox in (0, 1):
                at[oy:oy + bad.shape[0], ox:ox + bad.shape[1]] += bad
        sigma = max(1.0, smooth / dy), max(1.0, smooth / dx)
        near = np.minimum(gaussian_filter((at > 0).astype(float), sigma, mode="nearest") * 4 , 1.0)
        share, b1, b2 = 1.0 + (share - 1.0) * (1.0 - 0.4 * near), b1 * (1.0 - 0.4 * near), b2 * (1.0 - 0.4 * near)
    if trace:
        trace("costs", time.perf_counter() - began)
        c=costs[np.isfinite(costs[...,0])]; trace("cost range %g %g; nonpositive %d of %d"%(c.min(),np.median(c),(c.min(axis=1)<=0).sum(),len(c)),0)
    s_nodes, s_weights, s_tri = weights_at(start, origin, (dx, dy), nodes.shape)
    g_nodes, g_weights, g_tri = weights_at(goal, origin, (dx, dy), nodes.shape)
    weight = t.weight

    def ends(psi):
        top = sum(w * psi[n] for n, w in zip(s_nodes, s_weights))
        bottom = sum(w * psi[n] for n, w in zip(g_nodes, g_weights))
        return top, bottom

    def off(nodes_, weights, height):
        """What the surface at a place differs from its triangle, times the price."""
        mean = sum(nodes[n] for n in nodes_) / 3.0
        mu = sum(w * share[n] for n, w in zip(nodes_, weights))
        even = sum(w * (share[n] - 1) * (nodes[n] - mean) for n, w in zip(nodes_, weights))
        return weight * (even - (mu - 1.0) * (height - mean))
    correction = off(s_nodes, s_weights, z[0]) - off(g_nodes, g_weights, z[1])
    found = [-np.inf]

    def more(psi):
        value = levelled(psi, costs, (dx, dy), *ends(psi)) + correction
        if value > found[0]:
            found[0] = value
        if trace: trace("value %.1f raw %.1f"%(value, ends(psi)[0]-ends(psi)[1]+correction), time.perf_counter() - began)
        return time.perf_counter() - began < seconds
    more(values)
    steepest_potential(costs, values, (dx, dy), (s_nodes, s_weights), (g_nodes, g_weights), width=width*min(dx,dy), rounds=100000, more=more)
    bound = found[0] + weight * climb
    return CertifiedBound(max(bound, floor), time.perf_counter() - began, "potential")


def _filled(values):
    reached = np.isfinite(values)
    if reached.all():
        return values
    nearest = distance_transform_edt(~reached, return_distances=False, return_indices=True)
    return values[tuple(nearest)]


def _smoothed(fields, worth, length, dx, dy):
    """Fields averaged over some length, by worth; where nothing is worth much, from afar."""
    sums = [0.0] * len(fields)
    weights = 0.0
    for scale, share in ((1.0, 1.0), (2.5, 0.1), (6.0, 0.01)):
        sigma = max(1.0, scale * length / dy), max(1.0, scale * length / dx)
        if min(sigma) > 2 * max(worth.shape): break
        weights = weights + share * gaussian_filter(worth, sigma, mode="nearest")
        sums = [a + share * gaussian_filter(worth * f, sigma, mode="nearest") for a, f in zip(sums, fields)]
    return [a / weights for a in sums]


def _walls(field, shape, ranges, steepest):
    near = [np.where(r0 * r1 <= 0, 0.0, np.minimum(abs(r0), abs(r1))) for r0, r1 in ((ranges[..., 0], ranges[..., 1]), (ranges[..., 2], ranges[..., 3]))]
    wall = np.hypot(*near) > steepest
    blocked = np.pad(field.blocked, 1, constant_values=False)
    dx, dy = field.dx, field.dy
    apart = distance_transform_edt(~blocked, sampling=(dy, dx)) if blocked.any() else np.full(shape, np.inf)
    inner = min(field.half_length, field.half_width) - SPARE
    reach = math.hypot(dx, dy)
    within = apart - 0.5 * min(dx, dy) + reach <= inner
    out = np.stack([wall, wall], axis=2)
    # any vertex of the triangle near enough
    out[..., 0] |= within[:-1, :-1] | within[:-1, 1:] | within[1:, :-1]
    out[..., 1] |= within[1:, 1:] | within[:-1, 1:] | within[1:, :-1]
    return out
