"""Checks of a motion against all limits, and lower caps where it breaks one.

    broken = broken_limits(field, conditions, motion)        # samples, fifteen a cell or more
    ease(broken, motion, track, fastest, hardest)        # caps for another speed profile

The yaw and speed profiles look at few points of every step. Ground between them may be steeper, and
at the faster end of a ramp a motor needs more voltage.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.limits import LIMIT_NAMES, broken_in_results
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.limit_places import Infeasible
from planner.search.trajectory.motion import Motion, metres, motion_rows, pieces_of
from planner.search.trajectory.track import Track

FINENESS, FINEST = 0.2, 0.05
"""Cells that three samples stand for: everywhere, and where a limit is near."""
FINEST_SECONDS = 0.015
"""s that three samples stand for at most where a limit is near, unless less than the following
changes meanwhile."""
SAME_GROUND, SAME_SPEED, SAME_YAW = 0.01, 0.002, math.radians(1.0)
"""Cells, share of the largest speed, and rad that three samples may stand for however long that
lasts: on cells of tens of metres a step lasts for seconds, and little changes on it."""
NEAR_A_LIMIT = 0.85
"""Share of a limit from which it is near. Samples leave out a ninth of a step at either end; there
a motor that speeds up evenly from rest needs an eighth more voltage."""
NEAR_A_JUMP = 0.6
"""The same on a bend, and beside a stop. From one chord of a bend to the next the travel changes
its direction at once, and a wheel may turn the other way for a moment: its drag then loads the
motor. Drag that helps to brake fades at the very end."""
MOST_KEPT, LEAST_KEPT = 0.98, 0.4
"""Largest and least factor on the speed, or on the acceleration, where a limit was broken: what it
takes is read off the same motion creeping, and that is an estimate."""
STEADY_SHARE = 0.02
"""Share of the largest acceleration below which the speed is eased instead."""
ROUNDING = 1e-6
"""Share by which acceleration and yaw rate may exceed their limits."""
ALONG = (*LIMIT_NAMES, "acceleration", "yaw rate")
"""Limits that a broken one is a number into."""
_ACCELERATION, _YAW_RATE = len(LIMIT_NAMES), len(LIMIT_NAMES) + 1
BISECTED = 8
"""Times that the share of the speed is halved at which a limit is kept: to 0.4 % of the speed, less
than a level."""
CREEPING = 0.1
"""Share of the speed at which it is seen whether less speed keeps a limit."""
_RESULT = np.array([1, 5, 2, 3, 4])
"""Columns of a row's results by limit: least load, traction left, current, voltage, torque."""
_SPEEDS = [INDEX[name] for name in ("vx", "vy", "wz")]
_RATES = [INDEX[name] for name in ("ax", "ay", "yaw_acceleration", "slope_rate")]


@dataclass(frozen=True)
class Broken:
    """Samples of a motion at which a limit is broken.

    Attributes:
        steps: (n,) of the motion.
        limits: (n,) numbers into ALONG.
        values, allowed: (n,) what is reached there, and the limit; SI.
        however_slow: (n,) whether creeping evenly breaks a limit as well.
        kept: (n,) share of what speed and acceleration add to the value there that the limit leaves
            room for.
        slower: (n,) share of the speed at which it is kept, with the same bend.
    """

    steps: NDArray[np.int64]
    limits: NDArray[np.int64]
    values: Array
    allowed: Array
    however_slow: NDArray[np.bool_]
    kept: Array
    slower: Array

    def __bool__(self) -> bool:
        return len(self.steps) > 0

    def and_of(self, other: Broken) -> Broken:
        """These, and those of another check at steps at which this one found none."""
        more = ~np.isin(other.steps, self.steps)
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Broken(*(np.concatenate([mine, theirs[more]]) for mine, theirs in pairs))

    def at(self, x: float, y: float, others: Array | None = None) -> Infeasible:
        """One that no speed keeps, or the first; in the way at a place and at ``others`` (m, 2)."""
        one = int(self.however_slow.argmax())
        name = ALONG[self.limits[one]]
        return Infeasible(
            float(x),
            float(y),
            f"the limit of {name} is broken",
            limit=name,
            value=float(self.values[one]),
            allowed=float(self.allowed[one]),
            others=() if others is None else tuple((float(a), float(b)) for a, b in others),
        )


@dataclass(frozen=True)
class Kept:
    """A motion that was checked finely, and where it keeps all limits.

    Attributes:
        motion: the motion.
        everywhere: (steps,) whether all limits are kept there.
    """

    motion: Motion
    everywhere: NDArray[np.bool_]

    @classmethod
    def by(cls, motion: Motion, broken: Broken) -> Kept:
        """What a check of a whole motion showed."""
        kept = np.ones(len(motion.x) - 1, bool)
        kept[broken.steps] = False
        return cls(motion, kept)

    def on(self, motion: Motion) -> NDArray[np.bool_]:
        """(steps,) where another motion does the same, and so keeps all limits as well."""
        if len(motion.x) != len(self.motion.x):
            return np.zeros(len(motion.x) - 1, bool)
        samples = np.ones(len(motion.x), bool)
        for one, other in ((motion.x, self.motion.x), (motion.y, self.motion.y)):
            samples &= one == other
        for one, other in ((motion.yaw, self.motion.yaw), (motion.speed, self.motion.speed)):
            samples &= one == other
        return self.everywhere & samples[1:] & samples[:-1]


def broken_limits(
    field: CostField,
    conditions: OperatingConditions,
    motion: Motion,
    *,
    finely: bool = False,
    kept: Kept | None = None,
) -> Broken:
    """Where a motion breaks a limit; no speed helps a turn on the spot.

    Args:
        field, conditions, motion: map, model and the motion.
        finely: as closely as the answer is checked: again, at close samples, where a limit is
            near.
        kept: of another motion along the same track, checked finely; where both do the same,
            nothing is looked at.
    """
    everywhere = coarse_pieces(field, motion)
    asked = np.ones(len(everywhere), bool) if kept is None else ~kept.on(motion)
    pieces = np.where(with_neighbours(asked), everywhere, 0)
    broken, used = _broken_among(field, conditions, motion, pieces)
    near = asked & ((used >= NEAR_A_LIMIT) | near_a_jump(motion, used))
    if not finely or not near.any():
        return broken
    beside = np.where(with_neighbours(near), everywhere, 0)
    pieces = np.where(near, fine_pieces(field, motion), beside)
    return _broken_among(field, conditions, motion, pieces, near)[0].and_of(broken)


def near_a_jump(motion: Motion, used: Array) -> NDArray[np.bool_]:
    """(steps,) of bends and beside stops that use much of a limit; ``used`` (steps,)."""
    jumps = (motion.curvatures != 0.0) | (motion.speed[1:] == 0.0) | (motion.speed[:-1] == 0.0)
    return np.asarray(jumps & (used >= NEAR_A_JUMP))


def with_neighbours(steps: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Steps and those beside them, with which the slope's rate of change is found."""
    wide = steps.copy()
    wide[1:] |= steps[:-1]
    wide[:-1] |= steps[1:]
    return wide


def _broken_among(
    field: CostField,
    conditions: OperatingConditions,
    motion: Motion,
    pieces: NDArray[np.int64],
    near: NDArray[np.bool_] | None = None,
) -> tuple[Broken, Array]:
    """What is broken at some samples; (steps,) largest share of a limit at those of each step.

    With ``near`` (steps,), bends among these are looked at on their arcs as well.
    """
    rows, _, owner = motion_rows(field, motion, conditions.class_rows, conditions.wind, pieces)
    if near is not None:
        bends, bent = rows_on_arcs(field, conditions, motion, np.where(near, pieces, 0))
        rows, owner = np.concatenate([rows, bends]), np.concatenate([owner, bent])
    found = conditions.model.power_and_limits(rows)
    numbers = _numbers(found, conditions.limits)
    moving = np.hypot(np.diff(motion.x), np.diff(motion.y)) > 1e-9
    at = np.flatnonzero(numbers >= 0)
    allowed = np.array([0.0, 0.0, *conditions.limits[1:4]])
    steps, limits = [owner[at]], [numbers[at]]
    reached, most = [found[at, _RESULT[numbers[at]]]], [allowed[numbers[at]]]
    creeping = _creeping(conditions, rows[at])
    always = [(_numbers(creeping, conditions.limits) >= 0) | ~moving[owner[at]]]
    slow = creeping[np.arange(len(at)), _RESULT[numbers[at]]]
    with np.errstate(divide="ignore", invalid="ignore"):
        kept = [np.nan_to_num(np.clip((most[0] - slow) / (reached[0] - slow), 0.0, 1.0))]
    slower = [_share_that_holds(conditions, rows[at])]
    for number, (rate, limit) in enumerate(motion_rates(conditions, motion), _ACCELERATION):
        at = np.flatnonzero((rate > limit * (1.0 + ROUNDING)) & moving)
        steps.append(at)
        limits.append(np.full(len(at), number))
        reached.append(rate[at])
        most.append(np.full(len(at), limit))
        always.append(np.zeros(len(at), np.bool_))
        kept.append(limit / rate[at])
        slower.append(limit / rate[at])
    columns = steps, limits, reached, most, always, kept, slower
    joined = [np.concatenate(parts) for parts in columns]
    used = np.zeros(len(moving))
    np.maximum.at(used, owner, limit_shares(conditions, found).max(axis=1))
    return Broken(*joined), used


def rows_on_arcs(
    field: CostField, conditions: OperatingConditions, motion: Motion, pieces: NDArray[np.int64]
) -> tuple[Array, NDArray[np.int64]]:
    """Rows of bends on their arcs, as the robot drives them, and their steps.

    The poses are the ends of chords. A robot that is near a limit along a chord may break it where
    its travel is turned by half of what the chord's arc turns by.
    """
    bent = np.where(motion.curvatures != 0.0, pieces, 0)
    rows, _, owner = motion_rows(
        field, motion, conditions.class_rows, conditions.wind, bent, on_arcs=True
    )
    return rows, owner


def _creeping(conditions: OperatingConditions, rows: Array) -> Array:
    """``PowerModel.power_and_limits`` of rows (n, columns) when they are slow and even."""
    slow = rows.copy()
    slow[:, _SPEEDS] *= CREEPING
    slow[:, _RATES] = 0.0
    return conditions.model.power_and_limits(slow)


def _share_that_holds(conditions: OperatingConditions, rows: Array) -> Array:
    """(n,) share of the speed, by bisection, at which rows (n, columns) keep all limits.

    CREEPING where that does not keep them either. Drag grows fast at low speed and hardly at high
    speed: a straight line between two speeds says too little, and a round would follow for each
    level of speed.
    """
    low, high = np.full(len(rows), CREEPING), np.ones(len(rows))
    for _ in range(BISECTED if len(rows) else 0):
        middle = 0.5 * (low + high)
        slow = rows.copy()
        slow[:, _SPEEDS] *= middle[:, None]
        slow[:, _RATES] *= middle[:, None] ** 2
        holds = _numbers(conditions.model.power_and_limits(slow), conditions.limits) < 0
        low, high = np.where(holds, middle, low), np.where(holds, high, middle)
    return low


def limit_shares(conditions: OperatingConditions, found: Array) -> Array:
    """(n, limits of LIMIT_NAMES) share that is used of each; 1 is the limit itself.

    The wheel load's share is what the least loaded wheel lacks of its load on level ground.

    Args:
        conditions: model and limits.
        found: (n, 6) of ``PowerModel.power_and_limits``.
    """
    own_load = conditions.mass * STANDARD_GRAVITY / len(conditions.model.wheels)
    _, least_load, current, voltage, torque, traction_left = found.T
    _, most_current, most_voltage, peak_torque = conditions.limits[:4]
    return np.column_stack(
        [
            1.0 - least_load / own_load,
            1.0 - traction_left,
            current / most_current,
            voltage / most_voltage,
            torque / peak_torque,
        ]
    )


def coarse_pieces(field: CostField, motion: Motion) -> NDArray[np.int64]:
    """(steps,) pieces of a motion in which limits are looked for everywhere."""
    return pieces_of(field, motion, FINENESS)


def fine_pieces(field: CostField, motion: Motion) -> NDArray[np.int64]:
    """(steps,) pieces of a motion in which they are looked for where one is near."""
    faster = np.abs(np.diff(motion.speed)) / max(float(motion.speed.max()), 1e-12)
    changes = np.maximum(faster / SAME_SPEED, np.abs(np.diff(motion.yaw)) / SAME_YAW)
    changes = np.maximum(changes, pieces_of(field, motion, SAME_GROUND))
    by_time = np.minimum(np.diff(motion.time) / FINEST_SECONDS, changes)
    return np.maximum(pieces_of(field, motion, FINEST), np.ceil(by_time).astype(np.int64))


def motion_rates(
    conditions: OperatingConditions, motion: Motion
) -> tuple[tuple[Array, float], tuple[Array, float]]:
    """Largest acceleration, along and across together, and yaw rate of every step; their limits.

    (n - 1,) m/s² and rad/s each.
    """
    limits = conditions.model.vehicle.limits
    seconds = np.diff(motion.time)
    faster = np.maximum(motion.speed[1:], motion.speed[:-1])
    acceleration = np.hypot(np.diff(motion.speed) / seconds, faster**2 * motion.curvatures)
    # A body that moves turns as fast as it gets on.
    pace = np.where(faster > 0.0, 2.0 * faster / (motion.speed[1:] + motion.speed[:-1] + 1e-300), 1)
    rate = np.abs(np.diff(motion.yaw)) / seconds * pace
    rate += 0.5 * np.abs(motion.yaw_accelerations) * seconds
    return (acceleration, limits.acceleration), (rate, limits.yaw_rate)


@njit(cache=True, error_model="numpy", nogil=True)
def _numbers(found: Any, limits: Any) -> Any:
    numbers = np.empty(found.shape[0], np.int64)
    for k in range(found.shape[0]):
        numbers[k] = broken_in_results(found[k], limits)
    return numbers


def ease(
    broken: Broken,
    motion: Motion,
    track: Track,
    fastest: Array,
    hardest: Array,
) -> NDArray[np.int64]:
    """Lower the speed where the voltage does not suffice, else the acceleration.

    Args:
        broken: of ``motion``.
        motion: along ``track``, perhaps with samples of its own.
        track: samples of the path.
        fastest: (steps of the track,) m/s, lowered in place.
        hardest: (steps of the track, 2) m/s² of speeding up and of slowing down, lowered in place.

    Returns:
        steps of the track at which no speed helps.
    """
    along = metres(motion.x, motion.y)
    ends = np.cumsum(track.lengths)
    most = float(hardest.max())
    speed = np.maximum(motion.speed[1:], motion.speed[:-1])
    faster = np.diff(motion.speed) / np.diff(motion.time)
    change, sideways = np.abs(faster), speed**2 * np.abs(motion.curvatures)
    found: dict[tuple[int, int], tuple[float, float]] = {}
    for step, limit, *shares in zip(
        *(broken.steps.tolist(), broken.limits.tolist()),
        *(broken.kept.tolist(), broken.slower.tolist()),
        strict=True,
    ):
        before = found.get((step, limit), (1.0, 1.0))
        found[step, limit] = min(before[0], shares[0]), min(before[1], shares[1])
    for (step, limit), (share, holds) in found.items():
        place = int(np.searchsorted(ends, 0.5 * (along[step] + along[step + 1])))
        near = slice(max(0, place - 1), place + 2)
        name = ALONG[limit]
        kept = min(max(share, LEAST_KEPT), MOST_KEPT)
        # What a motor and a wheel take of a bend goes with the square of the speed.
        slower, gentler = kept if name == "voltage" else math.sqrt(kept), kept
        if name != "voltage" and max(sideways[step], change[step]) < STEADY_SHARE * most:
            slower = min(holds, MOST_KEPT)
        if name in ("acceleration", "yaw rate"):
            # The step's ground is a little shorter than its slope in the middle said.
            slower = gentler = (1.0 - 1e-3) * share
        bends = sideways[step] > change[step] or change[step] < STEADY_SHARE * most
        if name == "acceleration":
            bends = change[step] < 0.5 / share * most
        if name in ("voltage", "yaw rate") or bends:
            fastest[near] = np.minimum(fastest[near], slower * speed[step])
        else:
            column = 0 if faster[step] > 0.0 else 1
            hardest[near, column] = np.minimum(hardest[near, column], gentler * change[step])
    hopeless = broken.steps[broken.however_slow]
    return np.unique(np.searchsorted(ends, 0.5 * (along[hopeless] + along[hopeless + 1])))
