"""What no effect needs to explain on held-out runs: usual errors, and how a robot holds a slope.

    columns = unsure_power(log, base, given)     # (n, k) W, or None where they predict no better

Friction at rest takes any value between helping the motors and hindering them. The power model has
it help. How the robot came to stand decides, and its controller: one that pushed it there drives
through the gear, and Coulomb friction holds nothing. That is no property of the robot. So where
held-out runs show that it stands otherwise, they may explain its power at rest by that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.arrays import Array
from planner.power.kernel_math import SLIDING_SPEED
from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import heldout_residual, rms, supports
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import predict


def unsure_power(log: Telemetry, base: Fit, given: Array) -> Array | None:
    """(n, k) W, what may explain parts of held-out residuals; None where it predicts no better.

    Args:
        log: the rows.
        base: the base model fitted to them.
        given: (n, m) W per standard deviation, usual errors of data sheet and sensors.
    """
    plain, beside = heldout_residual(log, base), heldout_residual(log, base, given)
    kept, least = (given, beside) if rms(beside) < rms(plain) else (given[:, :0], plain)
    unhelped = holding(log, base.model, base.watts)
    if np.any(unhelped):
        both = np.column_stack([kept, unhelped])
        if supports(log, least, heldout_residual(log, base, both), base.spread):
            return both
    return kept if kept.shape[1] else None


def holding(log: Telemetry, model: PowerModel, watts: Array) -> Array:
    """(n,) W more that a standing robot needs on a slope where friction does not help to hold it.

    Args:
        log: the rows.
        model: the model.
        watts: (n,) W that it says for them.
    """
    level = log.rows.copy()
    vx, vy, wz = (level[:, INDEX[name]] for name in ("vx", "vy", "wz"))
    corner = 0.5 * float(np.hypot(model.vehicle.length, model.vehicle.width))
    stands = np.hypot(vx, vy) + corner * np.abs(wz) < SLIDING_SPEED
    if not np.any(stands):
        return np.zeros(len(log))
    for name in ("gravity_x", "gravity_y"):
        level[stands, INDEX[name]] = 0.0
    flat = replace(log, rows=level)
    values, names = model.parameters.copy(), model.parameter_names
    gear = names.index(("gear_loss", "efficiency", 0))
    efficiency, values[gear] = float(values[gear]), 1.0
    values[names.index(("coulomb_drag", "coulomb_torque", 0))] = 0.0
    smooth = replace(model, parameters=values)
    driven = (predict(smooth, log) - predict(smooth, flat)) / efficiency**2
    return np.asarray(driven - (watts - predict(model, flat)))
