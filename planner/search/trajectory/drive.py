"""From a path to a motion that a robot drives: corners, yaw, speed, in this order.

    motion = move(field, around, legs, yaws, objective=0)      # or a Stuck that says where

planner.search.results.energy_account prices it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.search.conditions import Circumstances
from planner.search.field import CostField, ground_classes
from planner.search.trajectory.limit_checks import broken_limits, ease
from planner.search.trajectory.motion import Motion, assemble, joined, room_to_move
from planner.search.trajectory.speed_profile import speed_programme
from planner.search.trajectory.track import Track, lay_track, slopes_of_steps
from planner.search.trajectory.turn_on_the_spot import (
    Stuck,
    first_contact,
    pose_spacing,
    turn_on_the_spot,
)
from planner.search.trajectory.yaw_profile import YawProfile, yaw_programme
from planner.search.wanted_yaw import Wanted, arriving, leaving


class Care(NamedTuple):
    """How closely a motion is worked out.

    Attributes:
        yaws, speeds: angles and levels of speed beside the best ones that are priced as well.
        knots: places at most at which the yaw is decided, where there is room.
        turned: yaw programmes at most until the motion keeps to all limits, each without an angle
            that did not.
    """

    yaws: int
    speeds: int
    knots: int
    turned: int


ROUGHLY, CLOSELY = Care(1, 1, 240, 1), Care(2, 3, 480, 8)
"""The first is good to a few parts in ten thousand, to choose among paths."""
REPAIRS = 12
"""Speed programmes until no limit is broken between stations either."""
PATIENCE = 2
"""Repairs of one place, other than of the voltage, until the body is to be turned otherwise."""


def move(
    field: CostField,
    around: Circumstances,
    legs: Sequence[Array],
    yaws: Sequence[Wanted],
    *,
    objective: int,
    care: Care = CLOSELY,
    checked: bool = True,
) -> Motion | Stuck:
    """The best motion along a path.

    Args:
        field, around, legs, yaws, objective: as for ``drive``.
        care: how closely.
        checked: whether all limits are looked at between the points that the programmes look at.
    """
    turned = [k for k, yaw in enumerate(yaws) if isinstance(yaw, tuple)]
    if turned:
        return _in_parts(field, around, legs, yaws, turned, objective, care, checked)
    free_or_one = [arriving(yaw) for yaw in yaws]
    vehicle = around.model.vehicle
    spacing = pose_spacing(min(field.dx, field.dy))
    track = lay_track(
        field,
        list(legs),
        # The speed's grid needs some way to change by one level.
        spacing=max(spacing, 0.06 * vehicle.limits.speed**2 / vehicle.limits.acceleration),
        speed=vehicle.limits.speed,
        acceleration=vehicle.limits.acceleration,
    )
    if not len(track.lengths):
        return turn_on_the_spot(field, around, track.points[0], free_or_one)
    slopes, grounds = _ground_under(field, track)
    shut: list[tuple[float, float, float]] = []
    for _ in range(care.turned):
        yaw = _yaw_through(
            field, around, track, slopes, grounds, free_or_one, objective, care, shut
        )
        if isinstance(yaw, Stuck):
            return yaw
        roomy, yaw = room_to_move(track, yaw)
        on_steps = slopes, grounds
        if roomy is not track:
            on_steps = _ground_under(field, roomy)
        motion = _at_speed(
            field, around, roomy, yaw, *on_steps, objective, care.speeds, checked, spacing
        )
        if isinstance(motion, Motion):
            break
        # With the body turned otherwise it may keep to its limits there.
        place = int(np.hypot(*(roomy.points - (motion.x, motion.y)).T).argmin())
        shut.append((motion.x, motion.y, float(yaw.leaving[place])))
    if isinstance(motion, Stuck):
        return motion
    touched = first_contact(field, motion)
    if touched >= 0:
        x, y = motion.x[touched], motion.y[touched]
        return Stuck(float(x), float(y), "the body touches something", True)
    return motion


def _in_parts(
    field: CostField,
    around: Circumstances,
    legs: Sequence[Array],
    yaws: Sequence[Wanted],
    turned: Sequence[int],
    objective: int,
    care: Care,
    checked: bool,
) -> Motion | Stuck:
    """The motion where ``turned`` fixed points ask for several yaw angles: there it stands."""
    parts: list[Motion] = []
    begun = 0
    for end in sorted({*turned, len(yaws) - 1}):
        if end > begun:
            wanted = [leaving(yaws[begun]), *yaws[begun + 1 : end], arriving(yaws[end])]
            part = move(
                field,
                around,
                legs[begun:end],
                wanted,
                objective=objective,
                care=care,
                checked=checked,
            )
            if isinstance(part, Stuck):
                return part
            parts.append(part)
        several = yaws[end]
        if isinstance(several, tuple):
            place = legs[end][0] if end < len(legs) else legs[-1][-1]
            part = turn_on_the_spot(field, around, place, several)
            if isinstance(part, Stuck):
                return part
            parts.append(part)
        begun = end
    return joined(parts)


def _at_speed(
    field: CostField,
    around: Circumstances,
    track: Track,
    yaw: YawProfile,
    slopes: Array,
    grounds: NDArray[np.int64],
    objective: int,
    beside: int,
    checked: bool,
    spacing: float,
) -> Motion | Stuck:
    """The best speeds along a track with its yaw, within all limits."""
    limits = around.model.vehicle.limits
    fastest = np.full(len(track.lengths), limits.speed)
    hardest = np.full(len(track.lengths), limits.acceleration)
    eased = np.zeros(len(track.lengths), np.int64)
    for _ in range(REPAIRS):
        speeds, broken_at = speed_programme(
            around,
            track,
            yaw,
            slopes,
            grounds,
            objective,
            beside,
            fastest,
            hardest,
        )
        if speeds is None:
            x, y = track.points[broken_at]
            return Stuck(float(x), float(y), "no speed keeps to all limits")
        motion = assemble(field, track, yaw, speeds, yaw_rate=limits.yaw_rate, spacing=spacing)
        if not checked:
            return motion
        broken = broken_limits(field, around, motion)
        if not broken:
            return motion
        ease(broken, motion, track, fastest, hardest, eased)
        x, y = motion.x[broken.steps[0]], motion.y[broken.steps[0]]
        stuck = Stuck(float(x), float(y), broken.what)
        if eased.max() > PATIENCE:
            worst = int(eased.argmax())
            x, y = 0.5 * (track.points[worst] + track.points[worst + 1])
            return Stuck(float(x), float(y), broken.what)
    return stuck


def _ground_under(field: CostField, track: Track) -> tuple[Array, NDArray[np.int64]]:
    """Slopes (steps, 4) of ``slopes_of_steps``, and the ground class (steps,) of every step."""
    middle = 0.5 * (track.points[1:] + track.points[:-1])
    return slopes_of_steps(field, track.points), ground_classes(field, middle)


def _yaw_through(
    field: CostField,
    around: Circumstances,
    track: Track,
    slopes: Array,
    grounds: NDArray[np.int64],
    yaws: Sequence[float | None],
    objective: int,
    care: Care,
    shut: Sequence[tuple[float, float, float]],
) -> YawProfile | Stuck:
    """Yaw along the whole track; a via point with a yaw of its own parts the programme in two."""
    fixed = [k for k, yaw in enumerate(yaws) if yaw is not None and 0 < k < len(yaws) - 1]
    cuts = [0, *(track.marks[k] for k in fixed), len(track.points) - 1]
    wanted = [yaws[0], *(yaws[k] for k in fixed), yaws[-1]]
    arriving: list[Array] = []
    leaving: list[Array] = []
    cost = 0.0
    for part, (a, b) in enumerate(zip(cuts[:-1], cuts[1:], strict=True)):
        piece = Track(
            track.points[a : b + 1],
            track.directions[a:b],
            track.lengths[a:b],
            track.curvatures[a:b],
            track.stops[a : b + 1],
            (0, b - a),
        )
        profile = yaw_programme(
            around,
            field,
            piece,
            slopes[a:b],
            grounds[a:b],
            objective=objective,
            start_yaw=wanted[part],
            goal_yaw=wanted[part + 1],
            beside=care.yaws,
            most_knots=care.knots,
            shut=shut,
        )
        if not isinstance(profile, YawProfile):
            x, y = profile
            return Stuck(float(x), float(y), "the body cannot turn as the way would need it", True)
        offset = 0.0
        if part > 0:
            # Keep yaw continuous: the pieces may differ by whole turns.
            offset = leaving[-1][-1] - profile.arriving[0]
            offset = 2.0 * math.pi * round(offset / (2.0 * math.pi))
        arriving.append(profile.arriving[(0 if part == 0 else 1) :] + offset)
        if part > 0:
            leaving[-1][-1] = profile.leaving[0] + offset
        leaving.append(profile.leaving[(0 if part == 0 else 1) :] + offset)
        cost += profile.cost
    return YawProfile(np.concatenate(arriving), np.concatenate(leaving), cost)
