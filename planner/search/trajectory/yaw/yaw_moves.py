"""Moves of the yaw profile: where it is decided, how far it may turn between, and what is priced.

    turn_to_what_holds(kernel, arrays, limit, at, directions, steps, free, shift)
    steady_costs_of(field, at, steps, stride, steady)      # estimates, before the model prices
    pieces = pieces_of(waypoints, lengths, crowded, limits)
    asked, moves, pairs = moves_near(surroundings, lengths, waypoints, pieces, ...)

yaw_kernel chooses among the moves. The cost of turning on the move is in
planner.search.turns.turning_table.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.limits import broken_in_block
from planner.power.motion_row import empty_block, fill_row, put_row, set_motion, set_wind
from planner.search.kernel_arguments import (
    B1,
    B2,
    EAGER,
    F1,
    F2,
    I1,
    MODEL_ARRAYS,
    STEPS,
    tuple_type,
)
from planner.search.resolution import DIRECTIONS, STATES, WIDTH
from planner.search.steady import costs_for_yaws
from planner.terrain.footprint import touches

ANGLES = 7
"""Angles that a state may stand for, 0.8° apart, where few of them keep a limit."""
HARDLY = 0.9
"""Share of the slope limit from which they are looked at: the angles that keep it then lie within
few degrees, and the closer to the limit, the fewer."""
SLOW = 0.4
"""Share of full speed at which they are: what breaks a limit then, hardly any speed keeps."""
DOUBTFUL = 10.0
"""Factor on the highest cost known, as the cost of what the tables refuse: priced last."""
MOST_SAMPLES = 2
"""Steps that stand for all between two waypoints, where there are more than three."""
WIDEST_TURN = 8
"""Largest change of the angle to the travel between waypoints, in states (45°). It bounds how many
pairs of angles are priced; half changes answers by 0.06 % at most (benchmarks/ablations.md)."""


class Surroundings(NamedTuple):
    """What a body may touch along a track.

    Attributes:
        blocked, frame: as for ``planner.terrain.footprint.touches``.
        points: (samples, 2) m.
        crowded: (samples,) whether some yaw does not fit there.
    """

    blocked: NDArray[np.bool_]
    frame: Array
    points: Array
    crowded: NDArray[np.bool_]


class Waypoints(NamedTuple):
    """Places on a track at which the yaw is decided.

    Attributes:
        at: (n,) samples of the track.
        directions: (n,) rad, of the travel.
        stride: (n - 1,) every so many of the steps after a waypoint stands for the others.
        steady: (n - 1, STATES) estimated cost to the next waypoint at an even angle.
        free: (n, STATES) whether the body fits.
        shift: (n, STATES) rad by which its angle is off the state's own so that it does.
        spin: (n, STATES) cost per rad of turning on the spot.
    """

    at: NDArray[np.int64]
    directions: Array
    stride: NDArray[np.int64]
    steady: Array
    free: NDArray[np.bool_]
    shift: Array
    spin: Array


class Pieces(NamedTuple):
    """Stretches between two waypoints, (n - 1,) each.

    Attributes:
        spans: m.
        bends: rad by which the travel turns.
        scale: m that a metre of the steps that are looked at stands for.
        samples: steps that are looked at.
        window: states by which the angle to the travel may change at most.
        narrow: whether the body may touch something.
        price: (n - 1, changes of the angle to the travel, STATES) exact, by the state before; NaN
            where it is not known.
        off: by which exact prices differ from estimates.
    """

    spans: Array
    bends: Array
    scale: Array
    samples: NDArray[np.int64]
    window: NDArray[np.int64]
    narrow: NDArray[np.bool_]
    price: NDArray[np.float32]
    off: Array


SURROUNDINGS = tuple_type(Surroundings, B2, F1, F2, B1)
WAYPOINTS = tuple_type(Waypoints, I1, F1, I1, F2, B2, F2, F2)
PIECES = tuple_type(Pieces, F1, F1, F1, I1, I1, B1, types.float32[:, :, ::1], F1)


@njit(cache=True)
def wrap(angle: float) -> float:
    """The same angle between -π and π."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit(cache=True)
def most_turn(span: float, bend: float, limits: Any) -> int:
    """States by which the angle to the travel may change over ``span`` metres with a bend."""
    # No further than the yaw rate allows at full speed, and one state more.
    window = min(WIDEST_TURN, 1 + int(math.ceil(limits[6] * span / limits[0] / WIDTH)))
    # Where the travel turns sharply the body may keep its yaw instead.
    return min(window + int(math.ceil(abs(bend) / WIDTH)), STATES // 2)


@njit(cache=True, error_model="numpy")
def _hardly_held(limit: Any, steps: Any, j: int) -> bool:
    """Whether few angles keep a limit on step ``j``, where it is steepest."""
    px, py = steps.slopes[j, 2], steps.slopes[j, 3]
    turns = (math.atan2(py, px) - steps.directions[j]) / (2.0 * math.pi)
    nearest = int(math.floor(turns * DIRECTIONS + 0.5)) % DIRECTIONS
    most: float = limit[steps.ground[j], nearest]
    return math.hypot(px, py) > HARDLY * most


@njit(cache=True, error_model="numpy")
def _middle_of_run(holds: Any, own: int) -> float:
    """Middle of those neighbouring angles that hold and are nearest to one's own; that without."""
    count = holds.shape[0]
    begin = -1
    for away in range(count):
        for n in (own - away, own + away):
            if begin < 0 and 0 <= n < count and holds[n]:
                begin = n
    if begin < 0:
        return own
    end = begin
    while begin > 0 and holds[begin - 1]:
        begin -= 1
    while end < count - 1 and holds[end + 1]:
        end += 1
    return 0.5 * (begin + end)


@njit(types.void(BLOCK_KERNEL, MODEL_ARRAYS, F2, I1, F1, STEPS, B2, F2), **EAGER)
def turn_to_what_holds(
    kernel: Any,
    arrays: Any,
    limit: Any,
    at: Any,
    directions: Any,
    steps: Any,
    free: Any,
    shift: Any,
) -> None:
    """Turn the body off the states' angles, into ``shift``, where these hardly keep to the limits.

    Near the slope limit the angles that keep it lie within less than a state: without the turn, no
    state may keep it. The turn is half a state at most.

    Args:
        kernel, arrays: of the power model.
        limit: (grounds, DIRECTIONS) slope limit with the best yaw, by azimuth to the travel.
        at, directions: (n,) samples that are waypoints, and the travel there, rad.
        steps: Steps between the samples.
        free: (n, STATES) which states may be turned.
        shift: (n, STATES) rad, brought up to date.
    """
    parameters, body, wheels, class_rows, limits, wind = arrays
    slopes, ground = steps.slopes, steps.ground
    columns, found = empty_block()
    row = np.empty(class_rows.shape[1])
    last = slopes.shape[0] - 1
    holds, middle = np.empty(ANGLES * STATES, np.bool_), ANGLES // 2
    for k in range(at.shape[0]):
        before, after = max(at[k] - 1, 0), min(at[k], last)
        if not (_hardly_held(limit, steps, before) or _hardly_held(limit, steps, after)):
            continue
        states = np.flatnonzero(free[k])
        count = ANGLES * states.size
        holds[:count] = True
        for j in (before, after):
            for first in range(0, count, BLOCK):
                size = min(BLOCK, count - first)
                for place in range(size):
                    state, angle = divmod(first + place, ANGLES)
                    yaw = directions[k] + (states[state] * ANGLES + angle - middle) * WIDTH / ANGLES
                    fill_row(row, class_rows[ground[j]])
                    set_motion(
                        *(row, slopes[j, 2], slopes[j, 3], yaw),
                        *(steps.directions[j], SLOW * limits[0]),
                    )
                    set_wind(row, wind, yaw)
                    put_row(columns, place, row)
                kernel(columns, size, parameters, body, wheels, found)
                for place in range(size):
                    holds[first + place] &= broken_in_block(found, place, limits) < 0
        for state, s in enumerate(states):
            own = holds[state * ANGLES : (state + 1) * ANGLES]
            if not own.all():
                place = int(round(shift[k, s] / WIDTH * ANGLES)) + middle
                shift[k, s] = (_middle_of_run(own, place) - middle) * WIDTH / ANGLES


@njit(cache=True, error_model="numpy", nogil=True)
def steady_costs_of(field: Any, at: Any, steps: Any, stride: Any, steady: Any) -> None:
    """Cost from each waypoint to the next at an even angle to the travel.

    Args:
        field: tables of steady costs by yaw.
        at: (n,) samples of the track that are waypoints.
        steps: Steps between the samples.
        stride: (n - 1,) every so many of the steps after a waypoint stands for the others.
        steady: (n - 1, STATES) written.
    """
    directions, lengths = steps.directions, steps.lengths
    slopes, ground = steps.slopes, steps.ground
    by_yaw, yaw_limit = field.by_yaw, field.yaw_limit
    costs = np.empty(STATES)
    for k in range(at.shape[0] - 1):
        first, last = at[k], at[k + 1]
        whole, taken = 0.0, 0.0
        for j in range(first, last):
            whole += lengths[j]
        steady[k] = 0.0
        for j in range(first + (stride[k] - 1) // 2, last, stride[k]):
            taken += lengths[j]
            steepness = math.sqrt(slopes[j, 0] ** 2 + slopes[j, 1] ** 2)
            azimuth = math.atan2(slopes[j, 1], slopes[j, 0]) - directions[j]
            costs_for_yaws(by_yaw, yaw_limit, ground[j], azimuth, steepness, 1.0, costs)
            for s in range(STATES):
                steady[k, s] += lengths[j] * costs[s]
        worst = 0.0
        for s in range(STATES):
            steady[k, s] *= whole / taken
            if steady[k, s] < np.inf:
                worst = max(worst, steady[k, s])
        # Near a limit the tables err on the safe side: what they refuse is tried in the end.
        for s in range(STATES):
            if steady[k, s] == np.inf:
                steady[k, s] = max(DOUBTFUL * worst, 1e6)


@njit(cache=True, error_model="numpy", nogil=True)
def _touching(
    blocked: Any,
    frame: Any,
    points: Any,
    first: int,
    last: int,
    lengths: Any,
    span: float,
    yaw: float,
    turn: float,
) -> bool:
    """Whether the body touches something between two samples while it turns evenly."""
    done = 0.0
    for j in range(first, last):
        share = lengths[j] / span
        x, y, to_x, to_y = points[j, 0], points[j, 1], points[j + 1, 0], points[j + 1, 1]
        if touches(blocked, frame, x, y, to_x, to_y, yaw + turn * done, turn * share):
            return True
        done += share
    return False


@njit(cache=True, error_model="numpy")
def pieces_of(waypoints: Any, lengths: Any, crowded: Any, limits: Any) -> Any:
    """Pieces between waypoints of a track with steps of these lengths, m."""
    at, stride = waypoints.at, waypoints.stride
    last = at.shape[0] - 1
    spans, bends, scale = np.zeros(last), np.empty(last), np.empty(last)
    samples, window = np.zeros(last, np.int64), np.empty(last, np.int64)
    narrow = np.empty(last, np.bool_)
    for k in range(last):
        taken = 0.0
        for j in range(at[k], at[k + 1]):
            spans[k] += lengths[j]
        for j in range(at[k] + (stride[k] - 1) // 2, at[k + 1], stride[k]):
            taken += lengths[j]
            samples[k] += 1
        scale[k] = spans[k] / taken
        narrow[k] = crowded[at[k] : at[k + 1] + 1].any()
        bends[k] = wrap(waypoints.directions[k + 1] - waypoints.directions[k])
        window[k] = most_turn(spans[k], bends[k], limits)
    price = np.full((last, 2 * int(window.max()) + 1, STATES), np.float32(np.nan))
    return Pieces(spans, bends, scale, samples, window, narrow, price, np.zeros(last))


@njit(cache=True, error_model="numpy")
def change_of(before: int, after: int) -> int:
    """Change of the angle from one state to another, the shorter way round."""
    return (after - before + STATES // 2) % STATES - STATES // 2


@njit(cache=True, error_model="numpy")
def moves_near(
    conditions: Any,
    lengths: Any,
    waypoints: Any,
    pieces: Any,
    states: Any,
    far: Any,
    most: int | np.int64,
) -> Any:
    """Moves to price near the best path: step (m,), move (m, 3), and the pair of states (m,).

    Pairs that touch something get an infinite price at once. ``far`` (n - 1,) is how many states
    off the path count, negative for none; ``most`` is how many moves that makes.
    """
    at, directions, stride, _, free, shift, _ = waypoints
    spans, bends, scale, _, window, narrow, price, _ = pieces
    blocked, frame, points, _ = conditions
    widest = price.shape[1] // 2
    asked, moves = np.empty(most, np.int64), np.empty((most, 3))
    pairs = np.empty(most, np.int64)
    size = 0
    for k in range(far.shape[0]):
        s, t = states[2 * k + 1], states[2 * k + 2]
        for a in range(s - far[k], s + far[k] + 1):
            for b in range(t - far[k], t + far[k] + 1):
                p, q = a % STATES, b % STATES
                w = change_of(p, q)
                if abs(w) > window[k] or not (free[k, p] and free[k + 1, q]):
                    continue
                if not math.isnan(price[k, w + widest, p]):
                    continue
                turn = wrap(bends[k] + w * WIDTH) + shift[k + 1, q] - shift[k, p]
                yaw = directions[k] + p * WIDTH + shift[k, p]
                price[k, w + widest, p] = 0.0
                if narrow[k] and _touching(
                    *(blocked, frame, points, at[k], at[k + 1], lengths, spans[k], yaw, turn)
                ):
                    price[k, w + widest, p] = np.inf
                    continue
                done = 0.0
                for j in range(at[k] + (stride[k] - 1) // 2, at[k + 1], stride[k]):
                    share = lengths[j] * scale[k] / spans[k]
                    asked[size] = j
                    moves[size, 0] = yaw + turn * (done + 0.5 * share)
                    moves[size, 1] = lengths[j] * scale[k]
                    moves[size, 2] = turn * share
                    pairs[size] = (k * price.shape[1] + w + widest) * STATES + p
                    done += share
                    size += 1
    return asked[:size], moves[:size], pairs[:size]
