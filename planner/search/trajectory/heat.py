"""Motors that get too warm over time, and rests in which they cool.

    overheated(field, conditions, motion)        # Infeasible where and when one gets too warm
    rested(field, conditions, motion)            # the same motion with rests, or None

A steep stretch may take more than the continuous torque for a while. What counts is the root mean
square torque over the thermal time. Where that is too much by little, another path may take a
fifth more energy. A rest of some seconds at a gentle place takes next to nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.power.limits import gear_torques, rms_torques
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.trajectory.limit_checks import Kept, broken_limits, coarse_pieces, fine_pieces
from planner.search.trajectory.motion import Motion, motion_rows, place_at

MOST_RESTS = 24
"""Rests in one motion at most. With more, a motion counts as too warm."""
FORESEEN = 0.5
"""Share of the thermal time after the first warm place, for which one rest has to suffice."""
BRAKING = (0.8, 0.4, 0.2)
"""Shares of the largest acceleration by which the robot stops and starts, tried in turn."""
PLACES_TRIED = 4
"""Places for a rest that are tried, one on each of as many stretches of the drive: at places side
by side a rest does as much."""
LONGER, LENGTHENED = 1.3, 8
"""Factor on a rest that was too short, and times at most: stopping and starting take torque."""
SHORTEST = 0.5
"""s, the shortest rest."""
COOL_RESERVE = 5e-4
"""Share of the continuous torque that rests leave: a route's limits are read at other samples."""


class _Warmth(NamedTuple):
    """Torques along a motion, by rows of the power model.

    Attributes:
        torques: (rows, motors) N·m.
        seconds: (rows,) that each stands for.
        owner: (rows,) step that each belongs to.
        rms: (rows,) N·m, of the warmest motor over the thermal time before.
    """

    torques: Array
    seconds: Array
    owner: NDArray[np.int64]
    rms: Array


def overheated(
    field: CostField, conditions: OperatingConditions, motion: Motion
) -> Infeasible | None:
    """Where and when a motor's root mean square torque is largest, if that is too much."""
    limits = conditions.model.vehicle.limits
    warmth = _warmth(field, conditions, motion)
    if warmth is None:
        return None
    k = int(warmth.rms.argmax())
    largest = float(warmth.rms[k])
    if largest <= limits.continuous_torque:
        return None
    x, y = place_at(motion, int(warmth.owner[k]), float(np.cumsum(warmth.seconds)[k]))
    return Infeasible(
        x,
        y,
        f"motors give {largest / limits.continuous_torque:.2f} times their continuous torque over "
        f"{limits.thermal_time:g} s",
        limit="torque rms",
        value=largest,
        allowed=limits.continuous_torque,
    )


def _warmth(field: CostField, conditions: OperatingConditions, motion: Motion) -> _Warmth | None:
    """Torques along a motion; None where a quick look shows that no motor gets too warm."""
    limits = conditions.model.vehicle.limits
    pieces = coarse_pieces(field, motion)
    row_inputs = field, motion, conditions.class_rows, conditions.wind
    rows, seconds, owner = motion_rows(*row_inputs, pieces)
    largest = conditions.model.power_and_limits(rows)[:, 4]
    # The most loaded motor of every moment bounds each of them.
    bound = rms_torques(largest, seconds, limits.thermal_time)
    if not (bound > limits.continuous_torque).any():
        return None
    warming = np.zeros(len(pieces), np.bool_)
    warming[owner[largest > limits.continuous_torque]] = True
    pieces = np.where(warming, fine_pieces(field, motion), pieces)
    rows, seconds, owner = motion_rows(*row_inputs, pieces)
    torques = gear_torques(conditions.model, rows)
    rms = rms_torques(torques, seconds, limits.thermal_time).max(axis=1)
    return _Warmth(torques, seconds, owner, rms)


def rested(field: CostField, conditions: OperatingConditions, motion: Motion) -> Motion | None:
    """A motion with as many rests as its motors need; None where rests do not help.

    Args:
        field, conditions: map, model and limits.
        motion: within all limits but that of the torque over time.
    """
    for _ in range(MOST_RESTS):
        warmth = _warmth(field, conditions, motion)
        if warmth is None or not _warm(conditions, warmth).any():
            return motion
        cooler = _with_a_rest(field, conditions, motion, warmth)
        if cooler is None:
            return None
        motion = cooler
    return None


def _warm(
    conditions: OperatingConditions, warmth: _Warmth, share: float = 1.0
) -> NDArray[np.bool_]:
    """(rows,) whether some motor gives more than a share of its continuous torque."""
    return np.asarray(warmth.rms > share * conditions.model.vehicle.limits.continuous_torque)


def _with_a_rest(
    field: CostField, conditions: OperatingConditions, motion: Motion, warmth: _Warmth
) -> Motion | None:
    """A motion with a rest before the first place at which it is too warm, long enough for that.

    Of each stretch, the place is looked at where motors have least to do: there they cool best and
    start easily. The shortest rest is taken; each second costs.
    """
    limits = conditions.model.vehicle.limits
    time, warm = np.cumsum(warmth.seconds), np.flatnonzero(_warm(conditions, warmth))
    near = warm[time[warm] <= time[warm[0]] + FORESEEN * limits.thermal_time]
    at = int(near[warmth.rms[near].argmax()])
    allowed = (1.0 - COOL_RESERVE) * limits.continuous_torque
    needed = _least_rest(warmth, at, allowed, limits.thermal_time)
    earliest = time[at] - limits.thermal_time + needed
    places = np.flatnonzero((motion.time > earliest) & (motion.time < time[warm[0]]))
    places = places[(places > 0) & (places < len(motion.time) - 1)]
    places = places[np.minimum(motion.speed[places - 1], motion.speed[places + 1]) > 0.0]
    by_step = np.zeros(len(motion.time) - 1)
    np.maximum.at(by_step, warmth.owner, warmth.torques.max(axis=1))
    loaded = np.maximum(by_step[:-1], by_step[1:])  # of inner samples
    shortest: Motion | None = None
    for part in _in_stretches(motion, places):
        place = int(part[loaded[part - 1].argmin()])
        stopped = _stopped_at(field, conditions, motion, place)
        if stopped is None:
            continue
        # Stopping and starting take some time, too.
        seconds = max(needed - (stopped.time[-1] - motion.time[-1]), SHORTEST)
        until = warmth.owner[at] + 1  # one step more than before
        # After the thermal time, nothing that came before counts.
        lengths = np.minimum(seconds * LONGER ** np.arange(LENGTHENED), limits.thermal_time)
        for length in np.unique(lengths):
            cooler = _resting_at(stopped, place, float(length))
            if shortest is not None and cooler.time[-1] >= shortest.time[-1]:
                break
            now = _warmth(field, conditions, cooler)
            if (
                now is None
                or not _warm(conditions, now, 1.0 - COOL_RESERVE)[now.owner <= until].any()
            ):
                shortest = cooler
                break
    return shortest


def _in_stretches(motion: Motion, places: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Samples by stretches of the drive that take as long; none of them empty."""
    if not len(places):
        return []
    time = motion.time[places]
    cuts = np.linspace(time[0], time[-1], PLACES_TRIED + 1)[1:-1]
    return [part for part in np.split(places, np.searchsorted(time, cuts)) if len(part)]


def _least_rest(warmth: _Warmth, at: int, allowed: float, thermal_time: float) -> float:
    """s of rest that make room for the heat at a row: what came first is no longer counted then."""
    until = warmth.torques[: at + 1], warmth.seconds[: at + 1]
    motor = int(rms_torques(*until, thermal_time)[-1].argmax())
    heat = np.append(0.0, np.cumsum(warmth.torques[:, motor] ** 2 * warmth.seconds))
    time = np.append(0.0, np.cumsum(warmth.seconds))
    begun = time[at + 1] - thermal_time
    too_much = (warmth.rms[at] ** 2 - allowed**2) * thermal_time
    return float(np.interp(np.interp(begun, time, heat) + too_much, heat, time) - begun)


def _stopped_at(
    field: CostField, conditions: OperatingConditions, motion: Motion, place: int
) -> Motion | None:
    """A motion that stops at a sample for a moment; None where that breaks a limit."""
    surface = np.hypot(np.hypot(np.diff(motion.x), np.diff(motion.y)), np.diff(motion.heights))
    along = np.append(0.0, np.cumsum(surface))
    kept = Kept(motion, np.ones(len(surface), bool))
    for share in BRAKING:
        squared = 2.0 * share * conditions.model.vehicle.limits.acceleration
        speed = np.minimum(motion.speed, np.sqrt(squared * np.abs(along - along[place])))
        slower = speed < motion.speed
        changed = slower[1:] | slower[:-1]
        seconds = np.diff(motion.time)
        seconds[changed] = 2.0 * surface[changed] / (speed[1:] + speed[:-1])[changed]
        stopped = replace(motion, speed=speed, time=np.append(0.0, np.cumsum(seconds)))
        if not broken_limits(field, conditions, stopped, finely=True, kept=kept):
            return stopped
    return None


def _resting_at(motion: Motion, place: int, seconds: float) -> Motion:
    """A motion that stands for so many s at a sample at which its speed is 0."""
    after = place + 1
    columns = {
        name: np.insert(getattr(motion, name), after, getattr(motion, name)[place])
        for name in ("x", "y", "heights", "yaw", "time", "speed")
    }
    columns["time"][after:] += seconds
    return Motion(
        **columns,
        curvatures=np.insert(motion.curvatures, place, 0.0),
        yaw_accelerations=np.insert(motion.yaw_accelerations, place, 0.0),
    )
