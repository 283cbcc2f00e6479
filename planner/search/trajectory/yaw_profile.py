"""Yaw along a given track by exact dynamic programming, turning included.

Searching for yaw as a third dimension ruins planning; for a given track the best yaw follows
exactly. At every knot the body may stand at 64 angles to the travel (forward, sideways and
diagonal are among them), at the first and last one also at the yaw that was asked for. Between
knots it turns evenly while driving; at a knot it may stop and turn on the spot, which costs the
stop as well. Every piece is priced by the power model itself; yaw angles at which the body would
touch something are left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.conditions import Circumstances
from planner.search.field import CostField
from planner.search.resolution import ALL_YAWS, STATES, WIDTH
from planner.search.steady import lean_for_yaw
from planner.search.trajectory.track import GENTLE, Track
from planner.search.trajectory.yaw_estimate import steady_costs_of
from planner.search.trajectory.yaw_kernel import MOST_SAMPLES, programme
from planner.search.turns import spin_costs, turning
from planner.terrain.footprint import body_fits

FINER = 4
"""Angles off a state's own that are tried where the body does not fit with that, to either side."""


@dataclass(frozen=True)
class YawProfile:
    """Yaw at every station of a track.

    Attributes:
        arriving: (n,) rad, yaw with which a station is reached.
        leaving: (n,) rad, yaw after turning there on the spot; equal to ``arriving`` elsewhere.
        cost: what the programme minimised.
    """

    arriving: Array
    leaving: Array
    cost: float


def yaw_programme(
    around: Circumstances,
    field: CostField,
    track: Track,
    slopes: Array,
    grounds: NDArray[np.int64],
    *,
    objective: int,
    start_yaw: float | None,
    goal_yaw: float | None,
    beside: int,
    most_knots: int,
    shut: Sequence[tuple[float, float, float]] = (),
) -> YawProfile | Array:
    """Best yaw along a track, or the place (2,) beyond which no free yaw angles lead.

    Args:
        around: model and conditions.
        field: map and costs, for the free yaw angles.
        track: stations.
        slopes: (steps, 4) of ``slopes_of_steps``.
        grounds: (steps,) ground class of every step.
        objective: 1 minimises time, anything else energy.
        start_yaw, goal_yaw: rad; None leaves them free.
        beside: angles to either side of the best ones that the power model prices as well.
        most_knots: places at most at which yaw is decided, where there is room.
        shut: x, y and yaw with which the body is not to pass there, nor with angles near it.
    """
    crowded = _crowded(field, track.points)
    knots = _knots(track, crowded, most_knots)
    directions = _knot_directions(track, knots)
    steps = (track.directions, track.lengths, slopes, grounds)
    free, shift = _free_states(field, track.points[knots], directions)
    _lean(field, track.points, knots, directions, slopes, grounds, free, shift)
    for x, y, angle in shut:
        apart = np.hypot(*(track.points[knots] - (x, y)).T)
        if apart.min() <= track.lengths.max():
            k = int(apart.argmin())
            near = _state(angle, directions[k]) + np.arange(-1, 2)
            free[max(0, k - 1) : k + 2, near % STATES] = False
    spin = np.empty(free.shape)
    at = np.minimum(knots, len(slopes) - 1)
    model, limits = around.model, around.limits
    numbers = (
        model.limits_kernel,
        model.parameters,
        model.body,
        model.wheels,
        around.class_rows,
        limits,
    )
    spin_costs(*numbers, directions, slopes[at], grounds[at], objective, spin)
    prices = turning(around, objective)
    stride = _stride(knots, np.hypot(*slopes[:, 2:].T), GENTLE * float(field.limit.min()))
    steady = np.empty((len(knots) - 1, STATES))
    steady_costs_of(field, knots, *steps, stride, steady)
    states = np.full(2 * len(knots), -1, np.int64)
    cost = programme(
        field.blocked,
        field.body_frame(),
        track.points,
        crowded,
        *numbers,
        around.wind,
        objective,
        knots,
        directions,
        *steps,
        stride,
        steady,
        prices.table,
        prices.tightest,
        free,
        shift,
        spin,
        prices.stop,
        _state(start_yaw, directions[0]),
        _state(goal_yaw, directions[-1]),
        beside,
        states,
    )
    if not math.isfinite(cost):
        return np.asarray(track.points[knots[states[0]]])
    before, after = directions + WIDTH * states[0::2], directions + WIDTH * states[1::2]
    at = np.arange(len(knots))
    before += shift[at, states[0::2]]
    after += shift[at, states[1::2]]
    return _spread(track, knots, (before, after), states, cost, start_yaw, goal_yaw)


def _stride(knots: NDArray[np.int64], steepness: Array, gentle: float) -> NDArray[np.int64]:
    """Where knots lie far apart on gentle ground, a few steps stand for all between them."""
    count = np.maximum(1, np.diff(knots) // MOST_SAMPLES)
    return np.where(np.maximum.reduceat(steepness, knots[:-1]) < gentle, count, 1)


def _state(yaw: float | None, direction: float) -> int:
    """Number of the state nearest to a yaw; -1 for none."""
    if yaw is None:
        return -1
    return round(math.remainder(yaw - direction, 2.0 * math.pi) / WIDTH) % STATES


def _knots(track: Track, crowded: NDArray[np.bool_], most: int) -> NDArray[np.int64]:
    """Stations at which yaw is decided: all where room is scarce, others at even distances."""
    along = np.concatenate([[0.0], np.cumsum(track.lengths)])
    spacing = max(0.2, along[-1] / most)
    chosen = [0]
    for k in range(1, len(along) - 1):
        if along[k] - along[chosen[-1]] >= spacing or track.stops[k] or crowded[k]:
            chosen.append(k)
    return np.array([*chosen, len(along) - 1], np.int64)


def _crowded(field: CostField, points: Array) -> NDArray[np.bool_]:
    """Whether some yaw does not fit at points (n, 2)."""
    ny, nx = field.mask.shape
    i = np.clip(np.floor((points[:, 0] - field.x0) / field.dx + 0.5).astype(int), 0, nx - 1)
    j = np.clip(np.floor((points[:, 1] - field.y0) / field.dy + 0.5).astype(int), 0, ny - 1)
    return np.asarray(field.mask[j, i] != ALL_YAWS)


def _knot_directions(track: Track, knots: NDArray[np.int64]) -> Array:
    """Direction of travel at the knots: between that of the step before and the step after."""
    before = track.directions[np.maximum(knots - 1, 0)]
    after = track.directions[np.minimum(knots, len(track.directions) - 1)]
    turn = np.remainder(after - before + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(before + 0.5 * turn)


@njit(cache=True, error_model="numpy", nogil=True)
def _free_states(field: Any, points: Any, directions: Any) -> tuple[Any, Any]:
    """Whether the body fits at points (n, 2) in every state, and by how much it must be turned off
    it, rad: half a state at most, to the middle of what fits.
    """
    ny, nx = field.heights.shape
    free = np.ones((points.shape[0], STATES), np.bool_)
    shift = np.zeros((points.shape[0], STATES))
    half = STATES // 2  # the body looks the same after half a turn
    for k in range(points.shape[0]):
        x, y = points[k]
        i = min(max(int(math.floor((x - field.x0) / field.dx + 0.5)), 0), nx - 1)
        j = min(max(int(math.floor((y - field.y0) / field.dy + 0.5)), 0), ny - 1)
        if field.mask[j, i] == ALL_YAWS:
            continue
        for s in range(half):
            angle = directions[k] + s * WIDTH
            free[k, s] = body_fits(field, x, y, angle)
            if not free[k, s]:
                first, last = FINER + 1, -FINER - 1
                for n in range(-FINER, FINER + 1):
                    if n != 0 and body_fits(field, x, y, angle + 0.5 * n * WIDTH / FINER):
                        first, last = min(first, n), max(last, n)
                # On one side only: in between the body does not fit.
                if first < 0 < last:
                    first, last = (first, -1) if -first > last else (1, last)
                if first <= last:
                    free[k, s] = True
                    shift[k, s] = 0.25 * (first + last) * WIDTH / FINER
            free[k, s + half], shift[k, s + half] = free[k, s], shift[k, s]
    return free, shift


@njit(cache=True, error_model="numpy", nogil=True)
def _lean(
    field: Any,
    points: Any,
    knots: Any,
    directions: Any,
    slopes: Any,
    grounds: Any,
    free: Any,
    shift: Any,
) -> None:
    """Turn the body at the knots off the states' angles, into ``shift``, where that costs less."""
    leaning = np.empty(STATES, np.bool_)
    for s in range(STATES):
        leaning[s] = np.any(field.lean[:, s] != 0.0)
    last = slopes.shape[0] - 1
    ny, nx = field.heights.shape
    for k in range(knots.shape[0]):
        before, after = max(knots[k] - 1, 0), min(knots[k], last)
        px = 0.5 * (slopes[before, 0] + slopes[after, 0])
        py = 0.5 * (slopes[before, 1] + slopes[after, 1])
        steepness = math.sqrt(px * px + py * py)
        azimuth = math.atan2(py, px) - directions[k]
        x, y = points[knots[k]]
        i = min(max(int(math.floor((x - field.x0) / field.dx + 0.5)), 0), nx - 1)
        j = min(max(int(math.floor((y - field.y0) / field.dy + 0.5)), 0), ny - 1)
        roomy = field.mask[j, i] == ALL_YAWS
        for s in range(STATES):
            if not leaning[s] or not free[k, s] or shift[k, s] != 0.0:
                continue
            off = lean_for_yaw(field.lean, field.yaw_limit, grounds[after], s, azimuth, steepness)
            if roomy or body_fits(field, x, y, directions[k] + s * WIDTH + off):
                shift[k, s] = off


def _spread(
    track: Track,
    knots: NDArray[np.int64],
    angles: tuple[Array, Array],
    states: NDArray[np.int64],
    cost: float,
    start_yaw: float | None,
    goal_yaw: float | None,
) -> YawProfile:
    """Yaw at all stations, even in distance between the knots and without jumps of 2π."""
    arriving_at, leaving_at = angles
    if start_yaw is not None:
        arriving_at[0] = start_yaw
        if states[0] == states[1]:
            leaving_at[0] = start_yaw
    if goal_yaw is not None:
        leaving_at[-1] = goal_yaw
        if states[-2] == states[-1]:
            arriving_at[-1] = goal_yaw
    along = np.concatenate([[0.0], np.cumsum(track.lengths)])
    spins = _turned(leaving_at - arriving_at)
    turns = _turned(arriving_at[1:] - leaving_at[:-1])
    at_knots = arriving_at[0] + np.concatenate([[0.0], np.cumsum(spins[:-1] + turns)])
    # Every station but the first belongs to the knot before it.
    k = np.searchsorted(knots, np.arange(1, len(along))) - 1
    share = (along[1:] - along[knots[k]]) / (along[knots[k + 1]] - along[knots[k]])
    arriving = np.append(at_knots[0], (at_knots + spins)[k] + turns[k] * share)
    leaving = arriving.copy()
    leaving[knots] = at_knots + spins
    return YawProfile(arriving, leaving, cost)


def _turned(angles: Array) -> Array:
    """The shorter way round, between -π and π."""
    return np.asarray(angles - 2.0 * np.pi * np.round(angles / (2.0 * np.pi)))
