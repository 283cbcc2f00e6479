"""Estimates of the yaw profile: costs of driving at an even angle, before the power model prices.

steady_costs_of(field, at, steps, stride, steady)

The cost of turning on the move is in planner.search.turns.turning_table.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner.compiled_code import njit
from planner.search.resolution import STATES
from planner.search.steady import costs_for_yaws

DOUBTFUL = 10.0
"""Factor on the highest cost known, as the cost of what the tables refuse: priced last."""


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
