"""Search in x, y and yaw at once: ways along which the body can turn in time.

    way = pose_path(situation, field, "energy", (start, yaw), (goal, yaw), stop=run.stop)
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

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.errors import Cancelled
from planner.search.conditions import Circumstances
from planner.search.cost_to_go import cost_to_go
from planner.search.ground import (
    ALL_YAWS,
    YAW_BINS,
    CostField,
    body_fits,
    body_frame,
    touches,
    wind_cost,
)
from planner.search.lattice import COUNT, MOVES, node_slope
from planner.search.situation import Situation
from planner.search.spin import STATES, spin_costs
from planner.search.steady import DIRECTIONS, OBJECTIVES, STEEPNESSES, polar
from planner.search.stopping import Stop
from planner.search.turning import TURNS, Turning, turning
from planner.search.yaw_kernel import turn_cost

Array = NDArray[np.float64]
Point = tuple[float, float]

MOST_NODES = 1_000_000
"""Nodes of a map up to which poses are searched: 200 MB are reserved for that many."""
MOST_EXPANDED = 3_000_000
"""States after which the search gives up."""
TURNED = 3
"""Angles by which the body may turn on one move, to either side."""
NEAR = 1
"""Cells round a pose within which refinement may use its yaw."""
BESIDE = 1
"""Angles beside that of the pose that it may use as well."""
IN_PLACE = 0.01
"""m that a rad of turning, and a stop, count as where length is what matters."""
_BIN = math.pi / YAW_BINS
_TURNS = 2 * TURNED + 1
_SPUN = COUNT * _TURNS
"""From this number on, a state was reached by a turn on the spot, from the angle beyond it."""
_BEGUN = _SPUN + YAW_BINS
"""The state was reached from the start."""


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
    stop: Stop,
) -> PosePath | None:
    """The least-cost way with yaw from start to goal.

    Args:
        situation: map and model.
        field: of the situation, for the objective.
        objective: "energy", "time" or "length".
        start, goal: place in m, and yaw in rad or None where it is free.
        stop: the caller's wish to.

    Returns:
        The way, or None: there is none, the map is too large, or it took too many states.

    Raises:
        Cancelled: the caller wanted to stop.
    """
    if field.heights.size > MOST_NODES:
        return None
    ahead = cost_to_go(field, situation.lattice(objective, field), goal[0], stop=stop.flag)
    prices, spin = _prices(situation.around, objective)
    states, cost = _search(
        field,
        body_frame(field),
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
        stop.flag,
    )
    if stop.flag[0]:
        raise Cancelled("cancelled by the caller")
    if not states:
        return None
    nodes, angles = np.divmod(np.array(states), YAW_BINS)
    j, i = np.divmod(nodes, field.heights.shape[1])
    inner = np.column_stack([field.x0 + i * field.dx, field.y0 + j * field.dy])
    angles = np.concatenate([angles[:1], angles, angles[-1:]])
    return PosePath(np.vstack([start[0], inner, goal[0]]), angles * _BIN, float(cost))


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
        return Turning(IN_PLACE, prices.tightest, table), IN_PLACE * _BIN
    model = around.model
    numbers = (model.limits_kernel, model.parameters, model.body, model.wheels)
    spin = np.empty((1, STATES))
    level = (np.zeros(1), np.zeros((1, 4)), np.zeros(1, np.int64))
    spin_costs(*numbers, around.class_rows, around.limits, *level, aim, spin)
    return prices, float(spin.mean()) * _BIN


def _at_end(field: CostField, place: Point, yaw: float | None, spin: float) -> Array:
    """What each angle costs at an end of the way, (YAW_BINS,): infinite where it cannot be had."""
    fits = np.array([body_fits(field, *place, k * _BIN) for k in range(YAW_BINS)])
    if yaw is None:
        return np.where(fits, 0.0, np.inf)
    costs = np.full(YAW_BINS, np.inf)
    given = round(yaw / _BIN)
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
        angle = int(math.floor(yaws[k] / _BIN + 0.5))
        bits = np.uint32(0)
        for b in range(angle - BESIDE, angle + BESIDE + 1):
            bits |= np.uint32(1) << np.uint32(b % YAW_BINS)
        i0 = int(math.floor((points[k, 0] - field.x0) / field.dx + 0.5))
        j0 = int(math.floor((points[k, 1] - field.y0) / field.dy + 0.5))
        for j in range(max(j0 - NEAR, 0), min(j0 + NEAR + 1, ny)):
            for i in range(max(i0 - NEAR, 0), min(i0 + NEAR + 1, nx)):
                allowed[j, i] |= bits


@njit(cache=True, error_model="numpy", inline="always")
def _free(mask: Any, b: int) -> bool:
    return bool((mask >> np.uint32(b)) & np.uint32(1))


@njit(cache=True, error_model="numpy")
def _ends(
    field: Any, frame: Any, x: float, y: float, at_end: Any, leaving: bool
) -> list[tuple[int, int, float]]:
    """States round an end of the way: node, angle, and cost of the straight line between."""
    ny, nx = field.heights.shape
    i0 = int(math.floor((x - field.x0) / field.dx))
    j0 = int(math.floor((y - field.y0) / field.dy))
    found = [(0, 0, 0.0) for _ in range(0)]
    for j in range(max(j0 - 1, 0), min(j0 + 3, ny)):
        for i in range(max(i0 - 1, 0), min(i0 + 3, nx)):
            px, py = field.x0 + i * field.dx, field.y0 + j * field.dy
            for b in range(YAW_BINS):
                if at_end[b] == np.inf or not _free(field.mask[j, i], b):
                    continue
                if field.mask[j, i] != ALL_YAWS and touches(
                    field.blocked, frame, x, y, px, py, b * _BIN, 0.0
                ):
                    continue
                ex, ey = (px - x, py - y) if leaving else (x - px, y - py)
                length, direction = math.hypot(ex, ey), math.atan2(ey, ex)
                cost = 0.0
                if length > 1e-9:
                    slope_x, slope_y = node_slope(field, j, i)
                    ground = field.ground[j, i]
                    cost = _way_cost(
                        field.by_yaw[ground],
                        field.yaw_limit[ground],
                        field.margin,
                        slope_x,
                        slope_y,
                        direction,
                        _from_travel(b, direction),
                    )
                    cost = max(cost + wind_cost(field, direction), 1e-3) * length
                    if field.factor.shape[0] > 1:
                        cost *= field.factor[j, i]
                if cost < np.inf:
                    found.append((j * nx + i, b, cost + at_end[b]))
    return found


@njit(cache=True, error_model="numpy")
def _way_cost(
    by_yaw: Any,
    yaw_limit: Any,
    margin: float,
    px: float,
    py: float,
    direction: float,
    turned: int,
) -> float:
    """Cost per metre on a slope at an even yaw, ``turned`` angles from the travel or from behind.

    Args:
        by_yaw, yaw_limit: of the CostField, for the class of the ground.
        margin: share of the slope limit that may be used.
        px, py: gradient.
        direction: rad, of the travel.
        turned: in 0 to STATES - 1.
    """
    steepness = math.sqrt(px * px + py * py)
    azimuth = math.atan2(py, px) - direction if steepness > 0.0 else 0.0
    # The better end of the body goes first.
    best = np.inf
    for turn in (turned, (turned + STATES // 2) % STATES):
        cost = polar(
            by_yaw[turn], yaw_limit[turn], azimuth, steepness, margin, DIRECTIONS, STEEPNESSES
        )
        best = min(best, cost)
    return best


@njit(cache=True, error_model="numpy", inline="always")
def _from_travel(b: int, direction: float) -> int:
    """The angle of the body to the travel, in steps."""
    return int(math.floor((b * _BIN - direction) / _BIN + 0.5)) % STATES


@njit(cache=True, error_model="numpy", nogil=True)
def _search(
    field: Any,
    frame: Any,
    moves: Any,
    ahead: Any,
    turning: Any,
    tightest: float,
    spin: float,
    halt: float,
    start_x: float,
    start_y: float,
    at_start: Any,
    goal_x: float,
    goal_y: float,
    at_goal: Any,
    stop: Any,
) -> Any:
    """States along the cheapest way, and its cost; none without a way."""
    # Arrays by names of their own: taking them out of the tuple costs more than a look-up.
    heights, mask, grounds, factor = field.heights, field.mask, field.ground, field.factor
    by_yaw, yaw_limit, blocked, margin = field.by_yaw, field.yaw_limit, field.blocked, field.margin
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    dearer = factor.shape[0] > 1
    ny, nx = heights.shape
    states = ny * nx * YAW_BINS
    slopes = np.empty((ny, nx, 2))
    for j in range(ny):
        for i in range(nx):
            slopes[j, i, 0], slopes[j, i, 1] = node_slope(field, j, i)
    # What a move has for itself: length, direction, wind, and what turning on it adds.
    count = moves.shape[0]
    length, direction, wind = np.empty(count), np.empty(count), np.empty(count)
    relative = np.empty((count, YAW_BINS), np.int64)
    turns = np.empty((count, YAW_BINS, _TURNS))
    for m in range(count):
        ex, ey = moves[m, 0] * dx, moves[m, 1] * dy
        length[m], direction[m] = math.sqrt(ex * ex + ey * ey), math.atan2(ey, ex)
        wind[m] = wind_cost(field, direction[m])
        for b in range(YAW_BINS):
            relative[m, b] = _from_travel(b, direction[m])
            for w in range(-TURNED, TURNED + 1):
                turns[m, b, w + TURNED] = 0.0
                if w != 0:
                    turns[m, b, w + TURNED] = turn_cost(
                        turning, tightest, relative[m, b], length[m], w * _BIN
                    )
    spent = np.zeros(states, np.float32)  # cost and 1, so that 0 is a state not seen yet
    came = np.zeros(states, np.uint16)
    waiting = [(0.0, np.float32(0.0), 0) for _ in range(0)]
    for node, b, cost in _ends(field, frame, start_x, start_y, at_start, True):
        state = node * YAW_BINS + b
        whole = np.float32(cost + 1.0)
        if spent[state] == 0.0 or whole < spent[state]:
            spent[state] = whole
            came[state] = _BEGUN
            heapq.heappush(waiting, (cost + ahead[node // nx, node % nx], whole, state))
    arriving = {}
    for node, b, cost in _ends(field, frame, goal_x, goal_y, at_goal, False):
        arriving[node * YAW_BINS + b] = cost
    best, last, expanded = np.inf, -1, 0
    while len(waiting) > 0:
        expected, known, state = heapq.heappop(waiting)
        if expected >= best or expanded > MOST_EXPANDED or stop[0]:
            break
        node, b = state // YAW_BINS, state % YAW_BINS
        j, i = node // nx, node % nx
        if known > spent[state]:
            continue  # a better way was found since
        value = spent[state] - 1.0
        expanded += 1
        if state in arriving and value + arriving[state] < best:
            best, last = value + arriving[state], state
        x, y = x0 + i * dx, y0 + j * dy
        here = mask[j, i]
        for way in (1, -1):
            for turned in range(1, YAW_BINS // 2 + 1):
                to_b = (b + way * turned) % YAW_BINS
                if not _free(here, to_b):
                    break
                cost = value + halt + turned * spin
                whole = np.float32(cost + 1.0)
                other = node * YAW_BINS + to_b
                if spent[other] == 0.0 or whole < spent[other]:
                    spent[other] = whole
                    came[other] = _SPUN + b
                    heapq.heappush(waiting, (cost + ahead[j, i], whole, other))
        for m in range(count):
            to_i, to_j = i + moves[m, 0], j + moves[m, 1]
            if to_i < 0 or to_j < 0 or to_i >= nx or to_j >= ny:
                continue
            still = ahead[to_j, to_i]
            if still == np.inf:
                continue
            there = mask[to_j, to_i]
            straight = -1.0
            for w in range(-TURNED, TURNED + 1):
                to_b = (b + w) % YAW_BINS
                other = (to_j * nx + to_i) * YAW_BINS + to_b
                cost = value + turns[m, b, w + TURNED]
                # Most were reached for less before; they need no price.
                if not _free(there, to_b) or 0.0 < spent[other] <= cost + 1.0:
                    continue
                if straight < 0.0:
                    ground = grounds[j, i]
                    straight = _way_cost(
                        *(by_yaw[ground], yaw_limit[ground], margin),
                        0.5 * (slopes[j, i, 0] + slopes[to_j, to_i, 0]),
                        0.5 * (slopes[j, i, 1] + slopes[to_j, to_i, 1]),
                        *(direction[m], relative[m, b]),
                    )
                    straight = max(straight + wind[m], 1e-3) * length[m]
                    if dearer:
                        straight *= factor[j, i]
                cost += straight
                whole = np.float32(cost + 1.0)
                if cost + still >= best or 0.0 < spent[other] <= whole:
                    continue
                if (here != ALL_YAWS or there != ALL_YAWS) and touches(
                    blocked,
                    frame,
                    x,
                    y,
                    x + moves[m, 0] * dx,
                    y + moves[m, 1] * dy,
                    b * _BIN,
                    w * _BIN,
                ):
                    continue
                spent[other] = whole
                came[other] = m * _TURNS + w + TURNED
                heapq.heappush(waiting, (cost + still, whole, other))
    trail = [last for _ in range(1 if last >= 0 else 0)]
    while len(trail) > 0 and came[trail[-1]] != _BEGUN:
        state, number = trail[-1], came[trail[-1]]
        node, b = state // YAW_BINS, state % YAW_BINS
        if number >= _SPUN:
            trail.append(node * YAW_BINS + number - _SPUN)
        else:
            m, w = number // _TURNS, number % _TURNS - TURNED
            before = node - moves[m, 1] * nx - moves[m, 0]
            trail.append(before * YAW_BINS + (b - w) % YAW_BINS)
    return trail[::-1], best
