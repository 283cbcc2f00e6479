"""What no effect needs to explain on held-out runs: usual errors, and what friction does at rest.

    columns = unsure_power(log, base, given)     # (n, k) W, or None where they predict no better

Friction at rest takes any value between helping the motors and hindering them. The power model has
it help. How the robot came to stand decides, and its controller: one that pushed it there drives
through the gear, and Coulomb friction holds nothing. That is no property of the robot. So where
held-out runs show that it stands otherwise, they may explain its power at rest by that.

Dry friction of a model changes side smoothly, in widths that nobody measures. Where it is complete
nearer to rest, a robot that starts needs more than the model says, as by stiction, but no more than
complete friction. A motor with a small gear ratio, and a meter that averages, make this last.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.arrays import Array
from planner.power.kernel_math import REST_SPEED, SLIDING_SPEED
from planner.power.kinematics import RIM
from planner.power.model import PowerModel
from planner.quantities import INDEX
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import heldout_residual, rms, supports
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import Nodes, Readings, predict

SOONER = 4.0
"""Factor on a creeping robot's speed at which its friction is complete, to a thirtieth at a speed
of one width."""
CREEPS_WITHIN = 8.0
"""Widths up to which a robot creeps; beyond, friction lacks less than a hundredth."""
USUAL_WIDTHS = 0.4
"""Standard deviation of what a friction may lack near rest, over all of it. Held-out runs allow 2.5
of these: friction that is complete at once. More is stiction."""


def unsure_power(log: Telemetry, base: Fit, given: Array) -> Array | None:
    """(n, k) W, what may explain parts of held-out residuals; None where it predicts no better.

    Args:
        log: the rows.
        base: the base model fitted to them.
        given: (n, m) W per standard deviation, usual errors of data sheet and sensors.
    """
    plain, beside = heldout_residual(log, base), heldout_residual(log, base, given)
    kept, least = (given, beside) if rms(beside) < rms(plain) else (given[:, :0], plain)
    both = np.column_stack([kept, USUAL_WIDTHS * sided_sooner(log, base.model)])
    if rms(left := heldout_residual(log, base, both)) < rms(least):
        kept, least = both, left
    unhelped = holding(log, base.model, base.watts)
    if np.any(unhelped):
        both = np.column_stack([kept, unhelped])
        if supports(log, least, heldout_residual(log, base, both), base.spread):
            return both
    return kept if kept.shape[1] else None


def sided_sooner(log: Telemetry, model: PowerModel) -> Array:
    """(n,) W more that a creeping robot needs where friction is complete nearer to rest.

    A model's friction and teeth change side smoothly, within widths that nobody measures. At SOONER
    times its speed a robot has the torques that it would have with widths as much smaller. Its
    motors do not turn faster for that, so only their copper loss and their work per turn change.

    Args:
        log: the rows.
        model: the model.
    """
    nodes = Nodes.of(log, model)
    speeds = [INDEX[name] for name in ("vx", "vy", "wz")]
    rim = np.abs(nodes.rows[:, speeds] @ model.wheels[:, RIM : RIM + 3].T).max(axis=1)
    at_motor = REST_SPEED * model.vehicle.layout.radius / model.vehicle.gear_ratio
    width = CREEPS_WITHIN * np.hypot(model.sliding_speed, at_motor)
    faster = 1.0 + (SOONER - 1.0) / (1.0 + (rim / width) ** 4)
    values = model.parameters.copy()
    values[model.parameter_names.index(("copper_loss", "resistance", 0))] = 0.0
    lossless = replace(model, parameters=values)
    count = len(nodes.rows)
    single = Nodes(nodes.rows, np.arange(count + 1), np.ones(count))

    def driven(by: PowerModel, factor: Array) -> Array:
        rows = nodes.rows.copy()
        rows[:, speeds] *= factor[:, None]
        return predict(by, single._replace(rows=rows))

    work = driven(lossless, faster) - driven(lossless, np.zeros(count))
    more = driven(model, faster) - (1.0 - 1.0 / faster) * work - driven(model, np.ones(count))
    watts = np.add.reduceat(more * nodes.weight, nodes.first[:-1])[:, None]
    return np.asarray(Readings.as_shown(log, watts)[:, 0])


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
