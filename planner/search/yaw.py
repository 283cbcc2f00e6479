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
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planner.power.compile_kernel import KERNEL
from planner.power.model import PowerModel
from planner.power.pipeline import ACCOUNT_LENGTH, PER_WHEEL
from planner.quantities import INDEX
from planner.search.ground import YAW_BINS, CostField
from planner.search.steady import BRIEFLY, broken_limit, set_motion
from planner.search.track import Track
from planner.terrain.obstacles import rectangle_free

Array = NDArray[np.float64]
STATES = 64
WINDOW = 8
"""Largest change of the angle to the travel between knots, in states (45°)."""
MOST_KNOTS = 240
_WHEEL_COLUMNS = len(PER_WHEEL)

_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_B2 = types.Array(types.boolean, 2, "C")
_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]
_WIND_X, _WIND_Y = INDEX["wind_x"], INDEX["wind_y"]


@njit(cache=True)
def wrap(angle: float) -> float:
    """The same angle between -π and π."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit(cache=True)
def set_wind(row: Any, wind: Any, yaw: float) -> None:
    """Write a wind given in the map's frame into a row, seen from the body."""
    c, s = math.cos(yaw), math.sin(yaw)
    row[_WIND_X] = c * wind[0] + s * wind[1]
    row[_WIND_Y] = c * wind[1] - s * wind[0]


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F1, _F1, _F1, types.float64, types.float64, types.float64),
        *(types.float64, types.float64, types.float64, types.int64, _F1, _F2),
    ),
    cache=True,
    error_model="numpy",
)
def _step_cost(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    row: Any,
    limits: Any,
    wind: Any,
    slope_x: float,
    slope_y: float,
    yaw: float,
    direction: float,
    length: float,
    turn: float,
    objective: int,
    account: Any,
    per_wheel: Any,
) -> float:
    """Cost of one straight step during which the body turns by ``turn``; infinity if impossible."""
    stretch = set_motion(row, slope_x, slope_y, yaw, direction, 1.0)
    vx, vy = row[_VX], row[_VY]
    set_wind(row, wind, yaw)
    surface = length * stretch
    speed = limits[0]
    if abs(turn) > 1e-12:
        speed = min(speed, limits[6] * surface / abs(turn))
    cost = np.inf
    # As fast as the limits let it: the speed programme finds the best speed afterwards.
    for _ in range(7):
        time = surface / speed
        row[_VX], row[_VY] = vx * speed, vy * speed
        row[_WZ] = turn / time
        watts = kernel(row, parameters, body, wheels, account, per_wheel)
        if broken_limit(account, limits, BRIEFLY if turn != 0.0 else 1.0) < 0:
            cost = time if objective == 1 else watts * time
            break
        speed *= 0.85
    row[_WZ] = 0.0
    return cost


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F2, _F1, _F1, types.int64),
        *(_I1, _F1, _F1, _F1, _F1, _F1, _I1),  # knots and their directions; steps
        *(_B2, _F2, types.float64, types.float64, types.float64, _I1),
    ),
    cache=True,
    error_model="numpy",
)
def _programme(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    class_rows: Any,
    limits: Any,
    wind: Any,
    objective: int,
    knots: Any,
    knot_directions: Any,
    directions: Any,
    lengths: Any,
    slope_x: Any,
    slope_y: Any,
    ground: Any,
    free: Any,
    spin_cost: Any,
    stop_cost: float,
    start_yaw: float,
    goal_yaw: float,
    states: Any,
) -> Any:
    """Cost of the best yaw; ``states`` (2·knots,) gets the state before and after each knot."""
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    rows = class_rows.copy()
    count = knots.shape[0]
    width = 2.0 * math.pi / STATES
    cost = np.full((count, STATES), np.inf)
    driven = np.full((count, STATES), np.inf)
    came = np.full((count, STATES), -1, np.int64)  # state at the knot before
    spun = np.full((count, STATES), -1, np.int64)  # state before a turn on the spot, at this knot
    for s in range(STATES):
        if free[0, s]:
            driven[0, s] = 0.0
    if not math.isnan(start_yaw):
        for s in range(STATES):
            driven[0, s] = np.inf
        nearest = int(round(wrap(start_yaw - knot_directions[0]) / width)) % STATES
        driven[0, nearest] = 0.0
    for k in range(count):
        # Turning on the spot: cheapest way round the ring, both ways, stopping once.
        for s in range(STATES):
            cost[k, s] = driven[k, s]
            spun[k, s] = s
        halt = stop_cost if 0 < k < count - 1 else 0.0
        for s in range(STATES):
            if driven[k, s] == np.inf:
                continue
            for way in (1, -1):
                total, at = driven[k, s] + halt, s
                for _ in range(STATES // 2 - 1):
                    following = (at + way) % STATES
                    if not free[k, following]:
                        break
                    total += 0.5 * (spin_cost[k, at] + spin_cost[k, following]) * width
                    at = following
                    if total < cost[k, at]:
                        cost[k, at] = total
                        spun[k, at] = s
        if k == count - 1:
            break
        bend = wrap(knot_directions[k + 1] - knot_directions[k])
        span = 0.0
        for j in range(knots[k], knots[k + 1]):
            span += lengths[j]
        # No further than the yaw rate allows at full speed, and one state more.
        window = min(WINDOW, 1 + int(math.ceil(limits[6] * span / limits[0] / width)))
        for s in range(STATES):
            if cost[k, s] == np.inf:
                continue
            yaw_a = knot_directions[k] + s * width
            for w in range(-window, window + 1):
                t = (s + w) % STATES
                if not free[k + 1, t]:
                    continue
                turn = bend + w * width
                total = cost[k, s]
                done = 0.0
                for j in range(knots[k], knots[k + 1]):
                    share = lengths[j] / span
                    yaw = yaw_a + turn * (done + 0.5 * share)
                    done += share
                    total += _step_cost(
                        kernel,
                        parameters,
                        body,
                        wheels,
                        rows[ground[j]],
                        limits,
                        wind,
                        slope_x[j],
                        slope_y[j],
                        yaw,
                        directions[j],
                        lengths[j],
                        turn * share,
                        objective,
                        account,
                        per_wheel,
                    )
                    if total >= driven[k + 1, t]:
                        break
                if total < driven[k + 1, t]:
                    driven[k + 1, t] = total
                    came[k + 1, t] = s
    last = count - 1
    best, at = np.inf, -1
    if math.isnan(goal_yaw):
        for s in range(STATES):
            if cost[last, s] < best:
                best, at = cost[last, s], s
    else:
        at = int(round(wrap(goal_yaw - knot_directions[last]) / width)) % STATES
        best = cost[last, at]
    if best < np.inf:
        for k in range(last, -1, -1):
            states[2 * k + 1] = at
            at = spun[k, at]
            states[2 * k] = at
            at = came[k, at]
    return best


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
    model: PowerModel,
    field: CostField,
    track: Track,
    slopes: Array,
    grounds: NDArray[np.int64],
    class_rows: Array,
    limits: Array,
    wind: Array,
    *,
    objective: int,
    start_yaw: float | None,
    goal_yaw: float | None,
) -> YawProfile | None:
    """Best yaw along a track, or None where no sequence of free yaw angles leads through.

    Args:
        model: the power model.
        field: map and costs, for the free yaw angles.
        track: stations.
        slopes: (steps, 2) gradient at the middle of every step.
        grounds: (steps,) ground class of every step.
        class_rows: (classes, ROW_LENGTH) conditions.
        limits: of steady.limit_values with the yaw rate behind.
        wind: (2,) m/s in the map's frame.
        objective: 1 minimises time, anything else energy.
        start_yaw, goal_yaw: rad; None leaves them free.
    """
    knots = _knots(track)
    directions = _knot_directions(track, knots)
    free, spin, stop = _free_and_spin(
        model, field, track, knots, directions, slopes, grounds, class_rows, limits, objective
    )
    states = np.full(2 * len(knots), -1, np.int64)
    cost = _programme(
        model.kernel,
        model.parameters,
        model.body,
        model.wheels,
        class_rows,
        limits,
        wind,
        objective,
        knots,
        directions,
        track.directions,
        track.lengths,
        np.ascontiguousarray(slopes[:, 0]),
        np.ascontiguousarray(slopes[:, 1]),
        grounds,
        free,
        spin,
        stop,
        math.nan if start_yaw is None else start_yaw,
        math.nan if goal_yaw is None else goal_yaw,
        states,
    )
    if not math.isfinite(cost):
        return None
    return _spread(track, knots, directions, states, cost, start_yaw, goal_yaw)


def _knots(track: Track) -> NDArray[np.int64]:
    """Stations at which yaw is decided: all fixed ones, others at even distances."""
    along = np.concatenate([[0.0], np.cumsum(track.lengths)])
    spacing = max(0.2, along[-1] / MOST_KNOTS)
    chosen = [0]
    for k in range(1, len(along) - 1):
        if along[k] - along[chosen[-1]] >= spacing or track.stops[k]:
            chosen.append(k)
    return np.array([*chosen, len(along) - 1], np.int64)


def _knot_directions(track: Track, knots: NDArray[np.int64]) -> Array:
    """Direction of travel at the knots: between that of the step before and the step after."""
    before = track.directions[np.maximum(knots - 1, 0)]
    after = track.directions[np.minimum(knots, len(track.directions) - 1)]
    turn = np.remainder(after - before + np.pi, 2.0 * np.pi) - np.pi
    return np.asarray(before + 0.5 * turn)


def _free_and_spin(
    model: PowerModel,
    field: CostField,
    track: Track,
    knots: NDArray[np.int64],
    directions: Array,
    slopes: Array,
    grounds: NDArray[np.int64],
    class_rows: Array,
    limits: Array,
    objective: int,
) -> tuple[NDArray[np.bool_], Array, float]:
    """Free states at the knots, cost of turning on the spot per rad, cost of one stop."""
    width = 2.0 * math.pi / STATES
    free = _free_states(field, track.points[knots], directions, width)
    rate = float(limits[6])
    steps = np.minimum(knots, len(slopes) - 1)
    rows = np.repeat(class_rows[grounds[steps]], STATES, axis=0)
    yaw = (directions[:, None] + width * np.arange(STATES)).ravel()
    for row, angle, step in zip(rows, yaw, np.repeat(steps, STATES), strict=True):
        set_motion(row, slopes[step, 0], slopes[step, 1], angle, 0.0, 0.0)
    rows[:, _WZ] = rate
    watts = model.watts(rows)
    per_rad = np.ones_like(watts) if objective == 1 else watts
    spin = np.maximum(per_rad, 0.0).reshape(len(knots), STATES) / rate
    # Speeding up again after a stop: kinetic energy with the rotors', of which braking returns
    # little, and the time lost on both ramps.
    v, a = float(limits[0]), model.vehicle.limits.acceleration
    if objective == 1:
        return free, np.ascontiguousarray(spin), v / a
    cruise = class_rows[:1].copy()
    cruise[0, INDEX["vx"]] = v
    ramp = np.repeat(cruise, 8, axis=0)
    ramp[:, INDEX["vx"]] *= (np.arange(8) + 0.5) / 8.0
    ramp[:, INDEX["ax"]] = a
    up = float(model.watts(ramp).mean()) * v / a
    ramp[:, INDEX["ax"]] = -a
    down = float(model.watts(ramp).mean()) * v / a
    return free, np.ascontiguousarray(spin), up + down - float(model.watts(cruise)[0]) * v / a


@njit(cache=True, error_model="numpy")
def _free_states(field: Any, points: Any, directions: Any, width: float) -> Any:
    ny, nx = field.heights.shape
    free = np.ones((points.shape[0], STATES), np.bool_)
    whole = np.uint64((1 << YAW_BINS) - 1)
    for k in range(points.shape[0]):
        x, y = points[k]
        i = min(max(int(math.floor((x - field.x0) / field.dx + 0.5)), 0), nx - 1)
        j = min(max(int(math.floor((y - field.y0) / field.dy + 0.5)), 0), ny - 1)
        if field.mask[j, i] == whole:
            continue
        for s in range(STATES):
            free[k, s] = rectangle_free(
                field.blocked,
                field.x0,
                field.y0,
                field.dx,
                field.dy,
                x,
                y,
                directions[k] + s * width,
                field.half_length,
                field.half_width,
            )
    return free


def _spread(
    track: Track,
    knots: NDArray[np.int64],
    directions: Array,
    states: NDArray[np.int64],
    cost: float,
    start_yaw: float | None,
    goal_yaw: float | None,
) -> YawProfile:
    """Yaw at all stations, even in distance between the knots and without jumps of 2π."""
    width = 2.0 * math.pi / STATES
    arriving_at = directions + width * states[0::2]
    leaving_at = directions + width * states[1::2]
    if start_yaw is not None:
        arriving_at[0] = start_yaw
        if states[0] == states[1]:
            leaving_at[0] = start_yaw
    if goal_yaw is not None:
        leaving_at[-1] = goal_yaw
        if states[-2] == states[-1]:
            arriving_at[-1] = goal_yaw
    along = np.concatenate([[0.0], np.cumsum(track.lengths)])
    arriving = np.empty(len(along))
    leaving = np.empty(len(along))
    arriving[0] = arriving_at[0]
    yaw = arriving[0] + math.remainder(leaving_at[0] - arriving[0], 2.0 * math.pi)
    leaving[0] = yaw
    for k in range(len(knots) - 1):
        a, b = knots[k], knots[k + 1]
        turn = math.remainder(arriving_at[k + 1] - yaw, 2.0 * math.pi)
        share = (along[a + 1 : b + 1] - along[a]) / (along[b] - along[a])
        arriving[a + 1 : b + 1] = yaw + turn * share
        leaving[a + 1 : b] = arriving[a + 1 : b]
        yaw = arriving[b] + math.remainder(leaving_at[k + 1] - arriving[b], 2.0 * math.pi)
        leaving[b] = yaw
    return YawProfile(arriving, leaving, cost)
