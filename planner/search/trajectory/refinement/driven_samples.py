"""Samples of a driven motion to try other yaws with, more of them where a limit is near.

rows, seconds, place, speed, torque, grip = driven_samples(
    field, conditions, track, steps, yaw, motion
)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.account import LIMITS
from planner.power.motion_row import fill_row, set_motion, set_wind
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField
from planner.search.kernel_arguments import Steps
from planner.search.trajectory.limit_checks import FINEST, NEAR_A_LIMIT, coarse_pieces, rows_on_arcs
from planner.search.trajectory.motion import Motion, motion_rows, pieces_of
from planner.search.trajectory.track import Track
from planner.search.trajectory.yaw import YawProfile

SAMPLED_CELLS = 1.0
"""Cells that three samples of the motion stand for; where a limit is near, as few as its check."""
NEAR = 0.1
"""Share of a limit that is left where it counts as near. The voltage is left out, as less speed
keeps it with any yaw."""
TRACTION_RESERVE = 0.003
"""Share of the traction that stays: the answer is checked more closely than it is sampled here."""
SAME_GRIP = 1e-9
"""Share of the traction by which a sample that does not turn may come out otherwise."""
_VX, _VY, _AX, _AY, _WZ = (INDEX[name] for name in ("vx", "vy", "ax", "ay", "wz"))
_LEAST_LOAD, _CURRENT, _, _TORQUE, _TRACTION_LEFT = range(1, 1 + len(LIMITS))
"""Results of the power model for a row, behind the power."""


class DrivenSamples(NamedTuple):
    """Samples of a motion by the metres driven.

    Attributes:
        rows: (n, ROW_LENGTH) of the power model.
        seconds: (n,) that each stands for.
        place: (n,) horizontal m driven until there.
        speed: (n,) m/s, horizontal.
        torque: (n,) N·m, the most that a motor may give: for good, or what it gave before.
        grip: (n,) least share of the traction that has to stay: TRACTION_RESERVE, or what was left
            before.
    """

    rows: Array
    seconds: Array
    place: Array
    speed: Array
    torque: Array
    grip: Array


def driven_samples(
    field: CostField,
    conditions: OperatingConditions,
    track: Track,
    steps: Steps,
    yaw: YawProfile,
    motion: Motion,
) -> DrivenSamples:
    """Samples of a motion along a track, without its turns on the spot.

    Where a limit is near there are more, which count for no time. They are there once more without
    acceleration, as the speeds change again after the yaw. The steepest ground of a step is among
    them, by which the speed profile checks it.
    """
    rows, seconds, place, speed, _ = _driven_rows(
        *(field, conditions, motion, pieces_of(field, motion, SAMPLED_CELLS))
    )
    coarse, _, _, _, step = _driven_rows(field, conditions, motion, coarse_pieces(field, motion))
    pieces = np.zeros(len(motion.x) - 1, np.int64)
    checked = step[_near(conditions, coarse, NEAR_A_LIMIT).any(axis=0)]
    pieces[checked] = pieces_of(field, motion, FINEST)[checked]
    closer, _, close, pace, _ = _driven_rows(field, conditions, motion, pieces, bends=True)
    as_driven, evenly = _near(conditions, closer, 1.0 - NEAR)
    middle = _middles(track)
    onwards = np.interp(middle, place, speed)
    turns = yaw.arriving[1:] - yaw.leaving[:-1]
    steepest = _steepest(
        *(conditions.class_rows, conditions.wind, steps),
        *(yaw.leaving[:-1] + 0.5 * turns, turns, onwards),
    )
    more = np.concatenate([closer[as_driven], _steady(closer[evenly]), steepest[steps.steep]])
    at = np.concatenate([close[as_driven], close[evenly], middle[steps.steep]])
    paces = np.concatenate([pace[as_driven], pace[evenly], onwards[steps.steep]])
    places = np.append(place, at)
    order = np.argsort(places, kind="stable")
    chosen = np.concatenate([rows, more])[order]
    # Where the motion takes more than motors give for good, that was checked to be brief enough.
    # Samples with hardly any traction left may keep that, and take no more.
    before = conditions.model.power_and_limits(chosen)
    return DrivenSamples(
        chosen,
        np.append(seconds, np.zeros(len(at)))[order],
        places[order],
        np.append(speed, paces)[order],
        np.maximum(conditions.steady.limits[3], before[:, _TORQUE]),
        np.minimum(TRACTION_RESERVE, before[:, _TRACTION_LEFT] - SAME_GRIP),
    )


def _near(conditions: OperatingConditions, rows: Array, share: float) -> NDArray[np.bool_]:
    """(2, n) whether rows (n, ROW_LENGTH) use a share of a limit, as they are and evenly driven."""
    found = conditions.model.power_and_limits(np.concatenate([rows, _steady(rows)]))
    near = (found[:, _LEAST_LOAD] <= 0.0) | (found[:, _TRACTION_LEFT] < 1.0 - share)
    near |= found[:, _CURRENT] > share * conditions.limits[1]
    near |= found[:, _TORQUE] > share * conditions.steady.limits[3]
    return near.reshape(2, -1)


def _steady(rows: Array) -> Array:
    """The same rows (n, ROW_LENGTH) without acceleration."""
    steady = rows.copy()
    steady[:, [_AX, _AY]] = 0.0
    return steady


def _middles(track: Track) -> Array:
    """(steps,) m from the start to the middle of each step."""
    return np.asarray(np.cumsum(track.lengths) - 0.5 * track.lengths)


@njit(cache=True, error_model="numpy")
def _steepest(class_rows: Any, wind: Any, steps: Any, yaw: Any, turns: Any, speeds: Any) -> Any:
    """Rows (steps, ROW_LENGTH) of even driving where the ground of each step is steepest.

    Args:
        class_rows, wind: of OperatingConditions.
        steps: of the track.
        yaw, turns: (steps,) rad, at the middle of each step, and by how much it grows along it.
        speeds: (steps,) m/s, horizontal.
    """
    directions, lengths, _, slopes, _, ground = steps
    rows = np.empty((lengths.shape[0], class_rows.shape[1]))
    for j in range(lengths.shape[0]):
        fill_row(rows[j], class_rows[ground[j]])
        longer = set_motion(rows[j], slopes[j, 2], slopes[j, 3], yaw[j], directions[j], 1.0)
        rows[j, _VX] *= longer * speeds[j]
        rows[j, _VY] *= longer * speeds[j]
        rows[j, _WZ] = turns[j] * speeds[j] / lengths[j]
        set_wind(rows[j], wind, yaw[j])
    return rows


def _driven_rows(
    field: CostField,
    conditions: OperatingConditions,
    motion: Motion,
    pieces: NDArray[np.int64],
    *,
    bends: bool = False,
) -> tuple[Array, Array, Array, Array, NDArray[np.int64]]:
    """Rows of the motion without its turns on the spot; s, m, m/s as in DrivenSamples; the steps.

    ``pieces`` (steps,) are those of ``motion_rows``. With ``bends``, rows on their arcs follow.
    """
    rows, seconds, owner = motion_rows(
        field, motion, conditions.class_rows, conditions.wind, pieces
    )
    if bends:
        more, bent = rows_on_arcs(field, conditions, motion, pieces)
        rows, owner = np.concatenate([rows, more]), np.concatenate([owner, bent])
        seconds = np.append(seconds, np.zeros(len(more)))
    level = np.hypot(np.diff(motion.x), np.diff(motion.y))
    surface = np.hypot(level, np.diff(motion.heights))
    moving = (level > 0.0)[owner]
    rows, seconds, owner = rows[moving], seconds[moving], owner[moving]
    begun, driven = (np.concatenate([[0.0], np.cumsum(one)]) for one in (level, surface))
    flatter = level[owner] / surface[owner]
    place = begun[owner] + (rows[:, INDEX["odometer"]] - driven[owner]) * flatter
    return rows, seconds, place, np.hypot(rows[:, _VX], rows[:, _VY]) * flatter, owner
