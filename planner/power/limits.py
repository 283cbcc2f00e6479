"""The limits of a vehicle, and which of them an account of the power model breaks.

limits = limit_values(model, payload)
watts = kernel(row, ..., account, per_wheel)
broken_limit(account, limits, 1.0)              # a number into LIMIT_NAMES, or -1
broken_in_block(found, k, limits, 1.0)          # the same for row k of a block
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.compiled_code import njit
from planner.power.account import ACCOUNT, LIMITS
from planner.power.kernels import BLOCK
from planner.power.model import PowerModel

BRIEFLY = 2.0
"""Share of the continuous torque allowed on bends and ramps: a motor warms up in a minute."""

LIMIT_NAMES = ("wheel load", "traction", "current", "voltage", "continuous torque")
_IN_ACCOUNT = ACCOUNT.index(next(iter(LIMITS)))
_IN_RESULTS = 1  # of a block kernel; the power comes first


@njit(cache=True, inline="always")
def _broken(values: Any, first: int, limits: Any, ease: float) -> int:
    """Number of the first broken limit; LIMITS stand in their order from ``first`` on."""
    if values[first] <= 0.0:
        return 0
    if values[first + 4] < 0.0:
        return 1
    if values[first + 1] > limits[1]:
        return 2
    if values[first + 2] > limits[2]:
        return 3
    if values[first + 3] > limits[3] * ease:
        return 4
    return -1


@njit(cache=True)
def broken_limit(account: Any, limits: Any, ease: float) -> int:
    """Number of the first limit that an account breaks (LIMIT_NAMES), or -1.

    Args:
        account: what the power model wrote.
        limits: [speed, current, voltage, continuous torque, ...].
        ease: factor on the continuous torque, which is a thermal limit: 1 on the straight,
            BRIEFLY on what lasts a few seconds.
    """
    return _broken(account, _IN_ACCOUNT, limits, ease)


@njit(cache=True)
def broken_in_block(found: Any, k: int, limits: Any, ease: float) -> int:
    """As ``broken_limit`` for place ``k`` of what the model found for a block."""
    return _broken(found[k::BLOCK], _IN_RESULTS, limits, ease)


@njit(cache=True)
def broken_in_results(results: Any, limits: Any, ease: float) -> int:
    """As ``broken_limit`` for one row of ``PowerModel.power_and_limits``."""
    return _broken(results, _IN_RESULTS, limits, ease)


def limit_values(model: PowerModel, payload: float) -> NDArray[np.float64]:
    """[speed, current, voltage, continuous torque, mass with payload, largest tan(slope)]."""
    limits = model.vehicle.limits
    return np.array(
        [
            limits.speed,
            limits.current,
            limits.voltage,
            limits.continuous_torque,
            model.vehicle.mass + payload,
            math.tan(math.radians(60.0)),
        ]
    )
