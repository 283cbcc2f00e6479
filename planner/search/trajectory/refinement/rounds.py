"""Rounds in which a motion's yaw is refined, and last its speeds.

    finer = refined_motion(field, conditions, track, steps, yaw, motion, fixed, at_speed, rounds=6)

A round turns the body wherever that costs less at the speeds that are driven, and looks for the
best speeds anew. Every second round has the body turn evenly. That pays where the largest yaw rate
holds the speed down. Speeds change much then, so that further rounds find more to save.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.kernel_arguments import Steps
from planner.search.limit_places import Infeasible
from planner.search.resolution import MORE_LEVELS
from planner.search.trajectory.motion import Motion, motion_rows
from planner.search.trajectory.refinement.finer_speeds import finer_speeds
from planner.search.trajectory.refinement.yaw_refinement import refined_yaw
from planner.search.trajectory.speed_estimate import level_count
from planner.search.trajectory.track import Track
from planner.search.trajectory.turn_on_the_spot import first_contact
from planner.search.trajectory.yaw import YawProfile

MOST_REFINED, LEFT_ALONE = 4, 1.0
"""Refinements of the yaw in a round at most, and m round a place where one breaks a limit that the
next one leaves alone."""
GOES_ON = 5e-4
"""Share of the energy that a round has to save for another one to follow, after the first two."""


class Refined(NamedTuple):
    """A motion, its yaw on its track, and what it takes.

    Attributes:
        motion: within all limits.
        yaw: at the samples of the track.
        joules: that it takes.
    """

    motion: Motion
    yaw: YawProfile
    joules: float


def refined_motion(
    field: CostField,
    conditions: OperatingConditions,
    track: Track,
    steps: Steps,
    yaw: YawProfile,
    motion: Motion,
    fixed: NDArray[np.bool_],
    at_speed: Callable[[YawProfile], Motion | Infeasible],
    *,
    rounds: int,
) -> Motion:
    """A motion along the same track that takes no more energy.

    Args:
        field, conditions, track, steps, yaw: what is driven.
        motion: along the track, within all limits.
        fixed: (samples,) where the yaw was asked for.
        at_speed: the best speeds for a yaw, within all limits.
        rounds: at most.
    """
    best = _account(field, conditions, motion, yaw)
    saves = True
    for number in range(rounds):
        before, saved = best.joules, saves
        best = _finer(
            *(field, conditions, track, steps, best, fixed, at_speed), evenly=number % 2 == 1
        )
        saves = before - best.joules >= GOES_ON * abs(before)
        # A round of either kind may save where the one before, of the other kind, did not.
        if number > 0 and not saves and (number == 1 or not saved):
            break
    if level_count(conditions, track) < MORE_LEVELS:
        return best.motion  # on long steps the speed hardly changes
    finer = _account(field, conditions, finer_speeds(field, conditions, best.motion), best.yaw)
    return min(best, finer, key=lambda one: one.joules).motion


def _account(
    field: CostField, conditions: OperatingConditions, motion: Motion, yaw: YawProfile
) -> Refined:
    """A motion with what it takes."""
    rows, seconds, _ = motion_rows(field, motion, conditions.class_rows, conditions.wind)
    joules = float(conditions.model.power_and_limits(rows)[:, 0] @ seconds)
    return Refined(motion, yaw, joules)


def _finer(
    field: CostField,
    conditions: OperatingConditions,
    track: Track,
    steps: Steps,
    best: Refined,
    fixed: NDArray[np.bool_],
    at_speed: Callable[[YawProfile], Motion | Infeasible],
    *,
    evenly: bool,
) -> Refined:
    """One round. Around places where a limit is then broken, the yaw stays, or turns less."""
    yaw = turned = refined_yaw(
        *(field, conditions, track, steps, best.yaw, best.motion, fixed), evenly=evenly
    )
    left_alone = max(LEFT_ALONE, 3.0 * float(track.lengths.max()))
    share = np.ones(len(track.points))
    for _ in range(MOST_REFINED):
        finer = at_speed(yaw)
        places = finer.places if isinstance(finer, Infeasible) else _touched(field, finer)
        if isinstance(finer, Motion) and not places:
            # Speeds were chosen again, and may cost more than the yaw saves.
            return min(best, _account(field, conditions, finer, yaw), key=lambda one: one.joules)
        for place in places:
            away = np.hypot(*(track.points - place).T)
            share = np.minimum(share, np.clip(away / left_alone - 1.0, 0.0, 1.0))
        yaw = best.yaw.towards(turned, share)
    return best


def _touched(field: CostField, motion: Motion) -> tuple[tuple[float, float], ...]:
    """The first place where the body touches something, if there is one."""
    at = first_contact(field, motion)
    return () if at < 0 else ((float(motion.x[at]), float(motion.y[at])),)
