"""Search in x, y and yaw at once: ways along which the body can turn in time.

    way = pose_path(situation, field, "energy", (start, yaw), (goal, yaw), token=run.token)
    way.points, way.yaws                       # (k, 2) m and (k,) rad; or None without a way
    narrowed = keeping_yaw(field, [way])       # for refinement: near the way, with its yaw angles

The least-cost field leaves the yaw out: at every place the cheapest angle that is free counts, and
between racks it may lead into a gap in which the body cannot turn as the next bend needs it. Here a
state is a node with one of 32 yaw angles of half a turn (the body's rectangle looks the same after
that). Moves are the 16 of the grid, turning by a few angles on the way, and turns on the spot,
which cost a stop as well. Every move is tried for contact as closely as the finished motion. A*
(Hart, Nilsson and Raphael, 1968), with the least-cost field for what is still to come: it leaves
turning out, so it is never too high but for the rounding of angles.

Costs are estimates by tables; the programmes for yaw and speed price the motion afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.search.conditions import Circumstances
from planner.search.field import CostField
from planner.search.grid import cost_to_go
from planner.search.resolution import (
    ALL_YAWS,
    MOVES,
    OBJECTIVES,
    STATES,
    TURNS,
    YAW_BINS,
)
from planner.search.se2.hybrid_kernel import ANGLE, search_poses
from planner.search.situation import Situation
from planner.search.turns import Turning, spin_costs, turning
from planner.terrain.footprint import body_fits

Point = tuple[float, float]

MOST_NODES = 1_000_000
"""Nodes of a map up to which poses are searched: 200 MB are reserved for that many."""
NEAR = 1
"""Cells round a pose within which refinement may use its yaw."""
BESIDE = 1
"""Angles beside that of the pose that it may use as well."""
IN_PLACE = 0.01
"""m that a rad of turning, and a stop, count as where length is what matters."""


@dataclass(frozen=True)
class PosePath:
    """A way with the yaw of the body.

    Attributes:
        points: (k, 2) m.
        yaws: (k,) rad, modulo half a turn.
        cost: estimated, turning included.
    """

    points: Array
    yaws: Array
    cost: float

    @property
    def polyline(self) -> Array:
        """The points without those on which the body only turns."""
        apart = np.hypot(*np.diff(self.points, axis=0).T) > 1e-9
        return np.ascontiguousarray(self.points[np.concatenate([[True], apart])])


def pose_path(
    situation: Situation,
    field: CostField,
    objective: str,
    start: tuple[Point, float | None],
    goal: tuple[Point, float | None],
    *,
    token: CancellationToken,
) -> PosePath | None:
    """The least-cost way with yaw from start to goal.

    Args:
        situation: map and model.
        field: of the situation, for the objective.
        objective: "energy", "time" or "length".
        start, goal: place in m, and yaw in rad or None where it is free.
        token: the caller's wish to stop.

    Returns:
        The way, or None: there is none, the map is too large, or it took too many states.

    Raises:
        Cancelled: the caller wanted to stop.
    """
    if field.heights.size > MOST_NODES:
        return None
    ahead = cost_to_go(field, situation.lattice(objective, field), goal[0], token=token)
    prices, spin = _prices(situation.around, objective)
    states, cost = search_poses(
        field,
        field.body_frame(),
        MOVES,
        ahead.values,
        prices.table,
        prices.tightest,
        spin,
        prices.stop,
        *start[0],
        _at_end(field, *start, spin),
        *goal[0],
        _at_end(field, *goal, spin),
        token.flag,
    )
    token.check()
    if not states:
        return None
    nodes, angles = np.divmod(np.array(states), YAW_BINS)
    j, i = np.divmod(nodes, field.heights.shape[1])
    inner = np.column_stack([field.x0 + i * field.dx, field.y0 + j * field.dy])
    angles = np.concatenate([angles[:1], angles, angles[-1:]])
    return PosePath(np.vstack([start[0], inner, goal[0]]), angles * ANGLE, float(cost))


def keeping_yaw(field: CostField, ways: Sequence[PosePath]) -> CostField:
    """The same field, but near obstacles only the yaw angles of the ways, and only near them."""
    allowed = np.zeros(field.mask.shape, np.uint32)
    for way in ways:
        _allow(field, way.points, way.yaws, allowed)
    crowded = field.mask != ALL_YAWS
    return field._replace(mask=np.where(crowded, field.mask & allowed, field.mask))


def _prices(around: Circumstances, objective: str) -> tuple[Turning, float]:
    """Turning on the way and stops; and what an angle on the spot costs."""
    aim = OBJECTIVES[objective]
    prices = turning(around, aim)
    if objective == "length":
        # Turning takes no way; of equal ways the one with less of it.
        table = np.tile(IN_PLACE * np.linspace(0.0, prices.tightest, TURNS), (STATES, 1))
        return Turning(IN_PLACE, prices.tightest, table), IN_PLACE * ANGLE
    model = around.model
    numbers = (model.limits_kernel, model.parameters, model.body, model.wheels)
    spin = np.empty((1, STATES))
    level = (np.zeros(1), np.zeros((1, 4)), np.zeros(1, np.int64))
    spin_costs(*numbers, around.class_rows, around.limits, *level, aim, spin)
    return prices, float(spin.mean()) * ANGLE


def _at_end(field: CostField, place: Point, yaw: float | None, spin: float) -> Array:
    """What each angle costs at an end of the way, (YAW_BINS,): infinite where it cannot be had."""
    fits = np.array([body_fits(field, *place, k * ANGLE) for k in range(YAW_BINS)])
    if yaw is None:
        return np.where(fits, 0.0, np.inf)
    costs = np.full(YAW_BINS, np.inf)
    given = round(yaw / ANGLE)
    for way in (1, -1):
        for turned in range(YAW_BINS // 2 + 1):
            k = (given + way * turned) % YAW_BINS
            if turned and not fits[k]:
                break
            costs[k] = min(costs[k], turned * spin)
    return costs


@njit(cache=True, error_model="numpy")
def _allow(field: Any, points: Any, yaws: Any, allowed: Any) -> None:
    ny, nx = allowed.shape
    for k in range(points.shape[0]):
        angle = int(math.floor(yaws[k] / ANGLE + 0.5))
        bits = np.uint32(0)
        for b in range(angle - BESIDE, angle + BESIDE + 1):
            bits |= np.uint32(1) << np.uint32(b % YAW_BINS)
        i0 = int(math.floor((points[k, 0] - field.x0) / field.dx + 0.5))
        j0 = int(math.floor((points[k, 1] - field.y0) / field.dy + 0.5))
        for j in range(max(j0 - NEAR, 0), min(j0 + NEAR + 1, ny)):
            for i in range(max(i0 - NEAR, 0), min(i0 + NEAR + 1, nx)):
                allowed[j, i] |= bits
