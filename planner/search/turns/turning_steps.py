"""Costs of steps during which the body turns evenly, very many at once.

    step_costs(kernel, arrays, objective, steps, at, moves, much, costs)

The speed profile finds the best speeds afterwards. Here every step is driven at the largest speed,
or at the next lower one of a few at which no limit is broken.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from planner.compiled_code import njit
from planner.power.account import LIMITS
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.limits import LIMIT_NAMES, broken_in_block
from planner.power.motion_row import empty_block, motion_on_plane, put, put_row
from planner.quantities import INDEX
from planner.search.kernel_arguments import EAGER, F1, F2, I1, MODEL_ARRAYS, STEPS
from planner.search.resolution import OFF_MIDDLE, SLOPE_SPEED, SLOWEST, STILL, WIDTH

TRIES = 7
"""Speeds that are tried on a step, down to 0.38 of the largest. Where none of them holds, a slow
one is tried: a bend near the slope limit takes torque that grows with the square of the speed."""
SLOWER = 0.85
"""Factor from one speed that is tried to the next."""
LITTLE = 0.1
"""Share of a state that a body turns on a steep step at most without a look at both ends. Rollers
of a body that turns may change the side to which they roll there, and their drag its sign."""
HOT = 1.0
"""Share by which a step counts more whose squared torque is twice that of the continuous one, where
slopes last: motors get too warm over many such steps, and any yaw that spares them comes first."""
_MIDDLE, _STEEPEST, _LATE, _EARLY, _LATER, _EARLIER = range(6)
"""Looks at a step; they are taken from the last to the first."""
_OFF = np.array([0.0, 0.0, OFF_MIDDLE, -OFF_MIDDLE, 0.5 * OFF_MIDDLE, -0.5 * OFF_MIDDLE])
"""Shares of the turn beyond the middle at which each look is taken."""
_SLOPES = np.array([0, 2, 4, 6, 2, 2])
"""Columns of a step's slopes for each look."""
_SLOWED = np.append(SLOWER ** np.arange(TRIES), SLOPE_SPEED)
_VOLTAGE = LIMIT_NAMES.index("voltage")
_TORQUE = 1 + list(LIMITS).index("motor_torque")
_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]
_GX, _GY, _GN = INDEX["gravity_x"], INDEX["gravity_y"], INDEX["gravity_normal"]
_WIND_X, _WIND_Y = INDEX["wind_x"], INDEX["wind_y"]
_AX, _AY = INDEX["ax"], INDEX["ay"]


@njit(
    types.void(BLOCK_KERNEL, MODEL_ARRAYS, types.int64, STEPS, I1, F2, types.float64, F1), **EAGER
)
def step_costs(
    kernel: Any,
    arrays: Any,
    objective: int,
    steps: Any,
    at: Any,
    moves: Any,
    much: float,
    costs: Any,
) -> None:
    """Cost of steps, (n,) into ``costs``; infinity where one is impossible.

    Limits hold in a step's middle, and on a steep one where it is steepest; where the body turns,
    at both ends as well, and where it turns much, between.

    Args:
        kernel: ``limits_kernel`` of the power model.
        arrays: ModelArrays.
        objective: 1 for s, anything else for J.
        steps: Steps of a track.
        at: (n,) which of them.
        moves: (n, 3) yaw in the middle in rad, horizontal length in m, turn in rad.
        much: rad; steps with larger turns are looked at between middle and ends, too: the angles
            there may hold, and those between them break a limit.
        costs: (n,) written.
    """
    parameters, body, wheels, class_rows, limits, wind = arrays
    directions, slopes, curvatures = steps.directions, steps.slopes, steps.curvatures
    steep, ground = steps.steep, steps.ground
    count = at.shape[0]
    columns, found = empty_block()
    waiting = np.arange(count)
    fastest = np.full(count, limits[0])
    look = np.empty(count, np.int64)
    tries = np.zeros(count, np.int64)
    back = np.zeros(count, np.int64)  # try to go back to, after the slowest
    surface = np.empty(BLOCK)
    # Rows keep their places in the block: only what differs from move to move is written again.
    held = np.full(BLOCK, -1)
    ux, uy = np.cos(directions), np.sin(directions)
    placed = np.empty(BLOCK, np.int64)
    for n in range(count):
        # On its arc, a body that does not follow a bend changes how it stands to the travel.
        bend = curvatures[at[n]] * moves[n, 1]
        turn = max(abs(moves[n, 2]), abs(moves[n, 2] - bend))
        look[n] = _MIDDLE
        if steep[at[n]]:
            look[n] = _EARLY if turn > LITTLE * WIDTH else _STEEPEST
            look[n] = _EARLIER if turn > much else look[n]
        costs[n] = np.inf
    while count:
        left = 0
        start = 0
        while start < count:
            size = 0
            while start < count and size < BLOCK:
                n = waiting[start]
                start += 1
                j, k = at[n], _SLOPES[look[n]]
                turn = moves[n, 2]
                yaw = moves[n, 0] + _OFF[look[n]] * turn
                c, s = math.cos(yaw), math.sin(yaw)
                along, across = ux[j], uy[j]
                if look[n] >= _LATE:
                    bent = _OFF[look[n]] * curvatures[j] * moves[n, 1]
                    # On the arc or on its chord, whichever the body turns more against.
                    if abs(_OFF[look[n]] * turn - bent) > abs(_OFF[look[n]] * turn):
                        bent += directions[j]
                        along, across = math.cos(bent), math.sin(bent)
                vx, vy, gx, gy, gn, stretch = motion_on_plane(
                    slopes[j, k], slopes[j, k + 1], c, s, along, across
                )
                surface[size] = moves[n, 1] * stretch
                if tries[n] == 0 and abs(turn) > STILL:
                    fastest[n] = min(fastest[n], limits[6] * surface[size] / abs(turn))
                    if fastest[n] < 1.1 * SLOWEST * limits[0]:
                        continue
                # Off the middle, what no slowness mends counts: a bend may help a fast robot.
                bend = curvatures[j] if steep[j] and look[n] < _LATE else 0.0
                if tries[n] == 0 and bend != 0.0:
                    fastest[n] = min(fastest[n], math.sqrt(limits[7] / abs(bend)))
                speed = fastest[n] * _SLOWED[tries[n]]
                if held[size] != ground[j]:
                    held[size] = ground[j]
                    put_row(columns, size, class_rows[ground[j]])
                put(columns, size, _VX, vx * speed)
                put(columns, size, _VY, vy * speed)
                put(columns, size, _WZ, turn / (surface[size] / speed))
                sideways = speed * speed * bend
                put(columns, size, _AX, -sideways * vy)
                put(columns, size, _AY, sideways * vx)
                put(columns, size, _GX, gx)
                put(columns, size, _GY, gy)
                put(columns, size, _GN, gn)
                put(columns, size, _WIND_X, c * wind[0] + s * wind[1])
                put(columns, size, _WIND_Y, c * wind[1] - s * wind[0])
                placed[size] = n
                size += 1
            kernel(columns, size, parameters, body, wheels, found)
            for place in range(size):
                n = placed[place]
                broken = broken_in_block(found, place, limits)
                if broken >= 0:
                    if tries[n] == TRIES:
                        continue
                    tries[n] += 1
                    # Going slower rarely helps here: all the other speeds fail with the slowest.
                    if broken != _VOLTAGE and back[n] == 0:
                        back[n], tries[n] = tries[n], TRIES
                elif 0 < back[n] < tries[n]:
                    tries[n], back[n] = back[n], TRIES
                elif look[n] == _MIDDLE:
                    time = surface[place] / (fastest[n] * _SLOWED[tries[n]])
                    costs[n] = time if objective == 1 else found[place] * time
                    over = (found[_TORQUE * BLOCK + place] / limits[8]) ** 2 - 1.0
                    costs[n] += HOT * max(over, 0.0) * abs(costs[n])
                    continue
                else:
                    fastest[n] *= _SLOWED[tries[n]]
                    look[n], tries[n], back[n] = look[n] - 1, 0, 0
                waiting[left] = n  # behind the place that is read: no block grows
                left += 1
        count = left
