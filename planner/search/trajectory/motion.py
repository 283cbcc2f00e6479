"""A finished motion: samples in time, and the rows of the power model along it.

``assemble`` puts a track with its yaw and speed into time. ``motion_rows`` divides it into fine
steps, so that the power model can share its energy out by effect. Between two samples, position,
yaw and speed change evenly in time, as a reader of the poses would assume.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.motion_row import fill_row, set_acceleration, set_motion, set_wind
from planner.quantities import INDEX, ROW_LENGTH
from planner.search.field import CostField, sample_surface
from planner.search.resolution import SPIN_UP
from planner.search.trajectory.arcs import Arcs, arcs_of
from planner.search.trajectory.track import Track
from planner.search.trajectory.yaw import YawProfile
from planner.terrain.interpolation import interpolate

_VX, _VY, _WZ = INDEX["vx"], INDEX["vy"], INDEX["wz"]
_YAW_ACCELERATION = INDEX["yaw_acceleration"]
_SLOPE_RATE, _ODOMETER = INDEX["slope_rate"], INDEX["odometer"]
_TIME = INDEX["time_since_start"]
_GX, _GY, _GN = INDEX["gravity_x"], INDEX["gravity_y"], INDEX["gravity_normal"]
# Gauss-Legendre nodes and weights on [0, 1], exact for quintics.
_THREE = (
    (0.5 - math.sqrt(0.15), 5 / 18),
    (0.5, 8 / 18),
    (0.5 + math.sqrt(0.15), 5 / 18),
)
SPIN_STEP = math.radians(10.0)
"""rad, largest turn on the spot between two poses of an answer."""
RAMP_SAMPLES = (0.15, 0.5, 1.0)
"""Samples beside a stop on a long step, in distances to full speed: levels of speed lie between."""
LONG_STEP = 2.0
"""Distances to full speed beyond which a step is long."""


@dataclass(frozen=True)
class Motion:
    """A finished motion: samples in time, with turns on the spot as samples of their own.

    Attributes:
        x, y, yaw, time, speed: (n,) at every sample, SI; speed along the surface.
        heights: (n,) m at which the robot rides.
        curvatures: (n - 1,) 1/m of every step.
        yaw_accelerations: (n - 1,) rad/s² of every step.
    """

    x: Array
    y: Array
    heights: Array
    yaw: Array
    time: Array
    speed: Array
    curvatures: Array
    yaw_accelerations: Array

    @cached_property
    def arcs(self) -> Arcs:
        """The arcs on which the robot drives from sample to sample."""
        return arcs_of(self.x, self.y, self.curvatures)

    def along(self, path: Array, values: Array) -> Array:
        """Values (samples,) where the motion is nearest to each point of its path (k, 2)."""
        return np.asarray(read_along(self.x, self.y, values, path, metres(*path.T)), float)

    @property
    def rests(self) -> NDArray[np.int64]:
        """Steps on which the robot neither drives nor turns, so that its motors cool."""
        still = (np.diff(self.x) == 0.0) & (np.diff(self.y) == 0.0) & (np.diff(self.yaw) == 0.0)
        return np.flatnonzero(still & (self.speed[1:] == 0.0))


def metres(x: Array, y: Array) -> Array:
    """(n,) m from the first sample, horizontal."""
    return np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))


def assemble(
    field: CostField,
    track: Track,
    yaw: YawProfile,
    speeds: Array,
    *,
    yaw_rate: float,
    spacing: float,
) -> Motion:
    """Put a track, its yaw and speed into time; turns on the spot ramp their yaw rate up and down.

    Args:
        field: map.
        track, yaw, speeds: samples of the path, and yaw and speed there.
        yaw_rate: rad/s of a turn on the spot.
        spacing: m, largest distance of the motion's own samples.
    """
    track, yaw, speeds = _closer(track, yaw, speeds, spacing)
    heights, _ = sample_surface(field, track.points)
    surface = np.hypot(track.lengths, np.diff(heights))
    # One row for each pose: sample, yaw, speed; and of the step before: s, 1/m, rad/s².
    places = np.flatnonzero(np.append(True, surface > 0.0))
    before = places[1:] - 1
    poses = np.zeros((len(places), 6))
    poses[:, 0], poses[:, 1], poses[:, 2] = places, yaw.arriving[places], speeds[places]
    poses[1:, 3] = 2.0 * surface[before] / (speeds[before] + speeds[before + 1])
    poses[1:, 4] = track.curvatures[before]
    spins = yaw.leaving - yaw.arriving
    turned: list[tuple[float, ...]] = []
    at: list[int] = []
    for place in np.flatnonzero(np.abs(spins) > 1e-9):
        begun = float(yaw.arriving[place])
        for angle, after, acceleration in _turn_on_the_spot(float(spins[place]), yaw_rate):
            turned.append((float(place), begun + angle, 0.0, after, 0.0, acceleration))
            at.append(int(np.searchsorted(places, place, side="right")))
    if turned:
        poses = np.insert(poses, at, np.array(turned), axis=0)
    number = poses[:, 0].astype(np.int64)
    x, y = np.ascontiguousarray(track.points[number].T)
    _, angles, pace, seconds, _, _ = np.ascontiguousarray(poses.T)
    curvatures, accelerations = np.ascontiguousarray(poses[1:, 4:].T)
    return Motion(
        x, y, heights[number], angles, np.cumsum(seconds), pace, curvatures, accelerations
    )


def joined(parts: Sequence[Motion]) -> Motion:
    """Motions that follow each other: each begins as the one before it ends, at rest."""
    whole = parts[0]
    for part in parts[1:]:
        # The same direction, but perhaps whole turns apart.
        turns = round((whole.yaw[-1] - part.yaw[0]) / (2.0 * math.pi))
        whole = Motion(
            np.append(whole.x, part.x[1:]),
            np.append(whole.y, part.y[1:]),
            np.append(whole.heights, part.heights[1:]),
            np.append(whole.yaw, part.yaw[1:] + 2.0 * math.pi * turns),
            np.append(whole.time, part.time[1:] + whole.time[-1]),
            np.append(whole.speed, part.speed[1:]),
            np.append(whole.curvatures, part.curvatures),
            np.append(whole.yaw_accelerations, part.yaw_accelerations),
        )
    return whole


def place_at(motion: Motion, step: int, time: float) -> tuple[float, float]:
    """Position (x, y) in m on a step at a time."""
    share = float(shares_driven(motion, np.array([step]), np.array([time]))[0])
    x, y = motion.x, motion.y
    return (
        float(x[step] + share * (x[step + 1] - x[step])),
        float(y[step] + share * (y[step + 1] - y[step])),
    )


def shares_driven(motion: Motion, steps: NDArray[np.int64], times: Array) -> Array:
    """Shares (n,) of the steps' lengths that are behind the robot at times (n,)."""
    begun, ended = motion.time[steps], motion.time[steps + 1]
    before, after = motion.speed[steps], motion.speed[steps + 1]
    share = np.clip((times - begun) / (ended - begun), 0.0, 1.0)
    mean = 0.5 * (before + after)
    gone = share * (before + 0.5 * (after - before) * share) / np.maximum(mean, 1e-300)
    return np.where(mean > 0.0, gone, share)


def room_to_move(
    track: Track, yaw: YawProfile, *, speed: float, acceleration: float
) -> tuple[Track, YawProfile]:
    """The same track with samples close to where the robot stands still on long steps.

    Acceleration is constant on a step. So without them, a robot that stops to turn would creep over
    a whole step on either side. Between two places at which it stands there is one at least.

    Args:
        track, yaw: samples of the path, and yaw there.
        speed, acceleration: m/s and m/s², the vehicle's limits.
    """
    ramp = speed * speed / (2.0 * acceleration)
    still = track.stops | (np.abs(yaw.leaving - yaw.arriving) > 1e-9)
    stands = np.column_stack([still[:-1], still[1:]])
    long = stands & (track.lengths > LONG_STEP * ramp)[:, None]
    if not stands.all(axis=1).any() and not long.any():
        return track, yaw
    step, share = [np.arange(len(track.lengths))], [np.ones(len(track.lengths))]
    for at in RAMP_SAMPLES:
        for begins, side in ((True, long[:, 0]), (False, long[:, 1])):
            found = np.flatnonzero(side)
            part = at * ramp / track.lengths[found]
            step.append(found)
            share.append(part if begins else 1.0 - part)
    short = np.flatnonzero(stands.all(axis=1) & ~long[:, 0])
    step.append(short)
    share.append(np.full(len(short), 0.5))
    steps, shares = np.concatenate(step), np.concatenate(share)
    order = np.lexsort((shares, steps))
    track, yaw, _ = _divided(track, yaw, np.zeros(len(still)), steps[order], shares[order])
    return track, yaw


def _closer(
    track: Track, yaw: YawProfile, speeds: Array, spacing: float
) -> tuple[Track, YawProfile, Array]:
    """The same motion with samples no further apart than ``spacing``."""
    counts = np.maximum(1, np.ceil(track.lengths / spacing - 1e-9)).astype(np.int64)
    if (counts == 1).all():
        return track, yaw, speeds
    step = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(1, len(step) + 1) - (np.cumsum(counts) - counts)[step]) / counts[step]
    return _divided(track, yaw, speeds, step, share)


def _divided(
    track: Track, yaw: YawProfile, speeds: Array, step: NDArray[np.int64], share: Array
) -> tuple[Track, YawProfile, Array]:
    """The same motion with steps in parts: the step of every part, and the share at its end."""
    last = share == 1.0
    parts = np.bincount(step, minlength=len(track.lengths))

    def spread(before: Array, after: Array) -> Array:
        return np.concatenate([before[:1], before[step] + (after[step] - before[step]) * share])

    points = np.vstack(
        [
            track.points[:1],
            track.points[step] + (track.points[step + 1] - track.points[step]) * share[:, None],
        ]
    )
    arriving = spread(yaw.leaving[:-1], yaw.arriving[1:])
    arriving[0] = yaw.arriving[0]
    leaving = arriving.copy()
    leaving[0] = yaw.leaving[0]
    leaving[1:][last] = yaw.leaving[1:]
    stops = np.concatenate([track.stops[:1], last & track.stops[step + 1]])
    begun = np.where(np.append(True, last[:-1]), 0.0, np.append(0.0, share[:-1]))
    closer = Track(
        points,
        track.directions[step],
        track.lengths[step] * (share - begun),
        track.curvatures[step],
        stops,
        tuple(int(parts[:mark].sum()) for mark in track.marks),
    )
    # Acceleration is constant on a step, so it is the squared speed that is even in distance.
    squared = spread(speeds[:-1] ** 2, speeds[1:] ** 2)
    return closer, YawProfile(arriving, leaving, yaw.cost), np.sqrt(squared)


def _turn_on_the_spot(spin: float, rate: float) -> list[tuple[float, float, float]]:
    """(angle so far, s since the point before, rad/s²) of a turn that ramps its yaw rate."""
    acceleration = SPIN_UP * rate
    ramp = min(rate / acceleration, math.sqrt(abs(spin) / acceleration))
    top = acceleration * ramp
    cruise = (abs(spin) - top * ramp) / top
    side = math.copysign(1.0, spin)
    parts, angle = [], 0.0
    for k in range(4):
        angle += top * ramp / 4 * (2 * k + 1) / 8
        parts.append((side * angle, ramp / 4, side * acceleration))
    if cruise > 1e-9:
        pieces = math.ceil(top * cruise / SPIN_STEP)
        for _ in range(pieces):
            angle += top * cruise / pieces
            parts.append((side * angle, cruise / pieces, 0.0))
    for k in range(4):
        angle += top * ramp / 4 * (7 - 2 * k) / 8
        parts.append((side * angle, ramp / 4, -side * acceleration))
    return parts


@njit(cache=True, error_model="numpy", nogil=True)
def _motion_rows(field: Any, motion: Any, class_rows: Any, wind: Any, pieces: Any) -> Any:
    x, y, z, yaw, time, speed, curvatures, yaw_accelerations, begun, change = motion
    steps = x.shape[0] - 1
    total = 0
    for j in range(steps):
        total += 3 * pieces[j]
    rows = np.empty((total, ROW_LENGTH))
    seconds = np.empty(total)
    owner = np.empty(total, np.int64)
    ny, nx = field.heights.shape
    n = 0
    odometer = 0.0
    for j in range(steps):
        duration = time[j + 1] - time[j]
        ex, ey, ez = x[j + 1] - x[j], y[j + 1] - y[j], z[j + 1] - z[j]
        surface = math.sqrt(ex * ex + ey * ey + ez * ez)
        moving = surface > 1e-9
        direction = math.atan2(ey, ex) if moving else yaw[j]
        turn = yaw[j + 1] - yaw[j]
        # Constant acceleration between the samples' speeds.
        acceleration = (speed[j + 1] - speed[j]) / duration
        mean = 0.5 * (speed[j] + speed[j + 1])
        for piece in range(pieces[j]):
            for at, share in _THREE:
                w = (piece + at) / pieces[j]
                here = speed[j] + (speed[j + 1] - speed[j]) * w
                # Share of the distance after a share w of the time.
                gone = w
                if moving:
                    gone = w * (speed[j] + 0.5 * (speed[j + 1] - speed[j]) * w) / mean
                px, py = x[j] + ex * gone, y[j] + ey * gone
                i = min(max(int(math.floor((px - field.x0) / field.dx + 0.5)), 0), nx - 1)
                k = min(max(int(math.floor((py - field.y0) / field.dy + 0.5)), 0), ny - 1)
                fill_row(rows[n], class_rows[field.ground[k, i]])
                _, slope_x, slope_y = interpolate(
                    field.heights, field.x0, field.y0, field.dx, field.dy, px, py
                )
                angle = yaw[j] + turn * gone
                rate = turn / duration
                if moving:
                    rate = turn * here / surface
                else:
                    rate += yaw_accelerations[j] * (w - 0.5) * duration
                    angle = yaw[j] + turn * w
                if begun.shape[0] > 0:
                    direction = begun[j] + change[j] * gone
                set_motion(rows[n], slope_x, slope_y, angle, direction, here if moving else 0.0)
                if moving:
                    set_acceleration(
                        rows[n],
                        acceleration,
                        here * here * curvatures[j],
                        rows[n, _VX],
                        rows[n, _VY],
                        max(here, 1e-12),
                    )
                rows[n, _WZ] = rate
                rows[n, _YAW_ACCELERATION] = yaw_accelerations[j]
                set_wind(rows[n], wind, angle)
                rows[n, _TIME] = time[j] + w * duration
                rows[n, _ODOMETER] = odometer + surface * gone
                seconds[n] = share * duration / pieces[j]
                owner[n] = j
                n += 1
        odometer += surface
    # How fast the slope changes, from the samples on either side.
    for n in range(total):
        a, b = max(0, n - 1), min(total - 1, n + 1)
        apart = rows[b, _TIME] - rows[a, _TIME]
        if apart > 1e-9 and owner[a] + 1 >= owner[b]:
            steep = math.sqrt(rows[a, _GX] ** 2 + rows[a, _GY] ** 2)
            rows[n, _SLOPE_RATE] = (
                abs(math.sqrt(rows[b, _GX] ** 2 + rows[b, _GY] ** 2) - steep) / apart / rows[n, _GN]
            )
    return rows, seconds, owner


def motion_rows(
    field: CostField,
    motion: Motion,
    class_rows: Array,
    wind: Array,
    pieces: NDArray[np.int64] | None = None,
    *,
    on_arcs: bool = False,
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Rows of the power model along a motion, the time each stands for, and its step.

    Args:
        field: map; heights and ground classes are read.
        motion: from ``assemble``.
        class_rows: (classes, ROW_LENGTH) conditions.
        wind: (2,) m/s in the map's frame.
        pieces: (n - 1,) that steps are cut into, three rows each, from ``pieces_of``; a step of 0
            pieces has no rows. By default half a cell each.
        on_arcs: whether the travel turns evenly on bends, as the robot drives them, instead of
            from sample to sample, as a reader of the poses would assume.
    """
    if pieces is None:
        pieces = pieces_of(field, motion, 0.5)
    arcs = (motion.arcs.begun, motion.arcs.change) if on_arcs else (np.empty(0), np.empty(0))
    arrays = (
        *(motion.x, motion.y, motion.heights, motion.yaw, motion.time, motion.speed),
        *(motion.curvatures, motion.yaw_accelerations),
        *arcs,
    )
    rows, weights, owner = _motion_rows(field, arrays, class_rows, wind, pieces)
    return rows, weights, owner


def pieces_of(field: CostField, motion: Motion, fineness: float) -> NDArray[np.int64]:
    """(n - 1,) pieces of every step of a motion, at least one; ``fineness`` cells long at most."""
    length = np.hypot(np.diff(motion.x), np.diff(motion.y))
    pieces = np.ceil(length / (fineness * min(field.dx, field.dy)) - 1e-9)
    return np.maximum(1, pieces).astype(np.int64)


@njit(cache=True, error_model="numpy", nogil=True)
def read_along(x: Any, y: Any, values: Any, places: Any, along: Any) -> Any:
    """Values (samples,) where samples are nearest to each of the places (n, 2), in their order.

    ``along`` (n,) is how far along the polyline each place is, m. Samples cut its corners, so that
    it is never further from one place to the next.
    """
    count = x.shape[0]
    found = np.empty(places.shape[0])
    k, share = 0, 0.0
    for n in range(places.shape[0]):
        room = along[n] - along[n - 1] if n > 0 else 0.0
        least, gone = np.inf, 0.0
        at, at_share = k, share
        for j in range(k, count - 1):
            ex, ey = x[j + 1] - x[j], y[j + 1] - y[j]
            length = math.sqrt(ex * ex + ey * ey)
            w = 0.0
            if length > 0.0:
                w = ((places[n, 0] - x[j]) * ex + (places[n, 1] - y[j]) * ey) / (length * length)
                w = min(max(w, share if j == k else 0.0), 1.0)
            away = math.hypot(x[j] + w * ex - places[n, 0], y[j] + w * ey - places[n, 1])
            if away < least:
                least, at, at_share = away, j, w
            gone += length
            if gone > 1.1 * room + length:
                break
        k, share = at, at_share
        found[n] = (1.0 - share) * values[k] + share * values[k + 1]
    found[-1] = values[-1]
    return found
