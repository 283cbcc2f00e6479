"""The compiled search of poses: A* over nodes of the grid with the angle of the body.

    states, cost = search_poses(field, frame, MOVES, to_go, ..., stop)

hybrid_search calls it and says what a state is.
"""

from __future__ import annotations

import heapq
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.field import wind_cost
from planner.search.grid import node_slope
from planner.search.resolution import ALL_YAWS, COUNT, LEAST_COST, STATES, YAW_BINS
from planner.search.steady import polar
from planner.search.turns import turn_cost
from planner.terrain.footprint import touches

EAGER = 1.05
"""Factor on the cost-to-go in the order of the search: a path may cost so much more than the least,
for a fraction of the states (Pohl, 1970). Smoothing and driving change it by more than that."""
MOST_TURN = 3
"""Angles by which the body may turn on one move, to either side: 17°."""
ANGLE = math.pi / YAW_BINS
"""rad from one angle of the body to the next."""
_TURNS = 2 * MOST_TURN + 1
_SPUN = COUNT * _TURNS
"""From this number on, a state was reached by a turn on the spot, from the angle beyond it."""
_BEGUN = _SPUN + YAW_BINS
"""The state was reached from the start."""


class End(NamedTuple):
    """Start or goal.

    Attributes:
        x, y: m.
        costs: (YAW_BINS,) cost of each angle there; infinite where it is impossible.
    """

    x: float
    y: float
    costs: Array


class Moves(NamedTuple):
    """Properties of the moves of the grid.

    Attributes:
        offsets: (n, 2) columns and rows.
        length, direction, wind: (n,) m, rad, and cost that wind adds per metre.
        relative: (n, YAW_BINS) angle of the body to the travel, in steps.
        turns: (n, YAW_BINS, 2·MOST_TURN + 1) cost that turning adds.
    """

    offsets: NDArray[np.int64]
    length: Array
    direction: Array
    wind: Array
    relative: NDArray[np.int64]
    turns: Array


@njit(cache=True, error_model="numpy", inline="always")
def _free(mask: Any, b: int) -> bool:
    return bool((mask >> np.uint32(b)) & np.uint32(1))


@njit(cache=True, error_model="numpy")
def _near_end(field: Any, frame: Any, end: End, leaving: bool) -> list[tuple[int, int, float]]:
    """States round an end of the path: node, angle, and cost of the straight line between."""
    x, y = end.x, end.y
    ny, nx = field.heights.shape
    i0 = int(math.floor((x - field.x0) / field.dx))
    j0 = int(math.floor((y - field.y0) / field.dy))
    found = [(0, 0, 0.0) for _ in range(0)]
    for j in range(max(j0 - 1, 0), min(j0 + 3, ny)):
        for i in range(max(i0 - 1, 0), min(i0 + 3, nx)):
            px, py = field.x0 + i * field.dx, field.y0 + j * field.dy
            for b in range(YAW_BINS):
                if end.costs[b] == np.inf or not _free(field.mask[j, i], b):
                    continue
                if field.mask[j, i] != ALL_YAWS and touches(
                    field.blocked, frame, x, y, px, py, b * ANGLE, 0.0
                ):
                    continue
                ex, ey = (px - x, py - y) if leaving else (x - px, y - py)
                length, direction = math.hypot(ex, ey), math.atan2(ey, ex)
                cost = 0.0
                if length > 1e-9:
                    slope_x, slope_y = node_slope(field, j, i)
                    steepness, azimuth = _polar(slope_x, slope_y)
                    ground, turned = field.ground[j, i], _from_travel(b, direction)
                    cost = _metre_cost(
                        *(field.by_yaw[ground], field.yaw_limit[ground], field.margin),
                        *(steepness, azimuth - direction, turned),
                    )
                    cost = max(cost + wind_cost(field, direction), LEAST_COST) * length
                    if field.factor.shape[0] > 1:
                        cost *= field.factor[j, i]
                if cost < np.inf:
                    found.append((j * nx + i, b, cost + end.costs[b]))
    return found


@njit(cache=True, error_model="numpy")
def _metre_cost(
    by_yaw: Any,
    yaw_limit: Any,
    margin: float,
    steepness: float,
    azimuth: float,
    turned: int,
) -> float:
    """Cost per metre on a slope at an even yaw, ``turned`` angles from the travel or from behind.

    Args:
        by_yaw, yaw_limit: of the CostField, for the class of the ground.
        margin: share of the slope limit that may be used.
        steepness: tan(slope).
        azimuth: rad, of the slope to the travel.
        turned: in 0 to STATES - 1.
    """
    # The better end of the body goes first.
    best = np.inf
    for turn in (turned, (turned + STATES // 2) % STATES):
        best = min(best, polar(by_yaw[turn], yaw_limit[turn], azimuth, steepness, margin))
    return best


@njit(cache=True, error_model="numpy", inline="always")
def _roomy(mask: Any, b: int) -> bool:
    """Whether an angle of a node is free and its neighbours are, too."""
    return _free(mask, (b - 1) % YAW_BINS) and _free(mask, b) and _free(mask, (b + 1) % YAW_BINS)


@njit(cache=True, error_model="numpy", inline="always")
def _from_travel(b: int, direction: float) -> int:
    """The angle of the body to the travel, in steps."""
    return int(math.floor((b * ANGLE - direction) / ANGLE + 0.5)) % STATES


@njit(cache=True, error_model="numpy")
def _moves(field: Any, offsets: Any, turning: Any) -> Any:
    count = offsets.shape[0]
    length, direction, wind = np.empty(count), np.empty(count), np.empty(count)
    relative = np.empty((count, YAW_BINS), np.int64)
    turns = np.zeros((count, YAW_BINS, _TURNS))
    for m in range(count):
        ex, ey = offsets[m, 0] * field.dx, offsets[m, 1] * field.dy
        length[m], direction[m] = math.sqrt(ex * ex + ey * ey), math.atan2(ey, ex)
        wind[m] = wind_cost(field, direction[m])
        for b in range(YAW_BINS):
            relative[m, b] = _from_travel(b, direction[m])
            for w in range(-MOST_TURN, MOST_TURN + 1):
                if w != 0:
                    turns[m, b, w + MOST_TURN] = turn_cost(
                        turning, relative[m, b], length[m], w * ANGLE
                    )
    return Moves(offsets, length, direction, wind, relative, turns)


@njit(cache=True, error_model="numpy")
def _trace_back(came: Any, last: int, offsets: Any, nx: int) -> list[int]:
    """States from the start to ``last``; none where that is negative."""
    trail = [last for _ in range(1 if last >= 0 else 0)]
    while len(trail) > 0 and came[trail[-1]] != _BEGUN:
        state, number = trail[-1], came[trail[-1]]
        node, b = state // YAW_BINS, state % YAW_BINS
        if number >= _SPUN:
            trail.append(node * YAW_BINS + number - _SPUN)
        else:
            m, w = number // _TURNS, number % _TURNS - MOST_TURN
            before = node - offsets[m, 1] * nx - offsets[m, 0]
            trail.append(before * YAW_BINS + (b - w) % YAW_BINS)
    return trail[::-1]


@njit(cache=True, error_model="numpy")
def _begin(field: Any, frame: Any, start: End, to_go: Any, spent: Any, came: Any) -> Any:
    """Heap of the states round the start."""
    nx = to_go.shape[1]
    waiting = [(0.0, np.float32(0.0), 0) for _ in range(0)]
    for node, b, cost in _near_end(field, frame, start, True):
        state = node * YAW_BINS + b
        whole = np.float32(cost + 1.0)
        if spent[state] == 0.0 or whole < spent[state]:
            spent[state] = whole
            came[state] = _BEGUN
            heapq.heappush(waiting, (cost + EAGER * to_go[node // nx, node % nx], whole, state))
    return waiting


@njit(cache=True, error_model="numpy")
def _spin(
    mask: Any,
    spent: Any,
    came: Any,
    waiting: Any,
    state: int,
    still: float,
    halt: float,
    spin: float,
) -> None:
    """Reach the other angles of a node by turning on the spot, both ways round."""
    b = state % YAW_BINS
    value = spent[state] - 1.0
    for side in (1, -1):
        for turned in range(1, YAW_BINS // 2 + 1):
            to_b = (b + side * turned) % YAW_BINS
            if not _free(mask, to_b):
                break
            cost = value + halt + turned * spin
            whole = np.float32(cost + 1.0)
            other = state - b + to_b
            if spent[other] == 0.0 or whole < spent[other]:
                spent[other] = whole
                came[other] = _SPUN + b
                heapq.heappush(waiting, (cost + EAGER * still, whole, other))


@njit(cache=True, error_model="numpy", inline="always")
def _polar(px: float, py: float) -> tuple[float, float]:
    """Steepness and azimuth, rad, of a gradient."""
    steepness = math.sqrt(px * px + py * py)
    return steepness, math.atan2(py, px) if steepness > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _node_slopes(field: Any) -> Any:
    """Gradient at every node, and its steepness and azimuth, (ny, nx, 4)."""
    ny, nx = field.heights.shape
    slopes = np.empty((ny, nx, 4))
    for j in range(ny):
        for i in range(nx):
            px, py = node_slope(field, j, i)
            slopes[j, i, 0], slopes[j, i, 1] = px, py
            slopes[j, i, 2], slopes[j, i, 3] = _polar(px, py)
    return slopes


@njit(cache=True, error_model="numpy", nogil=True)
def search_poses(
    field: Any,
    frame: Any,
    offsets: Any,
    to_go: Any,
    turning: Any,
    spin: float,
    spin_limit: Any,
    turning_limit: Any,
    start: End,
    goal: End,
    most: int,
    stop: Any,
) -> Any:
    """States along the cheapest path, and its cost; none without a path.

    Args:
        field, frame: CostField, and its ``body_frame()``.
        offsets: (n, 2) of the moves.
        to_go: (ny, nx) cost-to-go.
        turning: Turning.
        spin: cost of turning on the spot by one angle.
        spin_limit: (grounds,) slope up to which that is possible.
        turning_limit: as the field's ``yaw_limit``, while the body turns.
        start, goal: both ends.
        most: states after which the search gives up.
        stop: (1,) not zero ends the search.
    """
    # Arrays by names of their own: taking them out of the tuple costs more than a look-up.
    heights, mask, grounds, factor = field.heights, field.mask, field.ground, field.factor
    steep = field.steep
    by_yaw, yaw_limit, blocked, margin = field.by_yaw, field.yaw_limit, field.blocked, field.margin
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    penalised, halt = factor.shape[0] > 1, turning.stop
    ny, nx = heights.shape
    states = ny * nx * YAW_BINS
    slopes = _node_slopes(field)
    edges, here_cost = np.stack((yaw_limit, turning_limit)), np.empty(2)
    moves = _moves(field, offsets, turning)
    length, direction, wind = moves.length, moves.direction, moves.wind
    relative, turns = moves.relative, moves.turns
    spent = np.zeros(states, np.float32)  # cost and 1, so that 0 is a state not seen yet
    came = np.zeros(states, np.uint16)
    waiting = _begin(field, frame, start, to_go, spent, came)
    arriving = {}
    for node, b, cost in _near_end(field, frame, goal, False):
        arriving[node * YAW_BINS + b] = cost
    best, last, expanded = np.inf, -1, 0
    while len(waiting) > 0:
        expected, known, state = heapq.heappop(waiting)
        if expected >= best or expanded > most or stop[0]:
            break
        node, b = state // YAW_BINS, state % YAW_BINS
        j, i = node // nx, node % nx
        if known > spent[state]:
            continue  # a better path was found since
        value = spent[state] - 1.0
        expanded += 1
        if state in arriving and value + arriving[state] < best:
            best, last = value + arriving[state], state
        x, y = x0 + i * dx, y0 + j * dy
        here = mask[j, i]
        if slopes[j, i, 2] <= spin_limit[grounds[j, i]]:
            _spin(here, spent, came, waiting, state, to_go[j, i], halt, spin)
        for m in range(offsets.shape[0]):
            to_i, to_j = i + offsets[m, 0], j + offsets[m, 1]
            if to_i < 0 or to_j < 0 or to_i >= nx or to_j >= ny:
                continue
            still = to_go[to_j, to_i]
            if still == np.inf:
                continue
            there = mask[to_j, to_i]
            straight, here_cost[:] = -1.0, -1.0
            hard = steep[j, i] or steep[to_j, to_i]
            for w in range(-MOST_TURN, MOST_TURN + 1):
                to_b = (b + w) % YAW_BINS
                other = (to_j * nx + to_i) * YAW_BINS + to_b
                cost = value + turns[m, b, w + MOST_TURN]
                # Most were reached for less before; they need no price.
                if not _free(there, to_b) or 0.0 < spent[other] <= cost + 1.0:
                    continue
                if hard:
                    # Few yaw angles hold here, other ones half a cell on, and fewer while it turns.
                    turns_on = int(w != 0)
                    ground, end = grounds[j, i], grounds[to_j, to_i]
                    if here_cost[turns_on] < 0.0:
                        here_cost[turns_on] = 0.5 * _metre_cost(
                            *(by_yaw[ground], edges[turns_on, ground], margin, slopes[j, i, 2]),
                            *(slopes[j, i, 3] - direction[m], relative[m, b]),
                        )
                    straight = here_cost[turns_on]
                    if straight < np.inf:
                        straight += 0.5 * _metre_cost(
                            *(by_yaw[end], edges[turns_on, end], margin, slopes[to_j, to_i, 2]),
                            *(slopes[to_j, to_i, 3] - direction[m], relative[m, to_b]),
                        )
                elif straight < 0.0:
                    ground = grounds[j, i]
                    steepness, azimuth = _polar(
                        0.5 * (slopes[j, i, 0] + slopes[to_j, to_i, 0]),
                        0.5 * (slopes[j, i, 1] + slopes[to_j, to_i, 1]),
                    )
                    straight = _metre_cost(
                        *(by_yaw[ground], yaw_limit[ground], margin),
                        *(steepness, azimuth - direction[m], relative[m, b]),
                    )
                driven = max(straight + wind[m], LEAST_COST) * length[m]
                if penalised:
                    driven *= factor[j, i]
                cost += driven
                whole = np.float32(cost + 1.0)
                # An infinite cost is never below the best one.
                if cost + still >= best or 0.0 < spent[other] <= whole:
                    continue
                # With an angle to spare at both ends, nothing is touched between two nodes. The
                # finished motion is tried for contact all the same.
                if not (_roomy(here, b) and _roomy(there, to_b)):
                    to_x, to_y = x + offsets[m, 0] * dx, y + offsets[m, 1] * dy
                    if touches(blocked, frame, x, y, to_x, to_y, b * ANGLE, w * ANGLE):
                        continue
                spent[other] = whole
                came[other] = m * _TURNS + w + MOST_TURN
                heapq.heappush(waiting, (cost + EAGER * still, whole, other))
    return _trace_back(came, last, offsets, nx), best
