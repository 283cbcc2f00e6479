"""Search in x, y and yaw at once: paths along which the body can turn in time.

    path = pose_path(situation, field, "energy", (start, yaw), (goal, yaw), token=run.token)
    path.points, path.yaws                     # (k, 2) m and (k,) rad; or None without a path
    narrowed = keeping_yaw(field, [path])      # for smoothing: near the path, with its yaw angles

The least-cost field leaves the yaw out: at every place the cheapest free angle counts. Between
racks it may lead into a gap in which the body cannot turn as the next bend needs it. Here a state
is a node with one of 32 yaw angles of half a turn (the body's rectangle looks the same after that).
Moves are the 16 of the grid, turning by a few angles on the way, and turns on the spot, which cost
a stop as well. Every move is tried for contact as closely as the finished motion. A* (Hart, Nilsson
and Raphael, 1968) uses the least-cost field as cost-to-go. It leaves turning out, so that it is
never too high but for the rounding of angles. Five per cent are added to it: fewer states are then
looked at, and the path may cost so much more than the least.

Near the slope limit both ends of a move are priced with the yaw there, and what turns has to hold
while it does (turning_limits): rollers that move take torque. What lies between them has to hold
with some yaw.

Costs are estimates by tables; the yaw and speed profiles price the motion afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.cache import CACHE
from planner.cancellation import CancellationToken
from planner.compiled_code import njit
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.grid import cost_to_go
from planner.search.resolution import (
    ALL_YAWS,
    DIRECTIONS,
    OBJECTIVES,
    STATES,
    TURNS,
    YAW_BINS,
)
from planner.search.se2.hybrid_kernel import MOST_TURN, AtNodes, search_poses
from planner.search.se2.pose_costs import ANGLE, End
from planner.search.se2.turning_limits import turning_limits
from planner.search.situation import Situation
from planner.search.turns import Turning, spin_costs, turning
from planner.terrain.footprint import body_fits

Point = tuple[float, float]

MOST_NODES = 1_000_000
"""Nodes of a map up to which poses are searched: 200 MB are reserved for that many."""
MOST_EXPANDED = 3_000_000
"""States after which the search gives up, so that a request without a path ends in seconds."""
YAW_CELLS = 1
"""Cells round a pose within which smoothing may use its yaw."""
YAW_NEIGHBOURS = 1
"""Angles to either side of a pose's own that smoothing may use."""
SPIN_SLOPES = 100
"""Slopes at which turning on the spot is tried, evenly up to the largest tan(slope): 1° apart."""
METRES_PER_RAD = 0.01
"""m that a rad of turning, and a stop, count as where length is minimised: of equally long paths
the one with less turning wins."""


class PoseLimits(NamedTuple):
    """How far a search of poses goes.

    Attributes:
        eager: times the least that a path may cost, for a fraction of the states: smoothing and
            driving change it by more than the default.
        most_expanded: states after which it gives up.
        beyond: times the least cost without yaw that a path may cost, about.
        too_steep: factor on the cost of a move that is too steep for every yaw between its ends. A
            path that bends may pass beside.
    """

    eager: float = 1.05
    most_expanded: int = MOST_EXPANDED
    beyond: float = math.inf
    too_steep: float = math.inf


@dataclass(frozen=True)
class PosePath:
    """A path with the yaw of the body.

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
        """The points without those at which the body turns on the spot."""
        apart = np.hypot(*np.diff(self.points, axis=0).T) > 1e-9
        return np.ascontiguousarray(self.points[np.concatenate([[True], apart])])


def pose_path(
    situation: Situation,
    field: CostField,
    objective: str,
    start: tuple[Point, float | None],
    goal: tuple[Point, float | None],
    *,
    free: NDArray[np.uint32] | None = None,
    limits: PoseLimits | None = None,
    token: CancellationToken,
) -> PosePath | None:
    """The least-cost path with yaw from start to goal.

    Args:
        situation: map and model.
        field: of the situation, for the objective.
        objective: "energy", "time" or "length".
        start, goal: place in m, and yaw in rad or None where it is free.
        free: (ny, nx) yaw angles that may be used, as the field's ``mask``; None for all of these.
        limits: how far the search goes.
        token: cancellation.

    Returns:
        The path, or None: there is none, the map is too large, or it took too many states.

    Raises:
        Cancelled: the caller cancelled.
    """
    if field.heights.size > MOST_NODES:
        return None
    limits = limits or PoseLimits()
    lattice = situation.lattice(objective, field)
    to_go = cost_to_go(field, lattice, goal[0], start=start[0], beyond=limits.beyond, token=token)
    turning_costs, spin = _prices(situation.conditions, objective)
    nodes = AtNodes(_node_slopes(field), field.mask if free is None else free, to_go.values)
    states, cost = search_poses(
        *(field, field.body_frame(), lattice, nodes, turning_costs, spin),
        *(spin_limit(situation.conditions), _turning_limits(situation.conditions, field)),
        End(*start[0], _at_end(field, *start, spin)),
        End(*goal[0], _at_end(field, *goal, spin)),
        limits,
        token.flag,
    )
    token.check()
    if not states:
        return None
    at, angles = np.divmod(np.array(states), YAW_BINS)
    j, i = np.divmod(at, field.heights.shape[1])
    inner = np.column_stack([field.x0 + i * field.dx, field.y0 + j * field.dy])
    angles = np.concatenate([angles[:1], angles, angles[-1:]])
    return PosePath(np.vstack([start[0], inner, goal[0]]), angles * ANGLE, float(cost))


def keeping_yaw(field: CostField, paths: Sequence[PosePath]) -> CostField:
    """The same field, but near obstacles only the yaw angles of the paths, and only near them."""
    allowed = np.zeros(field.mask.shape, np.uint32)
    for path in paths:
        _allow(field, path.points, path.yaws, allowed)
    crowded = field.mask != ALL_YAWS
    return field._replace(mask=np.where(crowded, field.mask & allowed, field.mask))


def _node_slopes(field: CostField) -> Array:
    """Gradient at every node, and its steepness and azimuth, (ny, nx, 4)."""
    along_y, along_x = np.gradient(field.heights, field.dy, field.dx)
    steepness, azimuth = np.hypot(along_x, along_y), np.arctan2(along_y, along_x)
    return np.stack([along_x, along_y, steepness, azimuth], axis=2)


def _prices(conditions: OperatingConditions, objective: str) -> tuple[Turning, float]:
    """Costs of turning and stopping, and the cost of turning on the spot by one angle."""
    aim = OBJECTIVES[objective]
    prices = turning(conditions, aim)
    if objective == "length":
        table = np.tile(METRES_PER_RAD * np.linspace(0.0, prices.tightest, TURNS), (STATES, 1))
        return Turning(METRES_PER_RAD, prices.tightest, table), METRES_PER_RAD * ANGLE
    spin = np.empty((1, STATES))
    level = (np.zeros(1), np.zeros((1, 4)), np.zeros(1, np.int64))
    spin_costs(conditions.model.limits_kernel, conditions.arrays, *level, aim, 0.0, spin)
    return prices, float(spin.mean()) * ANGLE


def spin_limit(conditions: OperatingConditions) -> Array:
    """tan(slope) up to which the body can turn on the spot with every yaw, (grounds,)."""
    slopes = np.zeros((SPIN_SLOPES, 4))
    slopes[:, 0] = np.linspace(0.0, float(conditions.limits[5]), SPIN_SLOPES)
    limit = np.zeros(len(conditions.class_rows))
    for ground in range(len(limit)):
        spin = np.empty((SPIN_SLOPES, STATES))
        spin_costs(
            *(conditions.model.limits_kernel, conditions.arrays, np.zeros(SPIN_SLOPES), slopes),
            *(np.full(SPIN_SLOPES, ground), OBJECTIVES["energy"], 0.0, spin),
        )
        held = np.logical_and.accumulate(np.isfinite(spin).all(axis=1))
        limit[ground] = slopes[held, 0].max(initial=0.0)
    return limit


def _turning_limits(conditions: OperatingConditions, field: CostField) -> Array:
    """As the field's ``yaw_limit``, while the body turns by one angle and more on a cell's length.

    (MOST_TURN, grounds, STATES, DIRECTIONS); without steep ground nobody asks.
    """
    if not field.steep.any():
        return np.empty((MOST_TURN, 0, STATES, DIRECTIONS))
    steady, steepest = conditions.steady, float(field.yaw_limit.max())
    curvatures = ANGLE / min(field.dx, field.dy) * np.arange(1.0, MOST_TURN + 1.0)
    return CACHE.get(
        ("turning_limits", steady.key, curvatures.tobytes()),
        lambda: turning_limits(steady, curvatures, steepest),
    )


def _at_end(field: CostField, place: Point, yaw: float | None, spin: float) -> Array:
    """Cost of each angle at an end of the path, (YAW_BINS,): infinite where it is impossible."""
    fits = np.array([body_fits(field, *place, k * ANGLE) for k in range(YAW_BINS)])
    if yaw is None:
        return np.where(fits, 0.0, np.inf)
    costs = np.full(YAW_BINS, np.inf)
    given = round(yaw / ANGLE)
    for side in (1, -1):
        for turned in range(YAW_BINS // 2 + 1):
            k = (given + side * turned) % YAW_BINS
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
        for b in range(angle - YAW_NEIGHBOURS, angle + YAW_NEIGHBOURS + 1):
            bits |= np.uint32(1) << np.uint32(b % YAW_BINS)
        i0 = int(math.floor((points[k, 0] - field.x0) / field.dx + 0.5))
        j0 = int(math.floor((points[k, 1] - field.y0) / field.dy + 0.5))
        for j in range(max(j0 - YAW_CELLS, 0), min(j0 + YAW_CELLS + 1, ny)):
            for i in range(max(i0 - YAW_CELLS, 0), min(i0 + YAW_CELLS + 1, nx)):
                allowed[j, i] |= bits
