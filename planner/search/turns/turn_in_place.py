"""Turning on the spot: its cost at every angle to the travel, and the cheapest turn between two.

spin_costs(kernel, arrays, ..., spin)    # per rad, at every waypoint and angle
spin_round(driven, free, ...)            # the cheapest turns round the ring at one waypoint
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from planner.compiled_code import njit
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.limits import broken_in_block
from planner.power.motion_row import empty_block, fill_row, put, put_row, set_motion
from planner.quantities import INDEX
from planner.search.kernel_arguments import EAGER, F1, F2, I1, MODEL_ARRAYS
from planner.search.resolution import SPIN_UP, STATES, WIDTH

SPUN = 4
"""Turning on the spot is priced at every so many states, and interpolated in between."""

_WZ, _YAW_ACCELERATION = INDEX["wz"], INDEX["yaw_acceleration"]


@njit(types.void(BLOCK_KERNEL, MODEL_ARRAYS, F1, F2, I1, types.int64, types.float64, F2), **EAGER)
def spin_costs(
    kernel: Any,
    arrays: Any,
    directions: Any,
    slopes: Any,
    ground: Any,
    objective: int,
    gentle: float,
    spin: Any,
) -> None:
    """Cost per rad of turning on the spot at every waypoint and state, into ``spin``.

    ``directions``, ``slopes`` and ``ground`` (n, ...) are those at the waypoints, ``spin``
    (n, STATES) is infinite where a limit would be broken. Above the slope ``gentle`` they hold
    while the body turns faster and faster as well.
    """
    parameters, body, wheels, class_rows, limits, _ = arrays
    columns, found = empty_block()
    row = np.empty(class_rows.shape[1])
    rate = limits[6]
    priced = STATES // SPUN
    together = BLOCK // priced  # waypoints in a block
    for first in range(0, directions.shape[0], together):
        waypoints = min(together, directions.shape[0] - first)
        for place in range(waypoints * priced):
            k, s = first + place // priced, place % priced * SPUN
            fill_row(row, class_rows[ground[k]])
            row[_WZ] = rate
            set_motion(row, slopes[k, 0], slopes[k, 1], directions[k] + s * WIDTH, 0.0, 0.0)
            put_row(columns, place, row)
        kernel(columns, waypoints * priced, parameters, body, wheels, found)
        for place in range(waypoints * priced):
            k, s = first + place // priced, place % priced * SPUN
            spin[k, s] = max(1.0 if objective == 1 else found[place], 0.0) / rate
            if broken_in_block(found, place, limits) >= 0:
                spin[k, s] = np.inf
            put(columns, place, _YAW_ACCELERATION, SPIN_UP * rate)
        steep = np.hypot(slopes[first : first + waypoints, 0], slopes[first : first + waypoints, 1])
        if steep.max() <= gentle:
            continue
        kernel(columns, waypoints * priced, parameters, body, wheels, found)
        for place in range(waypoints * priced):
            if broken_in_block(found, place, limits) >= 0 and steep[place // priced] > gentle:
                spin[first + place // priced, place % priced * SPUN] = np.inf
    for k in range(directions.shape[0]):
        for s in range(STATES):
            low = s - s % SPUN
            share = (s - low) / SPUN
            if share > 0.0:
                spin[k, s] = (1.0 - share) * spin[k, low] + share * spin[k, (low + SPUN) % STATES]


@njit(cache=True, error_model="numpy", nogil=True, inline="always")
def spin_round(driven: Any, free: Any, spin_cost: Any, halt: float, cost: Any, spun: Any) -> None:
    """Turning on the spot at one waypoint: the cheapest turns round the ring, both ways round.

    Args:
        driven: (STATES,) cost of arriving with each state.
        free: (STATES,) whether the body fits.
        spin_cost: (STATES,) cost per rad.
        halt: cost of the stop.
        cost: (STATES,) written: least cost of leaving with each state.
        spun: (STATES,) written: the state before the turn.
    """
    highest = 0.0  # of the free states; what costs more to turn from helps nowhere
    for s in range(STATES):
        cost[s] = driven[s]
        spun[s] = s
        if free[s]:
            highest = max(highest, driven[s])
    for s in range(STATES):
        if driven[s] + halt >= highest:
            continue
        for side in (1, -1):
            total, at = driven[s] + halt, s
            for _ in range(STATES // 2 - 1):
                following = (at + side) % STATES
                if not free[following]:
                    break
                total += 0.5 * (spin_cost[at] + spin_cost[following]) * WIDTH
                if total >= highest:
                    break
                at = following
                if total < cost[at]:
                    cost[at] = total
                    spun[at] = s
