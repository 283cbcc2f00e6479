"""The certified lower bound of a route's energy: a potential that no motion outruns.

    bound = certify(field, conditions, start, goal, seconds=30.0)
    bound.bound_j                     # J; no motion from start to goal takes less
    bound.how                         # "potential", or "floor": that of quick_bound

Its parts, with the proof in docs/lower-bound.md:

    dual_power        the power left of driving once forces are paid for, by price
    multipliers       at every node, the prices that a good motion would pay there
    triangle_costs    from both, a floor of the cost in every triangle and direction
    potential         the steepest function whose slope stays below it, made exact at the end
    start_and_stop    the idle power of slow motion near both ends

With little time the table is coarser and nodes are left out; the bound stays valid.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from planner.arrays import Array
from planner.cache import CACHE
from planner.cancellation import CancellationToken
from planner.search.certificate.dual_power import PricedPower, priced_power, slower_power
from planner.search.certificate.mesh import Mesh, coarse_field, mesh_of
from planner.search.certificate.multipliers import (
    BestPrices,
    best_prices,
    filled,
    force_multipliers,
    milder,
    travel,
)
from planner.search.certificate.potential import halves, levelled, steepest_potential, weights_at
from planner.search.certificate.price_table import PriceField, PriceTable, even_table, even_watts
from planner.search.certificate.quick_bound import lower_bound
from planner.search.certificate.start_and_stop import SPEED_PARTS, StartAndStop
from planner.search.certificate.triangle_costs import DIRECTIONS, no_ramp, triangle_costs
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, sample_surface
from planner.search.grid import CostToGo, build_lattice, cost_to_go
from planner.search.second_core import CORE

Place = tuple[float, float]

FAST_SECONDS = 10.0
"""s below which tables and grid are coarser, and start and stop do not count: their tables alone
take 4 s."""
MOST_NODES = {True: 30_000, False: 250_000}
"""Nodes of the grid at most, when fast and otherwise: with more, too few rounds fit in the time."""
YAW_STEPS = {True: 160, False: 360}
"""Steps of the yaw angle in half a turn in the table at full speed, when fast and otherwise."""
SLOW_YAW_STEPS = 240
"""Steps of the yaw angle in half a turn in the tables below full speed."""
TOO_STEEP = 1.02
"""Share of the largest slope that can be driven, from which ground counts as a wall."""
SETTLED_LOOKS = 4
"""Looks at the potential without a gain of one part in ten thousand, after which it is done."""
STRETCHES = (3.0, 1.2)
"""Lengths over which prices are averaged, tried in turn, in lengths of driving that cost as much as
the robot's kinetic energy. Changing prices cost, and so do prices of other slopes."""
PRICE_ROUNDS = 12
"""Rounds of prices against flows at most."""
LEAST_FLOW = 0.02
"""Share of the largest flow from which its direction is that of travel."""
LEAST_COST = 0.03
"""Share of the median cost below which a triangle's prices are made milder."""


@dataclass(frozen=True)
class CertifiedBound:
    """A bound by the proof in docs/lower-bound.md, one step of which rests on a grid and a reserve.

    Attributes:
        bound_j: J that every motion from start to goal takes from the source at least.
        seconds: that it took.
        how: "potential" or "floor".
    """

    bound_j: float
    seconds: float
    how: str


@dataclass(frozen=True)
class Tables:
    """The tables of a model: at full speed, and at SPEED_PARTS of it."""

    full: PriceTable
    slower: Array
    acceleration: float

    @property
    def nbytes(self) -> int:
        """Memory that the cache counts."""
        return self.full.watts.nbytes + self.full.standing.nbytes + self.slower.nbytes


def tables_of(conditions: OperatingConditions, steepest: float, fast: bool) -> Tables | None:
    """The tables of a model; None where the bound cannot follow it."""
    return CACHE.get(
        ("bound tables", conditions.key, steepest, fast),
        lambda: _worked_out(priced_power(conditions, steepest, turns=YAW_STEPS[fast]), fast),
    )


def _worked_out(priced: PricedPower | None, fast: bool) -> Tables | None:
    if priced is None or not priced.centred:
        return None
    full, slower = even_table(priced), np.zeros((0, 2, 2, 2))
    if not fast:
        slow = slower_power(priced, SPEED_PARTS, turns=SLOW_YAW_STEPS)
        on_grid = [even_watts(priced, slow.shares, slow.cross, watts) for watts in slow.watts]
        slower = np.array(on_grid)
        # Near rest friction may help, and then more load takes less.
        heavier = bool((slower[..., 1] >= slower[..., 0]).all())
        full = full._replace(heavier=full.heavier and heavier)
    return Tables(full, slower, priced.acceleration)


def certify(
    field: CostField,
    conditions: OperatingConditions,
    start: Place,
    goal: Place,
    *,
    seconds: float = 30.0,
    token: CancellationToken | None = None,
) -> CertifiedBound:
    """Bound the energy of every motion from start to goal from below.

    Args:
        field: map with the costs of steady driving by energy. They guide the choice of prices
            alone: the bound stays valid where they are wrong.
        conditions: model and conditions.
        start, goal: x, y in the map's frame, m.
        seconds: time to spend; below FAST_SECONDS the grid is coarser.
        token: cancellation.

    Raises:
        Cancelled: the caller cancelled.
    """
    began = time.perf_counter()
    token = token or CancellationToken()

    def check() -> bool:
        token.check()
        return time.perf_counter() - began < seconds

    steepest = float(field.limit.max())
    heights, _ = sample_surface(field, np.array([start, goal]))
    climb = float(heights[1] - heights[0])
    floor = lower_bound(conditions, math.dist(start, goal), climb, steepest)
    fast = seconds < FAST_SECONDS
    tables = None
    if not conditions.wind.any() and steepest > 0.0:
        tables = tables_of(conditions, TOO_STEEP * steepest, fast)
    check()
    if tables is None or start == goal:
        return CertifiedBound(floor, time.perf_counter() - began, "floor")
    table = tables.full
    best = best_prices(table, TOO_STEEP * steepest)
    if not best.level > 0.0:
        return CertifiedBound(floor, time.perf_counter() - began, "floor")
    parts = max(1, math.ceil(math.sqrt(field.heights.size / MOST_NODES[fast])))
    mesh = mesh_of(field, conditions, TOO_STEEP * steepest, parts)
    coarse = coarse_field(field, mesh)
    lattice = build_lattice(coarse)
    guides = CORE.all(
        [
            partial(cost_to_go, coarse, lattice, goal),
            partial(cost_to_go, coarse, lattice, start, from_start=True),
        ]
    )
    check()
    to_goal, from_start = (_everywhere(guide, coarse) for guide in guides)
    direction, worth = travel(to_goal, from_start, mesh.cell)
    ends = [weights_at(p, mesh.origin, mesh.cell, mesh.ground.heights.shape) for p in (start, goal)]
    both = StartAndStop.of(table, tables.slower, tables.acceleration, mesh, (start, goal))
    psi, flow = to_goal, np.zeros((2, *mesh.ground.heights.shape))
    bound, idle, better = -math.inf, 0, STRETCHES[0]
    for game in range(PRICE_ROUNDS):
        stretch = STRETCHES[game] if game < len(STRETCHES) else better
        prices = force_multipliers(table, best, mesh.ground, direction, worth, stretch)
        steady = _costs(table, best, prices, mesh, check)
        if steady is None:
            break
        costs, prices = steady
        gain = 0.0
        if not fast:
            least = LEAST_COST * _median(costs)
            costs, gain = both.paid(prices, costs, direction, least)
        beside = [
            _beside(table, prices, mesh.ground.heights, *end, float(z))
            for end, z in zip(ends, heights, strict=True)
        ]
        found, psi, now = _potential(costs, psi, mesh.cell, ends, check)
        value = found + gain + beside[0] - beside[1] + table.robot.weight * climb
        idle = 0 if value > bound + 1e-3 * abs(bound) else idle + 1
        if value > bound:
            bound, better = value, stretch
        if idle == 2 or not check():
            break
        if game + 1 < len(STRETCHES):
            continue
        # Prices answer the mean of all flows so far, which answer prices in turn: fictitious play.
        flow += (now - flow) / (game + 2.0 - len(STRETCHES))
        size = np.hypot(*flow)
        seen = size / max(float(size.max()), 1e-12)
        direction = np.where(seen > LEAST_FLOW, flow / np.maximum(size, 1e-12), direction)
        worth = np.maximum(worth, seen)
    if bound == -math.inf:
        return CertifiedBound(floor, time.perf_counter() - began, "floor")
    return CertifiedBound(max(bound, floor), time.perf_counter() - began, "potential")


def _costs(
    table: PriceTable,
    best: BestPrices,
    prices: PriceField,
    mesh: Mesh,
    check: Callable[[], bool],
) -> tuple[Array, PriceField] | None:
    """Costs of all triangles, above zero, and the prices that they hold for; None without any."""
    costs = np.empty((*mesh.ground.wall.shape[:2], 2, DIRECTIONS))
    for _ in range(8):
        CORE.all(
            [
                partial(
                    triangle_costs,
                    table,
                    PriceField(*(f[nodes] for f in prices)),
                    no_ramp(mesh.ground.heights[nodes].shape),
                    mesh.ground.part(nodes, cells),
                    costs[cells],
                )
                for nodes, cells in halves(len(costs))
            ]
        )
        open_ground = np.isfinite(costs[..., 0])
        if not open_ground.any():
            return None
        bad = (costs.min(axis=3) < LEAST_COST * _median(costs)).any(axis=2)
        if not bad.any() or not check():
            break
        prices = milder(table, prices, bad, best.level, mesh.cell)
    # Where a cost is not above zero, slowing the potential down would not make it admissible.
    return (costs, prices) if costs[open_ground].min() > 0.0 else None


def _median(costs: Array) -> float:
    """J/m of all open triangles and directions."""
    return float(np.median(costs[np.isfinite(costs[..., 0])]))


def _potential(
    costs: Array,
    psi: Array,
    cell: Place,
    ends: list[tuple[list[tuple[int, int]], list[float]]],
    check: Callable[[], bool],
) -> tuple[float, Array, Array]:
    """J that the best potential falls by, that potential, and its flow."""
    history: list[float] = []

    def more(psi: Array) -> bool:
        top, bottom = (sum(w * float(psi[n]) for n, w in zip(*end, strict=True)) for end in ends)
        found = levelled(psi, costs, cell, top, bottom)
        history.append(max(found, history[-1]) if history else found)
        before = history[-1 - SETTLED_LOOKS] if len(history) > SETTLED_LOOKS else -math.inf
        return check() and found - before >= 1e-4 * abs(found)

    flow = np.zeros((2, *psi.shape))
    if more(psi):
        psi, flow = steepest_potential(costs, psi, cell, *ends, more=more)
    return history[-1], psi, flow


def _beside(
    t: PriceTable,
    prices: PriceField,
    heights: Array,
    nodes: list[tuple[int, int]],
    weights: list[float],
    height: float,
) -> float:
    """J by which the price times the ground's height differs from its triangle's at a place."""
    mean = sum(float(heights[n]) for n in nodes) / 3.0
    pairs = list(zip(nodes, weights, strict=True))
    share = sum(w * float(prices.share[n]) for n, w in pairs)
    even = sum(w * (float(prices.share[n]) - 1.0) * (float(heights[n]) - mean) for n, w in pairs)
    return t.robot.weight * (even - (share - 1.0) * (height - mean))


def _everywhere(guide: CostToGo, field: CostField) -> Array:
    """Costs of a guide (ny, nx), finite where there is no path as well."""
    values = guide.values.astype(float)
    if np.isfinite(values).any():
        return filled(values)
    # A place in a passage that lies between the nodes: as the crow flies.
    ny, nx = values.shape
    x = field.x0 + field.dx * np.arange(nx) - guide.goal[0]
    y = field.y0 + field.dy * np.arange(ny) - guide.goal[1]
    return np.asarray(np.hypot(x[None, :], y[:, None]))
