"""Yaw angles that are free at places of a track: where the body fits, and the slope lets it.

    free, shift = free_states(field, places, directions, crowded)      # (n, STATES) each
    add_crab_angles(field, places, at, directions, steps, crowded, free, shift)
    leave_out(shut, places, directions, near, alike, free)
    leave_out_too_steep(field, at, directions, steps, gentle, free)

``shift`` turns the body off a state's own angle, rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.field import CostField
from planner.search.resolution import ALL_YAWS, DIRECTIONS, STATES, WIDTH
from planner.search.steady import crab_angle_for_yaw
from planner.terrain.footprint import any_yaw_fits, body_fits, middle_fits
from planner.terrain.obstacles import clear_of, rim_near

FINER_ANGLES = 4
"""Angles to either side of a state's own, 0.7° apart, that are tried where the body does not fit
with that: in narrow passages."""
ALIKE = 1e-3
"""Share by which slope limits of both ends of the body may differ and still count as the same: they
are bisected to less."""


@njit(cache=True, error_model="numpy", nogil=True)
def crowded_at(field: Any, points: Any) -> Any:
    """Whether (n,) some yaw may not fit at points (n, 2): it does not at a node beside them."""
    mask = field.mask
    ny, nx = mask.shape
    crowded = np.zeros(points.shape[0], np.bool_)
    for k in range(points.shape[0]):
        i = int(math.floor((points[k, 0] - field.x0) / field.dx + 0.5))
        j = int(math.floor((points[k, 1] - field.y0) / field.dy + 0.5))
        i, j = min(max(i, 0), nx - 1), min(max(j, 0), ny - 1)
        for b in range(max(j - 1, 0), min(j + 2, ny)):
            for a in range(max(i - 1, 0), min(i + 2, nx)):
                crowded[k] |= mask[b, a] != ALL_YAWS
    return crowded


@njit(cache=True, error_model="numpy")
def core_of(half_length: float, half_width: float) -> tuple[float, float]:
    """Half the sides of a rectangle that the body covers with all angles of a state.

    Turned by half a state at most, its corners still lie within the body's sides.
    """
    off = math.sin(0.5 * WIDTH)
    return half_length - half_width * off, half_width - half_length * off


@njit(cache=True, error_model="numpy", nogil=True)
def free_states(field: Any, points: Any, directions: Any, crowded: Any) -> tuple[Any, Any]:
    """Whether the body fits at points (n, 2) in every state, and its turn off the state, rad.

    The turn is half a state at most, to the middle of the angles that fit. Where it is not
    ``crowded`` (n,), every angle fits.
    """
    free = np.ones((points.shape[0], STATES), np.bool_)
    shift = np.zeros((points.shape[0], STATES))
    half = STATES // 2  # the body looks the same after half a turn
    body = field.half_length, field.half_width
    core = core_of(field.half_length, field.half_width)
    frame, half_cell = (field.x0, field.y0, field.dx, field.dy), (0.5 * field.dx, 0.5 * field.dy)
    reach = math.hypot(field.half_length, field.half_width)
    cells = np.empty((int(2.0 * reach / field.dx + 4.0) * int(2.0 * reach / field.dy + 4.0), 2))
    ny, nx = field.blocked.shape
    for k in range(points.shape[0]):
        x, y = points[k]
        if not crowded[k] or any_yaw_fits(field, x, y):
            continue
        if not middle_fits(field, x, y):
            free[k] = False
            continue
        rim = cells[: rim_near(field.blocked, frame, x, y, reach, cells)]
        u, v = (x - field.x0) / field.dx, (y - field.y0) / field.dy
        by_u, by_v = reach / field.dx - 0.5, reach / field.dy - 0.5
        inside = by_u < u < nx - 1 - by_u and by_v < v < ny - 1 - by_v
        for s in range(half):
            angle = directions[k] + s * WIDTH
            # Near the map's border, that is in the way as well.
            free[k, s] = clear_of(rim, half_cell, angle, body) and (
                inside or body_fits(field, x, y, angle)
            )
            if not free[k, s] and (min(core) <= 0.0 or clear_of(rim, half_cell, angle, core)):
                first, last = FINER_ANGLES + 1, -FINER_ANGLES - 1
                for n in range(-FINER_ANGLES, FINER_ANGLES + 1):
                    finer = angle + 0.5 * n * WIDTH / FINER_ANGLES
                    fits = n != 0 and clear_of(rim, half_cell, finer, body)
                    if fits and (inside or body_fits(field, x, y, finer)):
                        first, last = min(first, n), max(last, n)
                # On one side only: in between the body does not fit.
                if first < 0 < last:
                    first, last = (first, -1) if -first > last else (1, last)
                if first <= last:
                    free[k, s] = True
                    shift[k, s] = 0.25 * (first + last) * WIDTH / FINER_ANGLES
            free[k, s + half], shift[k, s + half] = free[k, s], shift[k, s]
    return free, shift


@njit(cache=True, error_model="numpy", nogil=True)
def add_crab_angles(
    field: Any,
    places: Any,
    at: Any,
    directions: Any,
    steps: Any,
    crowded: Any,
    free: Any,
    shift: Any,
) -> None:
    """Turn the body off the states' angles, into ``shift``, where that costs less."""
    slopes = steps.slopes
    crabbing = np.empty(STATES, np.bool_)
    for s in range(STATES):
        crabbing[s] = np.any(field.crab_angle[:, s] != 0.0)
    last = slopes.shape[0] - 1
    for k in range(at.shape[0]):
        before, after = max(at[k] - 1, 0), min(at[k], last)
        px = 0.5 * (slopes[before, 0] + slopes[after, 0])
        py = 0.5 * (slopes[before, 1] + slopes[after, 1])
        steepness = math.sqrt(px * px + py * py)
        azimuth = math.atan2(py, px) - directions[k]
        x, y = places[k]
        for s in range(STATES):
            if not crabbing[s] or not free[k, s] or shift[k, s] != 0.0:
                continue
            ground = steps.ground[after]
            off = crab_angle_for_yaw(
                field.crab_angle, field.yaw_limit, ground, s, azimuth, steepness
            )
            if not crowded[k] or body_fits(field, x, y, directions[k] + s * WIDTH + off):
                shift[k, s] = off


def leave_out(
    shut: Sequence[tuple[float, float, float]],
    places: Array,
    directions: Array,
    near: float,
    ends_alike: bool,
    free: NDArray[np.bool_],
) -> None:
    """Close angles that broke a limit, where a waypoint is at most ``near`` m away.

    Where the ends of the body are alike, the other one would break it as well.
    """
    for x, y, angle in shut:
        apart = np.hypot(*(places - (x, y)).T)
        if apart.min() > near:
            continue
        k = int(apart.argmin())
        beside = state_of(angle, directions[k]) + np.arange(-1, 2)
        if ends_alike:
            beside = np.append(beside, beside + STATES // 2)
        free[max(0, k - 1) : k + 2, beside % STATES] = False


def ends_alike(field: CostField) -> bool:
    """Whether slope limits are the same after half a turn of the body."""
    turned = np.roll(field.yaw_limit, STATES // 2, axis=1)
    return bool(np.allclose(field.yaw_limit, turned, rtol=ALIKE))


@njit(cache=True, error_model="numpy", nogil=True)
def leave_out_too_steep(
    field: Any, at: Any, directions: Any, steps: Any, gentle: float, free: Any
) -> None:
    """Close the angles whose slope limit a waypoint exceeds, unless all do.

    Moves are priced at places between waypoints: where the body turns, that says little of their
    ends.

    Args:
        field: tables of slope limits by yaw.
        at, directions: (n,) samples that are waypoints, and the travel there, rad.
        steps: Steps between the samples.
        gentle: tan(slope) up to which every angle stays.
        free: (n, STATES) brought up to date.
    """
    slopes, yaw_limit = steps.slopes, field.yaw_limit
    last = slopes.shape[0] - 1
    allowed = np.empty(STATES, np.bool_)
    for k in range(at.shape[0]):
        before, after = max(at[k] - 1, 0), min(at[k], last)
        px = 0.5 * (slopes[before, 0] + slopes[after, 0])
        py = 0.5 * (slopes[before, 1] + slopes[after, 1])
        steepness = math.sqrt(px * px + py * py)
        if steepness < gentle:
            continue
        place = (math.atan2(py, px) - directions[k]) / (2.0 * math.pi) * DIRECTIONS
        first = int(math.floor(place))
        share, g = place - first, steps.ground[after]
        for s in range(STATES):
            limit = (1.0 - share) * yaw_limit[g, s, first % DIRECTIONS]
            limit += share * yaw_limit[g, s, (first + 1) % DIRECTIONS]
            allowed[s] = free[k, s] and steepness <= limit
        if allowed.any():
            for s in range(STATES):
                free[k, s] = allowed[s]


def state_of(yaw: float, direction: float) -> int:
    """Number of the state nearest to a yaw."""
    return round(math.remainder(yaw - direction, 2.0 * math.pi) / WIDTH) % STATES
