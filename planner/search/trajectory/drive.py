"""From a path to a motion that a robot drives: corners, yaw, speed, and both once more.

    motion = move(field, conditions, legs, yaws)      # or Infeasible that says where

planner.search.results.energy_account prices it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from planner.arrays import Array
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.kernel_arguments import Steps
from planner.search.limit_places import Infeasible
from planner.search.resolution import LEVELS, MORE_LEVELS, SLOWEST
from planner.search.trajectory.heat import overheated, rested
from planner.search.trajectory.motion import (
    Motion,
    assemble,
    joined,
    metres,
    read_along,
    room_to_move,
)
from planner.search.trajectory.refinement import refined_motion
from planner.search.trajectory.speed_search import SpeedSearch
from planner.search.trajectory.track import Track, lay_track, led_past, steps_of
from planner.search.trajectory.turn_on_the_spot import (
    first_contact,
    pose_spacing,
    turn_on_the_spot,
)
from planner.search.trajectory.yaw import YawProfile, YawSearch, crowded_at
from planner.search.wanted_yaw import Wanted, arriving, leaving


class Care(NamedTuple):
    """Effort spent on a motion.

    Attributes:
        yaws, speeds: angles and levels of speed beside the best ones that are priced as well.
        levels: of speed at most.
        waypoints: places at most at which the yaw is decided, where there is room.
        turned: yaw profiles at most where limits are checked, each without an angle that broke one
            before.
        refined: rounds in which the yaw is refined at most.
        every_end: whether all places beyond which no yaw leads are looked for: what is beyond the
            first one matters to a search past all of them.
    """

    yaws: int
    speeds: int
    levels: int
    waypoints: int
    turned: int
    refined: int
    every_end: bool


LEAST_SPACING = 0.06
"""Largest distance of a track's samples on fine maps, in twice the distance to full speed: the
speed's grid needs some metres to change by one level."""
ROUGHLY = Care(1, 1, LEVELS, 240, 4, 1, True)
CLOSELY = Care(2, 3, MORE_LEVELS, 480, 8, 6, True)
"""The first is good to a few parts in a thousand, to choose among paths."""
MOST_ENDS = 8
"""Places beyond which no yaw leads that are looked for at once."""


def move(
    field: CostField,
    conditions: OperatingConditions,
    legs: Sequence[Array],
    yaws: Sequence[Wanted],
    *,
    care: Care = CLOSELY,
    checked: bool = True,
    check: Callable[[], None] = lambda: None,
) -> Motion | Infeasible:
    """The best motion along a path.

    Args:
        field: map and costs of steady driving.
        conditions: model and conditions.
        legs: polylines (k, 2) in m, each from one fixed point to the next.
        yaws: wanted at every fixed point, rad; one more than legs.
        care: how closely.
        checked: whether all limits are checked between the samples of the profiles too.
        check: called between profiles; may raise to stop.
    """
    motion = _move(field, conditions, legs, yaws, care, checked, check)
    if len(legs) > 1 and isinstance(motion, Infeasible):
        # Where no bend past a via place can be driven, a stop there may do.
        stopped = _move(field, conditions, legs, yaws, care, checked, check, led=False)
        motion = motion if isinstance(stopped, Infeasible) else stopped
    if checked and isinstance(motion, Motion):
        too_warm = overheated(field, conditions, motion)
        return motion if too_warm is None else rested(field, conditions, motion) or too_warm
    return motion


def _move(
    field: CostField,
    conditions: OperatingConditions,
    legs: Sequence[Array],
    yaws: Sequence[Wanted],
    care: Care,
    checked: bool,
    check: Callable[[], None],
    led: bool = True,
) -> Motion | Infeasible:
    """The best motion by the limits that hold at every moment; ``led`` as for the track."""
    turned = [k for k, yaw in enumerate(yaws) if isinstance(yaw, tuple)]
    if turned:
        return _in_parts(field, conditions, legs, yaws, turned, care, checked, check, led)
    free_or_one = [arriving(yaw) for yaw in yaws]
    limits = conditions.model.vehicle.limits
    track = _track_along(field, conditions, legs, led=led)
    if not len(track.lengths):
        return turn_on_the_spot(field, conditions, track.points[0], free_or_one)
    steps = steps_of(field, track)
    yaw_search = partial(
        YawSearch,
        conditions,
        field,
        beside=care.yaws,
        most_waypoints=care.waypoints,
    )
    parts = _parts(track, steps, free_or_one, yaw_search)
    shut: list[tuple[float, float, float]] = []
    search: SpeedSearch | None = None
    for _ in range(care.turned if checked else 1):
        check()
        found = _yaw_through(field, parts, MOST_ENDS if care.every_end else 1, shut)
        if isinstance(found, Infeasible):
            return found
        roomy, yaw = room_to_move(
            track, found, speed=limits.speed, acceleration=limits.acceleration
        )
        if search is None or search.track is not roomy:
            search = SpeedSearch(
                *(field, conditions, roomy),
                steps if roomy is track else steps_of(field, roomy),
                beside=care.speeds,
                levels=care.levels,
                checked=checked,
                check=check,
            )
        motion = search.along(yaw)
        if isinstance(motion, Motion):
            break
        # With another yaw the robot may keep to its limits there.
        for x, y in motion.places:
            place = int(np.hypot(*(roomy.points - (x, y)).T).argmin())
            shut.append((x, y, float(yaw.leaving[place])))
    if isinstance(motion, Infeasible):
        return motion
    assert search is not None  # a motion was found by it
    touched = first_contact(field, motion)
    if touched >= 0:
        x, y = motion.x[touched], motion.y[touched]
        return Infeasible(float(x), float(y), "the body touches something", True)
    if not checked or not care.refined:
        return motion
    wanted = zip(roomy.marks, free_or_one, strict=True)
    fixed = np.isin(np.arange(len(roomy.points)), [mark for mark, one in wanted if one is not None])
    return refined_motion(
        *(field, conditions, roomy, search.steps, yaw, motion, fixed, search.along),
        rounds=care.refined,
    )


def _track_along(
    field: CostField, conditions: OperatingConditions, legs: Sequence[Array], *, led: bool = True
) -> Track:
    """The track along polylines (k, 2) of the legs; ``led`` past via places without a stop."""
    limits = conditions.model.vehicle.limits
    lay = partial(
        lay_track,
        field,
        spacing=max(
            pose_spacing(min(field.dx, field.dy)),
            LEAST_SPACING * limits.speed**2 / limits.acceleration,
        ),
        speed=limits.speed,
        acceleration=limits.acceleration,
    )
    track = lay(list(legs))
    if not led or len(legs) < 2 or not track.stops[1:-1].any():
        return track
    past = lay(led_past(field, list(legs), limits.speed**2 / limits.acceleration))
    return past if past.stops.sum() < track.stops.sum() else track


def moved_alike(
    field: CostField,
    conditions: OperatingConditions,
    motion: Motion,
    before: Sequence[Array],
    after: Sequence[Array],
) -> Motion:
    """A motion along a path that was moved a little, with the yaw to the travel and speeds it had.

    Where these are the best ones, small changes of them cost nothing. So what it saves to move the
    path is seen without looking for them anew. Limits are not checked.

    Args:
        field, conditions: map, model and conditions.
        motion: along ``before``.
        before, after: polylines (k, 2) of the legs, point by point.
    """
    limits = conditions.model.vehicle.limits
    track = _track_along(field, conditions, after)
    still = np.zeros(len(track.points))
    track, _ = room_to_move(
        track,
        YawProfile(still, still, 0.0),
        speed=limits.speed,
        acceleration=limits.acceleration,
    )
    on = np.append(True, np.hypot(np.diff(motion.x), np.diff(motion.y)) > 1e-9)
    x, y, yaw, speed = motion.x[on], motion.y[on], motion.yaw[on], motion.speed[on]
    to_x, to_y = np.ascontiguousarray(track.points.T)
    driven, gone = metres(motion.x, motion.y), metres(to_x, to_y)
    path, moved = (np.vstack([legs[0][:1], *(leg[1:] for leg in legs)]) for legs in (before, after))
    # Metres of the motion that a sample of the track stands for: points of the paths match.
    then = np.interp(
        gone, read_along(to_x, to_y, gone, moved, metres(*moved.T)), motion.along(path, driven)
    )
    driven = driven[on]
    angles = np.interp(then, driven, yaw - _directions(x, y)) + _directions(to_x, to_y)
    slowest = (SLOWEST * limits.speed) ** 2
    speeds = np.sqrt(np.maximum(np.interp(then, driven, speed**2), slowest))
    speeds[track.stops] = 0.0
    return assemble(
        field,
        track,
        YawProfile(angles, angles, 0.0),
        speeds,
        yaw_rate=limits.yaw_rate,
        spacing=pose_spacing(min(field.dx, field.dy)),
    )


def _directions(x: Array, y: Array) -> Array:
    """(n,) rad, azimuth of the travel at samples: the mean of the steps on either side."""
    steps = np.unwrap(np.arctan2(np.diff(y), np.diff(x)))
    return np.asarray(0.5 * (np.append(steps[0], steps) + np.append(steps, steps[-1])))


def _in_parts(
    field: CostField,
    conditions: OperatingConditions,
    legs: Sequence[Array],
    yaws: Sequence[Wanted],
    turned: Sequence[int],
    care: Care,
    checked: bool,
    check: Callable[[], None],
    led: bool,
) -> Motion | Infeasible:
    """The motion where ``turned`` fixed points ask for several yaw angles: there it stands."""
    parts: list[Motion] = []
    begun = 0
    for end in sorted({*turned, len(yaws) - 1}):
        if end > begun:
            wanted = [leaving(yaws[begun]), *yaws[begun + 1 : end], arriving(yaws[end])]
            inner = legs[begun:end]
            part = _move(field, conditions, inner, wanted, care, checked, check, led)
            if isinstance(part, Infeasible):
                return part
            parts.append(part)
        several = yaws[end]
        if isinstance(several, tuple):
            place = legs[end][0] if end < len(legs) else legs[-1][-1]
            part = turn_on_the_spot(field, conditions, place, several)
            if isinstance(part, Infeasible):
                return part
            parts.append(part)
        begun = end
    return joined(parts)


def _parts(
    track: Track, steps: Steps, yaws: Sequence[float | None], begin: Callable[..., YawSearch]
) -> list[YawSearch]:
    """Searches along the whole track; a via point with a yaw of its own cuts it in two."""
    fixed = [k for k, yaw in enumerate(yaws) if yaw is not None and 0 < k < len(yaws) - 1]
    cuts = [0, *(track.marks[k] for k in fixed), len(track.points) - 1]
    wanted = [yaws[0], *(yaws[k] for k in fixed), yaws[-1]]
    parts = []
    for (a, b), (start, goal) in zip(
        itertools.pairwise(cuts), itertools.pairwise(wanted), strict=True
    ):
        piece = track.part(a, b), steps.part(a, b)
        parts.append(begin(*piece, start_yaw=start, goal_yaw=goal))
    return parts


def _yaw_through(
    field: CostField,
    parts: Sequence[YawSearch],
    most_ends: int,
    shut: Sequence[tuple[float, float, float]],
) -> YawProfile | Infeasible:
    """Yaw along the whole track; ``shut`` as for ``YawSearch.best``, ends as for its ``ends``."""
    arriving: list[Array] = []
    leaving: list[Array] = []
    cost = 0.0
    for number, part in enumerate(parts):
        profile = part.best(shut)
        if not isinstance(profile, YawProfile):
            ends = part.ends(profile, most_ends)
            return Infeasible(
                *(float(profile[0]), float(profile[1])),
                "the body cannot turn as the way would need it",
                for_want_of_room=bool(crowded_at(field, profile[None])[0]),
                others=tuple((float(x), float(y)) for x, y in ends[1:]),
            )
        offset = 0.0
        if number > 0:
            # Keep yaw continuous: the pieces may differ by whole turns.
            offset = leaving[-1][-1] - profile.arriving[0]
            offset = 2.0 * math.pi * round(offset / (2.0 * math.pi))
        arriving.append(profile.arriving[(0 if number == 0 else 1) :] + offset)
        if number > 0:
            leaving[-1][-1] = profile.leaving[0] + offset
        leaving.append(profile.leaving[(0 if number == 0 else 1) :] + offset)
        cost += profile.cost
    return YawProfile(np.concatenate(arriving), np.concatenate(leaving), cost)
