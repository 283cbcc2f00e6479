"""From a path to a route that a robot drives: corners, yaw, speed, energy, in this order.

route = drive(field, around, legs, yaws, objective=0)      # a Route, or a Stuck that says where
motion = move(field, around, legs, yaws, objective=0)      # not priced yet, to choose among many
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.power.model import PowerModel
from planner.quantities import STANDARD_GRAVITY
from planner.search.bound import lower_bound
from planner.search.conditions import Circumstances
from planner.search.edge_energy import (
    Motion,
    assemble,
    joined,
    motion_rows,
    room_to_move,
)
from planner.search.energy_interval import energy_distribution, thinned
from planner.search.ground import CostField
from planner.search.kept_limits import broken_limits, ease
from planner.search.on_the_spot import (
    Stuck,
    Wanted,
    arriving,
    first_contact,
    leaving,
    pose_spacing,
    turn_on_the_spot,
)
from planner.search.route import Battery, Route
from planner.search.speed import speed_programme
from planner.search.track import Track, lay_track, slopes_of_steps
from planner.search.yaw import YawProfile, yaw_programme

Array = NDArray[np.float64]


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


def drive(
    field: CostField,
    around: Circumstances,
    legs: Sequence[Array],
    yaws: Sequence[Wanted],
    *,
    objective: int,
    charge: float | None = None,
) -> Route | Stuck:
    """The best motion along a path and its energy.

    Args:
        field: map and costs.
        around: model and conditions.
        legs: polylines from one fixed point to the next.
        yaws: asked for at every fixed point.
        objective: 1 minimises time, anything else energy.
        charge: share of the battery's capacity that is left; None counts it as full.
    """
    motion = move(field, around, legs, yaws, objective=objective)
    return motion if isinstance(motion, Stuck) else price(field, around, motion, charge=charge)


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


def ground_classes(field: CostField, points: Array) -> NDArray[np.int64]:
    """Ground class (n,) of the cells under points (n, 2)."""
    ny, nx = field.ground.shape
    i = np.clip(np.floor((points[:, 0] - field.x0) / field.dx + 0.5).astype(int), 0, nx - 1)
    j = np.clip(np.floor((points[:, 1] - field.y0) / field.dy + 0.5).astype(int), 0, ny - 1)
    classes: NDArray[np.int64] = field.ground[j, i].astype(np.int64)
    return classes


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


def energy_by_step(field: CostField, around: Circumstances, motion: Motion) -> Array:
    """J of a motion's steps (n - 1,), without the account by effect."""
    rows, seconds, owner = motion_rows(field, motion, around.class_rows, around.wind)
    watts = _watts(around.model, rows)
    return np.asarray(np.bincount(owner, watts * seconds, len(motion.x) - 1), float)


def energy_of(field: CostField, around: Circumstances, motion: Motion) -> float:
    """J of a motion, without the account by effect."""
    return float(energy_by_step(field, around, motion).sum())


def _watts(model: PowerModel, rows: Array) -> Array:
    """Power of rows (n,), in blocks: its kernel is compiled for the programmes anyway."""
    return model.power_and_limits(rows)[:, 0]


def price(
    field: CostField, around: Circumstances, motion: Motion, *, charge: float | None = None
) -> Route:
    """The energy of a finished motion, by effect; its interval is found when it is asked for."""
    model = around.model
    rows, seconds, owner = motion_rows(field, motion, around.class_rows, around.wind)
    shares = model.watts_by_effect(rows, watts=_watts)
    steps = len(motion.x) - 1
    durations = np.diff(motion.time)
    by_step = {
        slug: np.bincount(owner, watts * seconds, minlength=steps) for slug, watts in shares.items()
    }
    joules = np.sum(list(by_step.values()), axis=0)
    energy = float(joules.sum())
    breakdown = {slug: float(values.sum()) for slug, values in by_step.items()}
    first = np.zeros(1)
    arrays = {
        "x": motion.x,
        "y": motion.y,
        "z": motion.heights,
        "yaw": motion.yaw,
        "t": motion.time,
        "speed": motion.speed,
        "energy_j": np.concatenate([first, np.cumsum(joules)]),
        "watts": np.concatenate([first, joules / durations]),
    }
    # The sum in another order may differ in the last digit; the account must close exactly.
    arrays["energy_j"][-1] = energy
    climb = float(motion.heights[-1] - motion.heights[0])
    distance = math.hypot(motion.x[-1] - motion.x[0], motion.y[-1] - motion.y[0])
    # Not clipped to the energy: a bound above it is a fault, and must show as a negative gap.
    bound = lower_bound(around, distance, climb, float(field.limit.max()))
    dissipated = energy - around.mass * STANDARD_GRAVITY * climb
    surface = np.sqrt(
        np.diff(motion.x) ** 2 + np.diff(motion.y) ** 2 + np.diff(motion.heights) ** 2
    )
    return Route(
        energy_j=energy,
        lower_bound_j=bound,
        gap=(energy - bound) / dissipated if dissipated > 0.0 else 0.0,
        duration_s=float(motion.time[-1]),
        length_m=float(surface.sum()),
        known=partial(energy_distribution, model, *thinned(rows, seconds), energy),
        breakdown_j=breakdown,
        arrays=arrays,
        watts_by_effect={
            slug: np.concatenate([first, values / durations]) for slug, values in by_step.items()
        },
        battery=_battery(model.vehicle.battery.capacity, charge, energy),
        motion=motion,
    )


def _battery(capacity: float, charge: float | None, energy: float) -> Battery | None:
    if not math.isfinite(capacity):
        return None
    available = capacity * (1.0 if charge is None else charge)
    share = energy / available if available > 0.0 else math.inf
    return Battery(available, share if math.isfinite(share) else 1e9, energy <= available)
