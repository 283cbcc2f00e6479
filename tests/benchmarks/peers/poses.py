"""Our cost in three dimensions: what a straight motion between two poses costs, yaw included.

    prices = turning_prices(case)
    pose_cost(case.field, *prices, xa, ya, yaw_a, xb, yb, yaw_b)     # J dissipated; inf: impossible
    energy = score_as_they_are(case, poses)                          # (k, 3), with their own yaw

Position and yaw change evenly along a motion, yaw by the shorter way. Metres cost what the tables
of planner.search.steady.steady_cost say for the body's angle to the travel; turning costs what it
takes on the spot, and on the move as much without the electronics, which metres pay already.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from planner.quantities import INDEX
from planner.search.field import ground_classes
from planner.search.kernel_arguments import Steps
from planner.search.resolution import ALL_YAWS, YAWS
from planner.search.results import price
from planner.search.steady import polar
from planner.search.trajectory import CLOSELY
from planner.search.trajectory.motion import assemble, room_to_move
from planner.search.trajectory.speed_profile import speed_profile
from planner.search.trajectory.track import lay_track, slopes_of_steps
from planner.search.trajectory.turn_on_the_spot import first_contact, pose_spacing
from planner.search.trajectory.yaw_profile import YawProfile
from planner.terrain.footprint import body_fits
from planner.terrain.interpolation import interpolate
from tests.benchmarks.peers.case import Array, Case


def turning_prices(case: Case) -> tuple[float, float]:
    """J/rad of turning on the spot at full rate, and of turning while the robot drives."""
    around = case.situation.around
    rate = around.model.vehicle.limits.yaw_rate
    rows = np.repeat(around.class_rows[:1], 2, axis=0)
    rows[1, INDEX["wz"]] = rate
    still, turning = (float(watts) for watts in around.model.watts(rows))
    return turning / rate, (turning - still) / rate


@njit(cache=True, error_model="numpy")
def pose_cost(
    field: Any,
    on_the_spot: float,
    on_the_move: float,
    xa: float,
    ya: float,
    yaw_a: float,
    xb: float,
    yb: float,
    yaw_b: float,
) -> float:
    """J dissipated between two poses by the midpoint rule; infinity where a limit is broken."""
    ny, nx = field.heights.shape
    ex, ey = xb - xa, yb - ya
    length = math.sqrt(ex * ex + ey * ey)
    turn = yaw_b - yaw_a
    turn -= 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))
    spots = length < 1e-9
    count = max(1, int(math.ceil(length / field.step)), int(abs(turn) / 0.2))
    direction = math.atan2(ey, ex)
    total = 0.0
    for k in range(count):
        w = (k + 0.5) / count
        x, y, yaw = xa + w * ex, ya + w * ey, yaw_a + w * turn
        i = min(max(int(math.floor((x - field.x0) / field.dx + 0.5)), 0), nx - 1)
        j = min(max(int(math.floor((y - field.y0) / field.dy + 0.5)), 0), ny - 1)
        if field.mask[j, i] != ALL_YAWS and not body_fits(field, x, y, yaw):
            return np.inf
        if spots:
            continue
        _, px, py = interpolate(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
        steepness = math.sqrt(px * px + py * py)
        azimuth = math.atan2(py, px) - direction
        a = (yaw - direction) / (2.0 * math.pi) * YAWS
        a -= YAWS * math.floor(a / YAWS)
        t = int(a) % YAWS
        share = a - int(a)
        ground = field.ground[j, i]
        metre, weights = 0.0, 0.0
        for at, weight in ((t, 1.0 - share), ((t + 1) % YAWS, share)):
            by_yaw, yaw_limit = field.by_yaw[ground, at], field.yaw_limit[ground, at]
            cost = polar(by_yaw, yaw_limit, azimuth, steepness, 1.0)
            # Between an angle at which the slope can be climbed and one at which it cannot, the
            # better one speaks: planners here have it easier than ours.
            if weight > 0.0 and cost < np.inf:
                metre += weight * cost
                weights += weight
        if weights == 0.0:
            return np.inf
        total += metre / weights
    rate = on_the_spot if spots else on_the_move
    return total * length / count + abs(turn) * rate


@njit(cache=True, error_model="numpy")
def pose_free(field: Any, x: float, y: float, yaw: float) -> bool:
    """Whether the body fits at a pose and its slope can be stood on."""
    ny, nx = field.heights.shape
    i = min(max(int(math.floor((x - field.x0) / field.dx + 0.5)), 0), nx - 1)
    j = min(max(int(math.floor((y - field.y0) / field.dy + 0.5)), 0), ny - 1)
    if field.mask[j, i] != ALL_YAWS and not body_fits(field, x, y, yaw):
        return False
    _, px, py = interpolate(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
    return bool(px * px + py * py < field.limit.max() ** 2)


def score_as_they_are(case: Case, poses: Array) -> float | None:
    """J of driving through poses (k, 3) with the yaw that they have, at the best speed.

    None where a limit is broken. Corners are rounded as for every path.
    """
    field, around = case.field, case.situation.around
    limits = around.model.vehicle.limits
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
    track, yaw = room_to_move(track, YawProfile(angles, angles.copy(), 0.0))
    middle = 0.5 * (track.points[1:] + track.points[:-1])
    speeds, _ = speed_profile(
        around,
        track,
        yaw,
        Steps(
            track.directions,
            track.lengths,
            slopes_of_steps(field, track.points),
            ground_classes(field, middle),
        ),
        0,
        CLOSELY.speeds,
        np.full(len(track.lengths), limits.speed),
        np.full(len(track.lengths), limits.acceleration),
    )
    if speeds is None:
        return None
    motion = assemble(field, track, yaw, speeds, yaw_rate=limits.yaw_rate, spacing=spacing)
    if first_contact(field, motion) >= 0:
        return None
    return price(field, around, motion).energy_j


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
