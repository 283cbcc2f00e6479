"""Turning at one place, through every yaw that is asked for there.

motion = turn_on_the_spot(field, conditions, place, yaws)       # or Infeasible that says why not
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.trajectory.motion import Motion, assemble
from planner.search.trajectory.track import Track
from planner.search.trajectory.yaw import YawProfile
from planner.terrain.footprint import touches


def pose_spacing(cell: float) -> float:
    """Largest distance of poses: one cell up to 0.5 m; a tenth of a cell on coarse maps."""
    return min(cell, 0.5) if cell <= 5.0 else cell / 10.0


def first_contact(field: CostField, motion: Motion) -> int:
    """The first pose at which, or after which, the body touches something; -1 if none."""
    return int(_contact(field, field.body_frame(), motion.x, motion.y, motion.yaw))


@njit(cache=True, error_model="numpy", nogil=True)
def _contact(field: Any, frame: Any, x: Any, y: Any, yaw: Any) -> int:
    for k in range(x.shape[0]):
        after = min(k + 1, x.shape[0] - 1)
        # Everywhere: what the mask says of a node need not hold beside it.
        if touches(
            field.blocked, frame, x[k], y[k], x[after], y[after], yaw[k], yaw[after] - yaw[k]
        ):
            return k
    return -1


def turn_on_the_spot(
    field: CostField,
    conditions: OperatingConditions,
    place: Array,
    yaws: Sequence[float | None],
) -> Motion | Infeasible:
    """The motion at a place (2,) alone: turns through every yaw asked for, in rad.

    Each turn goes the shorter way round, or the longer one where that is free.
    """
    spacing = pose_spacing(min(field.dx, field.dy))
    nothing = np.zeros(0)
    track = Track(place[None, :], nothing, nothing, nothing, np.ones(1, bool), (0, 0))
    wanted = [yaw for yaw in yaws if yaw is not None] or [0.0]
    rate = conditions.model.vehicle.limits.yaw_rate
    arriving, leaving = [wanted[0]], [wanted[0]]
    for yaw in wanted[1:]:
        short = math.remainder(yaw - leaving[-1], 2.0 * math.pi)
        for turn in (short, short - math.copysign(2.0 * math.pi, short)):
            profile = YawProfile(np.array(leaving[-1:]), np.array([leaving[-1] + turn]), 0.0)
            motion = assemble(field, track, profile, np.zeros(1), yaw_rate=rate, spacing=spacing)
            broken = broken_limits(field, conditions, motion, finely=True)
            if not broken and first_contact(field, motion) < 0:
                break
        else:
            x, y = place
            if broken:
                cause = broken.at(x, y)
                return replace(cause, what=f"{cause.what} in turning on the spot")
            what = "the body touches something in turning on the spot"
            return Infeasible(float(x), float(y), what, True)
        arriving.append(leaving[-1])
        leaving.append(leaving[-1] + turn)
    # One sample for each turn; the first one stands.
    count, none = len(arriving), np.zeros(len(arriving) - 1)
    points = np.repeat(track.points, count, axis=0)
    turns = Track(points, none, none, none, np.ones(count, bool), (0, count - 1))
    profile = YawProfile(np.array(arriving), np.array(leaving), 0.0)
    return assemble(field, turns, profile, np.zeros(count), yaw_rate=rate, spacing=spacing)
