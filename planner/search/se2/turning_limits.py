"""Slopes up to which the body can turn while it drives, by angle and direction of the slope.

    limits = turning_limits(conditions, curvatures, steepest)     # (curvatures, grounds, ...)

Rollers that stand while the body drives straight on roll once it turns, and that takes torque. At
most angles they roll anyway; there a turn takes next to nothing.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.kernels import BLOCK, BLOCK_KERNEL
from planner.power.limits import broken_in_block
from planner.power.motion_row import empty_block, fill_row, put_row, set_motion
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.kernel_arguments import EAGER, F1, F4, MODEL_ARRAYS
from planner.search.resolution import DIRECTIONS, SLOPE_SPEED, STATES, WIDTH

SLOPE_HALVINGS = 12
"""Bisections of every limit: to a few parts in ten thousand of the steepest slope."""
_WZ = INDEX["wz"]
_EITHER_SIDE = (1.0, -1.0)
"""Signs of a turn to the left and to the right."""


@njit(types.void(BLOCK_KERNEL, MODEL_ARRAYS, F1, types.float64, F4), **EAGER)
def _fill(kernel: Any, arrays: Any, curvatures: Any, steepest: float, limit: Any) -> None:
    parameters, body, wheels, class_rows, limits, _ = arrays
    columns, found = empty_block()
    row = np.empty(class_rows.shape[1])
    speed, together = SLOPE_SPEED * limits[0], BLOCK // len(_EITHER_SIDE)
    per_table = STATES * DIRECTIONS
    low, high = np.empty(together), np.empty(together)
    flat = limit.reshape(-1)
    for first in range(0, flat.shape[0], together):
        size = min(together, flat.shape[0] - first)
        low[:], high[:] = 0.0, steepest
        for _ in range(SLOPE_HALVINGS):
            for place in range(size):
                table, entry = divmod(first + place, per_table)
                turn, ground = divmod(table, class_rows.shape[0])
                state, direction = divmod(entry, DIRECTIONS)
                azimuth = 2.0 * math.pi * direction / DIRECTIONS
                slope = 0.5 * (low[place] + high[place])
                fill_row(row, class_rows[ground])
                set_motion(
                    *(row, slope * math.cos(azimuth), slope * math.sin(azimuth)),
                    *(state * WIDTH, 0.0, speed),
                )
                for side in range(2):
                    row[_WZ] = _EITHER_SIDE[side] * curvatures[turn] * speed
                    put_row(columns, 2 * place + side, row)
            kernel(columns, 2 * size, parameters, body, wheels, found)
            for place in range(size):
                slope = 0.5 * (low[place] + high[place])
                held = broken_in_block(found, 2 * place, limits) < 0
                if held and broken_in_block(found, 2 * place + 1, limits) < 0:
                    low[place] = slope
                else:
                    high[place] = slope
        flat[first : first + size] = low[:size]


def turning_limits(conditions: OperatingConditions, curvatures: Array, steepest: float) -> Array:
    """tan(slope) up to which the limits hold while the body turns to either side.

    (curvatures, grounds, STATES, DIRECTIONS), by angle to the travel and azimuth of the slope.

    Args:
        conditions: model and conditions of steady driving.
        curvatures: (n,) rad/m by which the body turns.
        steepest: tan(slope) up to which limits are looked for.
    """
    limit = np.empty((len(curvatures), len(conditions.class_rows), STATES, DIRECTIONS))
    _fill(conditions.model.limits_kernel, conditions.arrays, curvatures, steepest, limit)
    return limit
