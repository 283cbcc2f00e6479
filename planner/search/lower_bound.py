"""The certified lower bound of a route's energy: a potential that no motion outruns.

    bound = certify(field, around, start, goal, seconds=30.0)
    bound.bound_j                     # J; no motion from start to goal takes less
    bound.how                         # "potential", or "floor": planner.search.bound

How it comes about, with the proof in docs/lower-bound.md:

    priced_power      what driving leaves of the power once forces are paid for, by price
    force_prices      at every node, the prices that a good motion would pay there
    triangle_costs    from both, a floor of the cost in every triangle and direction
    potential         the steepest function whose slope stays below it, made exact at the end

With little time the table is coarser and nodes are left out; the bound stays one.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from planner.errors import Cancelled
from planner.quantities import INDEX
from planner.search.bound import lower_bound
from planner.search.conditions import Circumstances
from planner.search.cost_to_go import CostToGo, cost_to_go
from planner.search.edge_energy import sample_surface
from planner.search.force_prices import (
    BestPrices,
    best_prices,
    filled,
    force_prices,
    milder,
    travel,
)
from planner.search.ground import SPARE, CostField
from planner.search.lattice import build_lattice
from planner.search.other_core import CORE
from planner.search.potential import halves, levelled, steepest_potential, weights_at
from planner.search.priced_power import PricedPower, priced_power
from planner.search.triangle_costs import (
    DIRECTIONS,
    PriceField,
    PriceTable,
    cell_ranges,
    even_table,
    triangle_costs,
)

Array = NDArray[np.float64]
Place = tuple[float, float]

HASTE = 5.0
"""s below which table and grid are coarser."""
NODES = {True: 30_000, False: 250_000}
"""Nodes of the grid at most, in haste and at leisure."""
TURNS = {True: 160, False: 360}
"""Steps of the yaw angle in half a turn, likewise."""
TOO_STEEP = 1.02
"""Share of the largest slope that can be driven, from which ground counts as a wall."""
SETTLED = 4
"""Looks at the potential without a gain of one part in ten thousand, after which it is done."""
STRETCHES = (3.0, 1.2)
"""Lengths over which prices are averaged, tried in turn, in metres driven for what the robot's
motion holds: changing prices cost, and so do those of other slopes."""
GAMES = 12
"""Rounds of prices against flows at most."""
FAINT = 0.02
"""Share of the largest flow from which its direction is that of travel."""
LEAST = 0.03
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
class _Mesh:
    """The grid of triangles, with a ring of continued ground round the map.

    Attributes:
        heights: (ny, nx) m at the nodes.
        ranges: (ny - 1, nx - 1, 6) slopes and heights between.
        rolling: (ny, nx, 2) least and largest rolling factor round each node.
        wall: (ny - 1, nx - 1, 2) triangles where the robot cannot be.
        origin, cell: m.
        picked: rows and columns of the map, clipped, that the nodes are.
    """

    heights: Array
    ranges: Array
    rolling: Array
    wall: NDArray[np.bool_]
    origin: Place
    cell: Place
    picked: tuple[NDArray[np.int64], NDArray[np.int64]]


_tables: dict[bytes, PricedPower | None] = {}


def _table(around: Circumstances, steepest: float, turns: int) -> PricedPower | None:
    """The table of a model, kept for the last few of this process."""
    model = around.model
    parts = (model.parameters, model.body, model.wheels, around.class_rows, around.limits)
    named = repr((steepest, turns, [e.slug for e in model.effects], model.kind, model.vehicle))
    key = b"".join(np.ascontiguousarray(p).tobytes() for p in parts) + named.encode()
    if key not in _tables:
        if len(_tables) >= 8:
            _tables.pop(next(iter(_tables)))
        _tables[key] = priced_power(around, steepest, turns=turns)
    return _tables[key]


def certify(
    field: CostField,
    around: Circumstances,
    start: Place,
    goal: Place,
    *,
    seconds: float = 30.0,
    cancelled: Callable[[], bool] | None = None,
) -> CertifiedBound:
    """Bound the energy of every motion from start to goal from below.

    Args:
        field: map with the costs of steady driving by energy, which only guide the choice of
            prices: the bound does not depend on them being right.
        around: model and conditions.
        start, goal: x, y in the map's frame, m.
        seconds: time to spend; below HASTE the grid is coarser.
        cancelled: asked often; True raises Cancelled.

    Raises:
        Cancelled: ``cancelled`` returned True.
    """
    began = time.perf_counter()

    def check() -> bool:
        if cancelled is not None and cancelled():
            raise Cancelled("cancelled by the caller")
        return time.perf_counter() - began < seconds

    steepest = float(field.limit.max())
    heights, _ = sample_surface(field, np.array([start, goal]))
    climb = float(heights[1] - heights[0])
    floor = lower_bound(around, math.dist(start, goal), climb, steepest)
    haste = seconds < HASTE
    priced = None
    if not around.wind.any() and steepest > 0.0:
        priced = _table(around, TOO_STEEP * steepest, TURNS[haste])
    check()
    if priced is None or not priced.centred or start == goal:
        return CertifiedBound(floor, time.perf_counter() - began, "floor")
    table = even_table(priced)
    parts = max(1, math.ceil(math.sqrt(field.heights.size / NODES[haste])))
    mesh = _mesh(field, around, TOO_STEEP * steepest, parts)
    coarse = _coarse(field, mesh)
    lattice = build_lattice(coarse)
    guides = CORE.all(
        [
            partial(cost_to_go, coarse, lattice, goal),
            partial(cost_to_go, coarse, lattice, start, onward=True),
        ]
    )
    check()
    to_goal, from_start = (_everywhere(guide, coarse) for guide in guides)
    direction, worth = travel(to_goal, from_start, mesh.cell)
    best = best_prices(table, TOO_STEEP * steepest)
    ends = [weights_at(p, mesh.origin, mesh.cell, mesh.heights.shape) for p in (start, goal)]
    psi, flow = to_goal, np.zeros((2, *mesh.heights.shape))
    bound, idle, better = -math.inf, 0, STRETCHES[0]
    for game in range(GAMES):
        stretch = STRETCHES[game] if game < len(STRETCHES) else better
        prices = force_prices(
            table, best, mesh.heights, mesh.ranges, direction, worth, mesh.cell, stretch
        )
        costs = _costs(table, best, prices, mesh, check)
        if costs is None:
            break
        tables, priced_at = costs
        beside = [
            _beside(table, priced_at, mesh.heights, *end, float(z))
            for end, z in zip(ends, heights, strict=True)
        ]
        found, psi, now = _potential(tables, psi, mesh.cell, ends, check)
        value = found + beside[0] - beside[1] + table.weight * climb
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
        direction = np.where(seen > FAINT, flow / np.maximum(size, 1e-12), direction)
        worth = np.maximum(worth, seen)
    if bound == -math.inf:
        return CertifiedBound(floor, time.perf_counter() - began, "floor")
    return CertifiedBound(max(bound, floor), time.perf_counter() - began, "potential")


def _costs(
    table: PriceTable,
    best: BestPrices,
    prices: PriceField,
    mesh: _Mesh,
    check: Callable[[], bool],
) -> tuple[Array, PriceField] | None:
    """Costs of all triangles, above zero, and the prices that they hold for; None without any."""
    costs = np.empty((*mesh.ranges.shape[:2], 2, DIRECTIONS))
    for _ in range(8):
        CORE.all(
            [
                partial(
                    triangle_costs,
                    table,
                    PriceField(*(f[nodes] for f in prices)),
                    mesh.heights[nodes],
                    mesh.ranges[cells],
                    mesh.rolling[nodes],
                    mesh.wall[cells],
                    *mesh.cell,
                    best.steepest,
                    costs[cells],
                )
                for nodes, cells in halves(len(costs))
            ]
        )
        open_ground = np.isfinite(costs[..., 0])
        if not open_ground.any():
            return None
        bad = (costs.min(axis=3) < LEAST * float(np.median(costs[open_ground]))).any(axis=2)
        if not bad.any() or not check():
            break
        prices = milder(table, prices, bad, best.level, mesh.cell)
    # Where a cost is not above zero, slowing the potential down would not make it admissible.
    return (costs, prices) if costs[open_ground].min() > 0.0 else None


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
        settled = len(history) > SETTLED and found - history[-1 - SETTLED] < 1e-4 * abs(found)
        return check() and not settled

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
    return t.weight * (even - (share - 1.0) * (height - mean))


def _mesh(field: CostField, around: Circumstances, steepest: float, parts: int) -> _Mesh:
    """Nodes and triangles of a map; ``parts`` cells of the map make one of the mesh."""
    ny, nx = field.heights.shape
    dx, dy = field.dx, field.dy
    # As many rings as make the cells' number a multiple, at least one on every side.
    after = [(-(count + 1)) % parts + 1 for count in (ny, nx)]
    heights = field.heights
    for _ in range(max(*after, 1) + 1):
        heights = np.pad(heights, 1, mode="reflect", reflect_type="odd")
    rings = max(*after, 1) + 1
    inner = heights[rings - 2 : rings + ny + after[0] + 1, rings - 2 : rings + nx + after[1] + 1]
    ranges = cell_ranges(np.ascontiguousarray(inner), dx, dy)
    nodes = inner[1:-1, 1:-1][::parts, ::parts]
    rows = np.clip(np.arange(-1, ny + after[0])[::parts], 0, ny - 1)
    columns = np.clip(np.arange(-1, nx + after[1])[::parts], 0, nx - 1)
    factors = around.class_rows[:, INDEX["rolling_factor"]]
    factor = np.pad(factors[field.ground], ((1, after[0]), (1, after[1])), mode="edge")
    wall = _walls(field, ranges, steepest, after)
    if parts == 1:
        rolling = np.stack([factor, factor], axis=2)
    else:
        rolling = np.empty((*nodes.shape, 2))
        rolling[..., 0], rolling[..., 1] = factor.min(), factor.max()
        blocks = (nodes.shape[0] - 1, parts, nodes.shape[1] - 1, parts)
        split = [ranges[..., k].reshape(blocks) for k in range(6)]
        ranges = np.stack(
            [
                part.min(axis=(1, 3)) if k % 2 == 0 else part.max(axis=(1, 3))
                for k, part in enumerate(split)
            ],
            axis=2,
        )
        solid = wall.all(axis=2).reshape(blocks).min(axis=(1, 3))
        wall = np.stack([solid, solid], axis=2)
    return _Mesh(
        np.ascontiguousarray(nodes),
        np.ascontiguousarray(ranges),
        np.ascontiguousarray(rolling),
        np.ascontiguousarray(wall),
        (field.x0 - dx, field.y0 - dy),
        (dx * parts, dy * parts),
        (rows, columns),
    )


def _coarse(field: CostField, mesh: _Mesh) -> CostField:
    """Map and costs at the nodes of the mesh alone: enough to say where good routes lead."""
    nodes = np.ix_(*mesh.picked)
    return field._replace(
        heights=np.ascontiguousarray(field.heights[nodes]),
        mask=np.ascontiguousarray(field.mask[nodes]),
        blocked=np.ascontiguousarray(field.blocked[nodes]),
        ground=np.ascontiguousarray(field.ground[nodes]),
        steep=np.ascontiguousarray(field.steep[nodes]),
        factor=np.ascontiguousarray(field.factor[nodes]) if field.factor.size > 1 else field.factor,
        x0=mesh.origin[0],
        y0=mesh.origin[1],
        dx=mesh.cell[0],
        dy=mesh.cell[1],
        step=field.step * mesh.cell[0] / field.dx,
    )


def _everywhere(guide: CostToGo, field: CostField) -> Array:
    """Costs of a guide (ny, nx), finite where there is no way as well."""
    values = guide.values.astype(float)
    if np.isfinite(values).any():
        return filled(values)
    # A place in a passage that lies between the nodes: as the crow flies.
    ny, nx = values.shape
    x = field.x0 + field.dx * np.arange(nx) - guide.goal[0]
    y = field.y0 + field.dy * np.arange(ny) - guide.goal[1]
    return np.asarray(np.hypot(x[None, :], y[:, None]))


def _walls(field: CostField, ranges: Array, steepest: float, after: list[int]) -> NDArray[np.bool_]:
    """Triangles (cells y, cells x, 2) that are too steep or too near something everywhere."""
    gentlest = [
        np.where(low * high <= 0.0, 0.0, np.minimum(np.abs(low), np.abs(high)))
        for low, high in ((ranges[..., 0], ranges[..., 1]), (ranges[..., 2], ranges[..., 3]))
    ]
    steep = np.hypot(*gentlest) > steepest
    wall = np.stack([steep, steep], axis=2)
    if not field.blocked.any():
        return wall
    blocked = np.pad(field.blocked, ((1, after[0]), (1, after[1])))
    apart = distance_transform_edt(~blocked, sampling=(field.dy, field.dx))
    # A disc round the centre lies in the body whatever its yaw; one in a cell lies in the cell.
    inner = min(field.half_length, field.half_width) - SPARE + 0.5 * min(field.dx, field.dy)
    within = apart + math.hypot(field.dx, field.dy) <= inner
    corners = within[:-1, :-1], within[:-1, 1:], within[1:, :-1], within[1:, 1:]
    wall[..., 0] |= corners[0] | corners[1] | corners[2]
    wall[..., 1] |= corners[3] | corners[1] | corners[2]
    return wall
