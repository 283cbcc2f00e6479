"""Energy of driving through poses with the yaw that they have.

energy = score_as_they_are(case, poses)                          # (k, 3)
"""

from __future__ import annotations

import numpy as np

from planner.search.results import price
from planner.search.trajectory import CLOSELY
from planner.search.trajectory.motion import assemble, room_to_move
from planner.search.trajectory.speed_profile import speed_profile
from planner.search.trajectory.track import lay_track, steps_of
from planner.search.trajectory.turn_on_the_spot import first_contact, pose_spacing
from planner.search.trajectory.yaw import YawProfile
from tests.benchmarks.peers.case import Array, Case


def score_as_they_are(case: Case, poses: Array) -> float | None:
    """J of driving through poses (k, 3) with the yaw that they have, at the best speed.

    None where a limit is broken. Corners are rounded as for every path.
    """
    field, conditions = case.field, case.situation.conditions
    limits = conditions.model.vehicle.limits
    spacing = pose_spacing(min(field.dx, field.dy))
    apart = np.hypot(*np.diff(poses[:, :2], axis=0).T) > 1e-9
    kept = poses[np.concatenate([[True], apart])]
    track = lay_track(
        field,
        [np.ascontiguousarray(kept[:, :2])],
        spacing=max(spacing, 0.06 * limits.speed**2 / limits.acceleration),
        speed=limits.speed,
        acceleration=limits.acceleration,
    )
    turns = np.remainder(np.diff(kept[:, 2]) + np.pi, 2.0 * np.pi) - np.pi
    unwound = np.concatenate([[kept[0, 2]], kept[0, 2] + np.cumsum(turns)])
    angles = np.interp(_along(kept[:, :2], track.points), np.arange(len(kept)), unwound)
    track, yaw = room_to_move(
        track,
        YawProfile(angles, angles.copy(), 0.0),
        speed=limits.speed,
        acceleration=limits.acceleration,
    )
    speeds, _ = speed_profile(
        conditions,
        track,
        yaw,
        steps_of(field, track),
        CLOSELY.speeds,
        CLOSELY.levels,
        np.full(len(track.lengths), limits.speed),
        np.full((len(track.lengths), 2), limits.acceleration),
    )
    if speeds is None:
        return None
    motion = assemble(field, track, yaw, speeds, yaw_rate=limits.yaw_rate, spacing=spacing)
    if first_contact(field, motion) >= 0:
        return None
    return price(field, conditions, motion).energy_j


def _along(line: Array, points: Array) -> Array:
    """Where on a polyline (k, 2), counted in its pieces, points (n, 2) beside it are, in order."""
    steps = np.diff(line, axis=0)
    squared = np.maximum((steps**2).sum(axis=1), 1e-18)
    lengths = np.concatenate([[0.0], np.cumsum(np.sqrt(squared))])
    walked = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    walked *= lengths[-1] / walked[-1]
    offsets = points[:, None, :] - line[None, :-1, :]
    share = np.clip((offsets * steps).sum(axis=2) / squared, 0.0, 1.0)
    away = np.hypot(*np.moveaxis(offsets - share[:, :, None] * steps, 2, 0))
    # A way may come near itself again: the piece at about the same distance walked is meant.
    astray = np.abs(lengths[:-1] + share * np.sqrt(squared) - walked[:, None])
    piece = (away + 0.2 * astray).argmin(axis=1)
    at: Array = np.maximum.accumulate(piece + share[np.arange(len(points)), piece])
    return at
