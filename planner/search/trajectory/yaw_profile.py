"""Yaw along a given track by exact dynamic programming, turning included.

A search over yaw as a third dimension is slow; on a given track the best yaw follows exactly. At
every waypoint the body may stand at 64 angles to the travel (forward, sideways and diagonal are
among them), at the first and last one also at the yaw that was asked for. Between waypoints it
turns evenly while driving. At a waypoint it may stop and turn on the spot, which costs the stop as
well. The power model prices every piece. Yaw angles at which the body would touch something, or
would lose its grip on the slope, are left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.kernel_arguments import Steps
from planner.search.resolution import ALL_YAWS, DIRECTIONS, STATES, WIDTH
from planner.search.steady import crab_angle_for_yaw
from planner.search.trajectory.track import Track, gentle_slope
from planner.search.trajectory.yaw_kernel import best_states
from planner.search.trajectory.yaw_moves import (
    MOST_SAMPLES,
    Surroundings,
    Waypoints,
    steady_costs_of,
    turn_to_what_holds,
)
from planner.search.turns import spin_costs, turning
from planner.terrain.footprint import any_yaw_fits, body_fits, middle_fits
from planner.terrain.obstacles import clear_of, rim_near

FINER_ANGLES = 4
"""Angles to either side of a state's own, 0.7° apart, that are tried where the body does not fit
with that: in narrow passages."""
STEEP, SPARSE = 0.9, 0.5
"""Share of the slope limit above which every sample is a waypoint of the yaw, where waypoints lie
more than so many cells, and two samples, apart: few angles can be driven there, and other ones half
a cell on."""
ALIKE = 1e-3
"""Share by which slope limits of both ends of the body may differ and still count as the same: they
are bisected to less."""
CLOSEST_WAYPOINTS = 0.2
"""m between two waypoints at least where there is room."""


@dataclass(frozen=True)
class YawProfile:
    """Yaw at every sample of a track.

    Attributes:
        arriving: (n,) rad, yaw with which a sample is reached.
        leaving: (n,) rad, yaw after turning there on the spot; equal to ``arriving`` elsewhere.
        cost: the minimum found.
    """

    arriving: Array
    leaving: Array
    cost: float

    def towards(self, other: YawProfile, share: Array) -> YawProfile:
        """This one turned by ``share`` (n,) of what another one differs by; exactly so where 1."""
        arriving = self.arriving + share * (other.arriving - self.arriving)
        leaving = self.leaving + share * (other.leaving - self.leaving)
        whole = share >= 1.0
        return YawProfile(
            np.where(whole, other.arriving, arriving),
            np.where(whole, other.leaving, leaving),
            self.cost,
        )


def yaw_profile(
    conditions: OperatingConditions,
    field: CostField,
    track: Track,
    steps: Steps,
    *,
    objective: int,
    start_yaw: float | None,
    goal_yaw: float | None,
    beside: int,
    most_waypoints: int,
    shut: Sequence[tuple[float, float, float]] = (),
) -> YawProfile | Array:
    """Best yaw along a track, or the place (2,) beyond which no free yaw angles lead.

    Args:
        conditions: model and conditions.
        field: map and costs, for the free yaw angles.
        track: samples of the path.
        steps: between them.
        objective: 1 minimises time, anything else energy.
        start_yaw, goal_yaw: rad; None leaves them free.
        beside: angles to either side of the best ones that the power model prices as well.
        most_waypoints: places at most at which yaw is decided, where there is room.
        shut: x, y and yaw with which the body is not to pass there, nor with angles near it.
    """
    crowded = crowded_at(field, track.points)
    steepness = np.hypot(*steps.slopes[:, 2:4].T)
    spacing = max(CLOSEST_WAYPOINTS, float(track.lengths.sum()) / most_waypoints)
    needed = track.stops | crowded
    apart = 2.0 * float(track.lengths.max())
    if spacing > apart:
        # Between two waypoints the yaw turns evenly, and a bend in their midst has it to one side.
        bends = track.curvatures != 0.0
        needed[1:-1] |= bends[1:] != bends[:-1]
    if spacing > max(SPARSE * min(field.dx, field.dy), apart):
        steep = steepness > STEEP * float(field.limit.min())
        needed[1:] |= steep
        needed[:-1] |= steep
    at = _waypoints(track, needed, spacing)
    directions = _directions(track, at)
    places, after = track.points[at], np.minimum(at, len(steps.lengths) - 1)
    free, shift = _free_states(field, places, directions, crowded[at])
    _add_crab_angles(field, places, at, directions, steps, crowded[at], free, shift)
    if shut:
        _leave_out(shut, places, directions, float(track.lengths.max()), _ends_alike(field), free)
    gentle = gentle_slope(field)
    ends = (0, start_yaw), (-1, goal_yaw)
    asked = [(row, _state(yaw, directions[row])) for row, yaw in ends if yaw is not None]
    fits = [free[place] for place in asked]
    _leave_out_too_steep(field, at, directions, steps, gentle, free)
    for place, fit in zip(asked, fits, strict=True):
        free[place] = fit
    kernel, spin = conditions.model.limits_kernel, np.empty(free.shape)
    turn_to_what_holds(
        *(kernel, conditions.arrays, field.limit, at, directions, steps),
        *(free & ~crowded[at][:, None], shift),
    )
    spin_costs(
        *(kernel, conditions.arrays, directions, steps.slopes[after], steps.ground[after]),
        *(objective, spin),
    )
    stride = _stride(at, steepness, gentle)
    steady = np.empty((len(at) - 1, STATES))
    steady_costs_of(field, at, steps, stride, steady)
    states = np.full(2 * len(at), -1, np.int64)
    cost = best_states(
        kernel,
        conditions.arrays,
        objective,
        Surroundings(field.blocked, field.body_frame(), track.points, crowded),
        steps,
        Waypoints(at, directions, stride, steady, free, shift, spin),
        turning(conditions, objective),
        _state(start_yaw, directions[0]),
        _state(goal_yaw, directions[-1]),
        beside,
        states,
    )
    if not math.isfinite(cost):
        return np.asarray(places[states[0]])
    before, after = directions + WIDTH * states[0::2], directions + WIDTH * states[1::2]
    row = np.arange(len(at))
    before += shift[row, states[0::2]]
    after += shift[row, states[1::2]]
    if start_yaw is not None:
        before[0] = start_yaw
        if states[0] == states[1]:
            after[0] = start_yaw
    if goal_yaw is not None:
        after[-1] = goal_yaw
        if states[-2] == states[-1]:
            before[-1] = goal_yaw
    return _at_samples(track, at, before, after, cost)


def _leave_out(
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
        beside = _state(angle, directions[k]) + np.arange(-1, 2)
        if ends_alike:
            beside = np.append(beside, beside + STATES // 2)
        free[max(0, k - 1) : k + 2, beside % STATES] = False


def _ends_alike(field: CostField) -> bool:
    """Whether slope limits are the same after half a turn of the body."""
    turned = np.roll(field.yaw_limit, STATES // 2, axis=1)
    return bool(np.allclose(field.yaw_limit, turned, rtol=ALIKE))


def _stride(at: NDArray[np.int64], steepness: Array, gentle: float) -> NDArray[np.int64]:
    """Where waypoints lie far apart on gentle ground, a few steps stand for all between them."""
    count = np.maximum(1, np.diff(at) // MOST_SAMPLES)
    return np.where(np.maximum.reduceat(steepness, at[:-1]) < gentle, count, 1)


def _state(yaw: float | None, direction: float) -> int:
    """Number of the state nearest to a yaw; -1 for none."""
    if yaw is None:
        return -1
    return round(math.remainder(yaw - direction, 2.0 * math.pi) / WIDTH) % STATES


def _waypoints(track: Track, needed: NDArray[np.bool_], spacing: float) -> NDArray[np.int64]:
    """Samples at which yaw is decided: those ``needed`` (n,), others at even distances."""
    along = np.concatenate([[0.0], np.cumsum(track.lengths)])
    chosen = [0]
    for k in range(1, len(along) - 1):
        if along[k] - along[chosen[-1]] >= spacing or needed[k]:
            chosen.append(k)
    return np.array([*chosen, len(along) - 1], np.int64)


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


def _directions(track: Track, at: NDArray[np.int64]) -> Array:
    """Direction of travel at waypoints: between that of the step before and the step after."""
    before = track.directions[np.maximum(at - 1, 0)]
    after = track.directions[np.minimum(at, len(track.directions) - 1)]
    turn = np.remainder(after - before + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(before + 0.5 * turn)


@njit(cache=True, error_model="numpy")
def core_of(half_length: float, half_width: float) -> tuple[float, float]:
    """Half the sides of a rectangle that the body covers with all angles of a state.

    Turned by half a state at most, its corners still lie within the body's sides.
    """
    off = math.sin(0.5 * WIDTH)
    return half_length - half_width * off, half_width - half_length * off


@njit(cache=True, error_model="numpy", nogil=True)
def _free_states(field: Any, points: Any, directions: Any, crowded: Any) -> tuple[Any, Any]:
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
def _leave_out_too_steep(
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
            free[k] = allowed


@njit(cache=True, error_model="numpy", nogil=True)
def _add_crab_angles(
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


def _at_samples(
    track: Track, at: NDArray[np.int64], before: Array, after: Array, cost: float
) -> YawProfile:
    """Yaw at all samples, even in distance between the waypoints and without jumps of 2π."""
    along = np.concatenate([[0.0], np.cumsum(track.lengths)])
    spins = _turned(after - before)
    turns = _turned(before[1:] - after[:-1])
    yaws = before[0] + np.concatenate([[0.0], np.cumsum(spins[:-1] + turns)])
    # Every sample but the first belongs to the waypoint before it.
    k = np.searchsorted(at, np.arange(1, len(along))) - 1
    share = (along[1:] - along[at[k]]) / (along[at[k + 1]] - along[at[k]])
    arriving = np.append(yaws[0], (yaws + spins)[k] + turns[k] * share)
    leaving = arriving.copy()
    leaving[at] = yaws + spins
    return YawProfile(arriving, leaving, cost)


def _turned(angles: Array) -> Array:
    """The shorter way round, between -π and π."""
    return np.asarray(angles - 2.0 * np.pi * np.round(angles / (2.0 * np.pi)))
