"""The compiled search of poses: A* over nodes of the grid with the angle of the body.

    states, cost = search_poses(field, frame, MOVES, ahead, ..., stop)

hybrid_search calls it and says what a state is.
"""

from __future__ import annotations

import heapq
import math
from typing import Any

import numpy as np
from numba import njit

from planner.search.field import wind_cost
from planner.search.grid import node_slope
from planner.search.resolution import (
    ALL_YAWS,
    COUNT,
    DIRECTIONS,
    STATES,
    STEEPNESSES,
    YAW_BINS,
)
from planner.search.steady import polar
from planner.search.turns import turn_cost
from planner.terrain.footprint import touches

MOST_EXPANDED = 3_000_000
"""States after which the search gives up."""
TURNED = 3
"""Angles by which the body may turn on one move, to either side."""
ANGLE = math.pi / YAW_BINS
_TURNS = 2 * TURNED + 1
_SPUN = COUNT * _TURNS
"""From this number on, a state was reached by a turn on the spot, from the angle beyond it."""
_BEGUN = _SPUN + YAW_BINS
"""The state was reached from the start."""


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
                    field.blocked, frame, x, y, px, py, b * ANGLE, 0.0
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
    return int(math.floor((b * ANGLE - direction) / ANGLE + 0.5)) % STATES


@njit(cache=True, error_model="numpy", nogil=True)
def search_poses(
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
                        turning, tightest, relative[m, b], length[m], w * ANGLE
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
                    b * ANGLE,
                    w * ANGLE,
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
