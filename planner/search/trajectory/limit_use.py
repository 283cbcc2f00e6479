"""How much of every limit a motion uses, and where it uses most.

for use in limits_used(field, conditions, motion): print(use.limit, use.share)

A share of 1 is the limit itself. The wheel load's share is what the least loaded wheel lacks of its
load on level ground; that of traction is of the force that the wheels can share among them; that
of the clearance is the clearance over the distance of the nearest thing.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.limits import LIMIT_NAMES, gear_torques, rms_torques
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.limit_places import LimitUse
from planner.search.trajectory.limit_checks import (
    NEAR_A_LIMIT,
    coarse_pieces,
    fine_pieces,
    limit_shares,
    motion_rates,
    near_a_jump,
    rows_on_arcs,
)
from planner.search.trajectory.motion import Motion, motion_rows, place_at, shares_driven
from planner.terrain.obstacles import rectangle_free

LIMITS_USED = (
    *("torque peak", "torque rms", "traction", "wheel load", "voltage", "current"),
    *("speed", "acceleration", "yaw rate", "clearance"),
)
"""Names and order of ``limits_used``."""
WIDEST = 10.0
"""Clearances within which the nearest thing is looked for; beyond, the share is 0."""
HALVINGS = 20
"""Bisections of that distance."""
BESIDE = 0.25
"""Cells between two places at which the clearance is measured."""


def limits_used(
    field: CostField, conditions: OperatingConditions, motion: Motion
) -> tuple[LimitUse, ...]:
    """The largest share of every limit of LIMITS_USED along a motion, in their order.

    A vehicle's limit that is infinite has the share 0.
    """
    limits, model = conditions.model.vehicle.limits, conditions.model
    pieces = _closer_near_largest(field, conditions, motion)
    rows, seconds, owner = motion_rows(
        field, motion, conditions.class_rows, conditions.wind, pieces
    )
    bends, bent = rows_on_arcs(field, conditions, motion, pieces)
    found = model.power_and_limits(np.concatenate([rows, bends]))
    torque = found[: len(rows), 4]
    used = dict(zip(LIMIT_NAMES, limit_shares(conditions, found).T, strict=True))
    everywhere = np.concatenate([owner, bent])
    moments = np.concatenate([rows, bends])[:, INDEX["time_since_start"]]
    ends = np.cumsum(seconds)
    rms = rms_torques(torque, seconds, limits.thermal_time)
    if (rms > 0.0).any():
        rms = rms_torques(gear_torques(model, rows), seconds, limits.thermal_time).max(axis=1)
    first = motion.time[:-1]
    (acceleration, most), (yaw_rate, _) = motion_rates(conditions, motion)
    # Of limits far beyond the drive, the search works with lower ones.
    stated = conditions.stated or limits
    steps = np.arange(len(motion.time) - 1)
    speed = np.maximum(motion.speed[1:], motion.speed[:-1])
    shares: dict[str, tuple[Array, NDArray[np.int64], Array]] = {
        **{name: (share, everywhere, moments) for name, share in used.items()},
        "torque rms": (rms / limits.continuous_torque, owner, ends),
        "speed": (speed / stated.speed, steps, first),
        "acceleration": (acceleration / most, steps, first),
        "yaw rate": (yaw_rate / stated.yaw_rate, steps, first),
        "clearance": _clearances(field, conditions, motion),
    }
    uses = []
    for name in LIMITS_USED:
        share, at, when = shares[name]
        if not len(share):
            uses.append(LimitUse(name, 0.0, float(motion.x[0]), float(motion.y[0]), 0.0))
            continue
        k = int(np.argmax(share))
        x, y = place_at(motion, int(at[k]), float(when[k]))
        uses.append(LimitUse(name, max(float(share[k]), 0.0), x, y, float(when[k])))
    return tuple(uses)


def _closer_near_largest(
    field: CostField, conditions: OperatingConditions, motion: Motion
) -> NDArray[np.int64]:
    """(steps,) pieces of a motion to look at: more of them where a step uses much of a limit."""
    pieces = coarse_pieces(field, motion)
    rows, _, owner = motion_rows(field, motion, conditions.class_rows, conditions.wind, pieces)
    share = limit_shares(conditions, conditions.model.power_and_limits(rows))
    used = np.zeros((len(pieces), share.shape[1]))
    np.maximum.at(used, owner, share)
    near = (used >= NEAR_A_LIMIT * used.max(axis=0, initial=0.0)).any(axis=1)
    near |= near_a_jump(motion, used.max(axis=1))
    return np.where(near, fine_pieces(field, motion), pieces)


def _clearances(
    field: CostField, conditions: OperatingConditions, motion: Motion
) -> tuple[Array, NDArray[np.int64], Array]:
    """Clearance over the distance of the nearest thing; the steps, and the times."""
    clearance = conditions.model.vehicle.limits.clearance
    length = np.hypot(np.diff(motion.x), np.diff(motion.y))
    turn = np.abs(np.diff(motion.yaw))
    counts = np.maximum(length / (BESIDE * min(field.dx, field.dy)), turn / math.radians(5.0))
    counts = np.maximum(1, np.ceil(counts)).astype(np.int64)
    steps = np.repeat(np.arange(len(counts)), counts)
    share = np.concatenate([np.zeros(0), *(np.arange(1, n + 1) / n for n in counts)])
    times = motion.time[steps] + share * np.diff(motion.time)[steps]
    gone = shares_driven(motion, steps, times)

    def at(values: Array) -> Array:
        return np.asarray(values[steps] + gone * np.diff(values)[steps])

    room = _room(field, at(motion.x), at(motion.y), at(motion.yaw), *_body(conditions), WIDEST)
    with np.errstate(divide="ignore", invalid="ignore"):
        used = np.where(room >= WIDEST * max(clearance, 1e-3), 0.0, clearance / room)
    return np.nan_to_num(used, nan=0.0), steps, times


def _body(conditions: OperatingConditions) -> tuple[float, float, float]:
    vehicle = conditions.model.vehicle
    return 0.5 * vehicle.length, 0.5 * vehicle.width, max(vehicle.limits.clearance, 1e-3)


@njit(cache=True, error_model="numpy", nogil=True)
def _room(
    field: Any,
    x: Any,
    y: Any,
    yaw: Any,
    half_length: float,
    half_width: float,
    unit: float,
    widest: float,
) -> Any:
    """m by which the body may grow on all sides before it touches something, (n,)."""
    room = np.empty(x.shape[0])
    least = widest * unit
    for k in range(x.shape[0]):
        low, high = 0.0, least
        for trial in range(HALVINGS):
            middle = high if trial == 0 else 0.5 * (low + high)
            if rectangle_free(
                field.blocked,
                field.x0,
                field.y0,
                field.dx,
                field.dy,
                x[k],
                y[k],
                yaw[k],
                half_length + middle,
                half_width + middle,
            ):
                low = middle
                if trial == 0:
                    break
            else:
                high = middle
        room[k] = low
        # Only the nearest of all counts.
        least = min(least, max(low, 1e-6)) if low < least else least
    return room
