"""The limits of a vehicle, and which of them an account of the power model breaks.

limits = limit_values(model, payload)
watts = kernel(row, ..., account, per_wheel)
broken_limit(account, limits)                   # a number into LIMIT_NAMES, or -1
broken_in_block(found, k, limits)               # the same for row k of a block

These hold at every moment. What a motor may do for a while, it may not do for long:

torques = gear_torques(model, rows)             # (n, motors)
rms_torques(torques, seconds, thermal_time)     # of the time before, the largest in each row
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.compiled_code import njit
from planner.power.account import ACCOUNT, ACCOUNT_LENGTH, LIMITS, PER_WHEEL, PerWheel
from planner.power.kernels import BLOCK, KERNEL
from planner.power.model import PowerModel

LIMIT_NAMES = ("wheel load", "traction", "current", "voltage", "torque peak")
"""What holds at every moment, by the power model."""
_IN_ACCOUNT = ACCOUNT.index(next(iter(LIMITS)))
_IN_RESULTS = 1  # of a block kernel; the power comes first
_GEAR_TORQUE = int(PerWheel.GEAR_TORQUE)
_WIDTHS = (ACCOUNT_LENGTH, len(PER_WHEEL))
_F1, _F2 = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")


@njit(cache=True, inline="always")
def _broken(values: Any, first: int, limits: Any) -> int:
    """Number of the first broken limit; LIMITS stand in their order from ``first`` on."""
    if values[first] <= 0.0:
        return 0
    if values[first + 4] < 0.0:
        return 1
    if values[first + 1] > limits[1]:
        return 2
    if values[first + 2] > limits[2]:
        return 3
    if values[first + 3] > limits[3]:
        return 4
    return -1


@njit(cache=True)
def broken_limit(account: Any, limits: Any) -> int:
    """Number of the first limit that an account breaks (LIMIT_NAMES), or -1.

    Args:
        account: what the power model wrote.
        limits: [speed, current, voltage, peak torque, ...].
    """
    return _broken(account, _IN_ACCOUNT, limits)


@njit(cache=True)
def broken_in_block(found: Any, k: int, limits: Any) -> int:
    """As ``broken_limit`` for place ``k`` of what the model found for a block."""
    return _broken(found[k::BLOCK], _IN_RESULTS, limits)


@njit(cache=True)
def broken_in_results(results: Any, limits: Any) -> int:
    """As ``broken_limit`` for one row of ``PowerModel.power_and_limits``."""
    return _broken(results, _IN_RESULTS, limits)


def limit_values(model: PowerModel, payload: float) -> NDArray[np.float64]:
    """[speed, current, voltage, peak torque, mass with payload, largest tan(slope)]."""
    limits = model.vehicle.limits
    return np.array(
        [
            limits.speed,
            limits.current,
            limits.voltage,
            limits.peak_torque,
            model.vehicle.mass + payload,
            math.tan(math.radians(60.0)),
        ]
    )


def gear_torques(model: PowerModel, rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """N·m that the gear takes from every motor, without its sign, (n, motors).

    Args:
        model: power model.
        rows: (n, ROW_LENGTH).
    """
    torques = np.empty((len(rows), len(model.wheels)))
    rows = np.ascontiguousarray(rows, dtype=float)
    _gear_torques(model.kernel, rows, model.parameters, model.body, model.wheels, torques)
    return torques


@njit(types.void(KERNEL, _F2, _F1, _F1, _F2, _F2), cache=True, error_model="numpy", nogil=True)
def _gear_torques(
    kernel: Any, rows: Any, parameters: Any, body: Any, wheels: Any, torques: Any
) -> None:
    account = np.empty(_WIDTHS[0])
    per_wheel = np.empty((wheels.shape[0], _WIDTHS[1]))
    for k in range(rows.shape[0]):
        kernel(rows[k], parameters, body, wheels, account, per_wheel)
        for wheel in range(wheels.shape[0]):
            torques[k, wheel] = per_wheel[wheel, _GEAR_TORQUE]


def rms_torques(
    torques: NDArray[np.float64], seconds: NDArray[np.float64], thermal_time: float
) -> NDArray[np.float64]:
    """Root mean square of torques over the ``thermal_time`` before: the largest in every row.

    Before the first row a motor is unloaded. In a long row the largest need not come at its end: a
    motor that holds a robot on a slope warms up until the climb before no longer counts.

    Args:
        torques: (n,) or (n, motors) N·m.
        seconds: (n,) s that every row stands for.
        thermal_time: s.

    Returns:
        The same shape as ``torques``, N·m.
    """
    several = torques if torques.ndim == 2 else torques[:, None]
    time = np.append(0.0, np.cumsum(seconds))
    heat = np.vstack([np.zeros(several.shape[1]), np.cumsum(several**2 * seconds[:, None], axis=0)])

    def heat_at(moments: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.stack([np.interp(moments, time, column) for column in heat.T], axis=1)

    # Heat over the window is linear between the moments at which a row enters or leaves it.
    window = (heat[1:] - heat_at(time[1:] - thermal_time)) / thermal_time
    leaving = time[:-1] + thermal_time
    leaving = leaving[leaving < time[-1]]
    inside = (heat_at(leaving) - heat[: len(leaving)]) / thermal_time
    np.maximum.at(window, np.searchsorted(time[1:], leaving), inside)
    rms: NDArray[np.float64] = np.sqrt(np.maximum(window, 0.0)).reshape(torques.shape)
    return rms
