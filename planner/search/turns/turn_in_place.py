"""Turning on the spot: the angles to the travel at which a body may stand, and the ways between.

spin_costs(kernel, ..., spin)            # per rad, at every knot and angle
spin_round(driven, free, ...)            # the cheapest way round the ring at one knot
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.limits import BRIEFLY, broken_in_block
from planner.power.motion_row import empty_block, put_row, set_motion
from planner.quantities import INDEX
from planner.search.resolution import STATES, WIDTH

SPUN = 4
"""Turning on the spot is priced at every so many states, and evenly in between."""

_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_I1 = types.Array(types.int64, 1, "C")
_WZ = INDEX["wz"]


@njit(
    types.void(
        *(BLOCK_KERNEL, _F1, _F1, _F2, _F2, _F1, _F1, _F2, _I1, types.int64, _F2),
    ),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def spin_costs(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    class_rows: Any,
    limits: Any,
    directions: Any,
    slopes: Any,
    ground: Any,
    objective: int,
    spin: Any,
) -> None:
    """Cost per rad of turning on the spot at every knot and state (knots, STATES), into ``spin``.

    Infinite where a limit would be broken.
    """
    columns, found = empty_block()
    row = np.empty(class_rows.shape[1])
    rate = limits[6]
    priced = STATES // SPUN
    together = BLOCK // priced  # knots in a block
    for first in range(0, directions.shape[0], together):
        knots = min(together, directions.shape[0] - first)
        for place in range(knots * priced):
            k, s = first + place // priced, place % priced * SPUN
            row[:] = class_rows[ground[k]]
            row[_WZ] = rate
            set_motion(row, slopes[k, 0], slopes[k, 1], directions[k] + s * WIDTH, 0.0, 0.0)
            put_row(columns, place, row)
        kernel(columns, knots * priced, parameters, body, wheels, found)
        for place in range(knots * priced):
            k, s = first + place // priced, place % priced * SPUN
            spin[k, s] = max(1.0 if objective == 1 else found[place], 0.0) / rate
            if broken_in_block(found, place, limits, BRIEFLY) >= 0:
                spin[k, s] = np.inf
    for k in range(directions.shape[0]):
        for s in range(STATES):
            low = s - s % SPUN
            share = (s - low) / SPUN
            if share > 0.0:
                spin[k, s] = (1.0 - share) * spin[k, low] + share * spin[k, (low + SPUN) % STATES]


@njit(cache=True, error_model="numpy", nogil=True, inline="always")
def spin_round(driven: Any, free: Any, spin_cost: Any, halt: float, cost: Any, spun: Any) -> None:
    """Turning on the spot at one knot: cheapest way round the ring, both ways, stopping once."""
    dearest = 0.0  # where the body may stand; what costs more to turn from helps nowhere
    for s in range(STATES):
        cost[s] = driven[s]
        spun[s] = s
        if free[s]:
            dearest = max(dearest, driven[s])
    for s in range(STATES):
        if driven[s] + halt >= dearest:
            continue
        for way in (1, -1):
            total, at = driven[s] + halt, s
            for _ in range(STATES // 2 - 1):
                following = (at + way) % STATES
                if not free[following]:
                    break
                total += 0.5 * (spin_cost[at] + spin_cost[following]) * WIDTH
                if total >= dearest:
                    break
                at = following
                if total < cost[at]:
                    cost[at] = total
                    spun[at] = s
