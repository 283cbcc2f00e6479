"""A polyline made drivable: corners rounded, stations close enough to integrate along.

    track = lay_track(field, points, spacing=..., speed=..., acceleration=...)

A robot cannot change the direction of its velocity at once. Every corner gets the widest arc that
room and neighbouring corners allow: it stays within ``deviation`` of the corner and where the body
is free. Wider is cheaper, since wheels fight a sideways force. Where no arc of a useful radius
fits, the robot stops at the corner.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.search.ground import CostField, polyline_cost

Array = NDArray[np.float64]
ARC_STEP = math.radians(8.0)
"""Largest change of direction between two chords of an arc."""
TIGHTEST = 0.06
"""Smallest radius as a share of the one for full speed; below it the robot stops to turn."""
SHORTEST = 0.04
"""m, length of an arc's chords where the bend allows it."""
STRAIGHT = math.radians(0.5)
"""Changes of direction below this one need no arc: the tyres' creep takes them."""


@dataclass(frozen=True)
class Track:
    """Stations along the route, in the horizontal plane.

    Attributes:
        points: (n, 2) m.
        directions: (n - 1,) rad, azimuth of each step.
        lengths: (n - 1,) m, horizontal.
        curvatures: (n - 1,) 1/m, positive to the left; of the arc that the step belongs to.
        stops: (n,) True where the robot must stand still: start, goal, corners without room.
        marks: station of every fixed point (start, via points, goal).
    """

    points: Array
    directions: Array
    lengths: Array
    curvatures: Array
    stops: NDArray[np.bool_]
    marks: tuple[int, ...]


def lay_track(
    field: CostField,
    legs: list[Array],
    *,
    spacing: float,
    speed: float,
    acceleration: float,
) -> Track:
    """Round the corners of a route and space out its stations.

    Args:
        field: map and costs, to see whether an arc is free.
        legs: polylines (k, 2), each from one fixed point to the next.
        spacing: m, largest distance of stations.
        speed: m/s, the vehicle's limit.
        acceleration: m/s², the vehicle's limit.
    """
    points: list[Array] = [legs[0][:1]]
    curvatures: list[float] = []
    stops = [True]
    marks = [0]
    deviation = min(0.5, max(0.15, 0.5 * min(field.dx, field.dy)))
    radius = speed * speed / acceleration
    ramp = radius / 2.0  # distance to reach full speed, v²/2a
    for leg in legs:
        pieces = _rounded(field, leg, spacing, radius, deviation)
        for number, (end, curvature, stop) in enumerate(pieces):
            begin = points[-1][-1]
            first, last = number == 0, number == len(pieces) - 1
            added = _stations(begin, end, spacing, ramp, near_start=first, near_end=last or stop)
            points.append(added)
            curvatures += [curvature] * len(added)
            stops += [False] * (len(added) - 1) + [stop]
        marks.append(len(stops) - 1)
    stops[-1] = True
    stacked = np.vstack(points)
    steps = np.diff(stacked, axis=0)
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    for mark in marks[1:-1]:
        # Via points have no arc: the robot stops where its travel turns.
        if 0 < mark < len(directions):
            turn = math.remainder(float(directions[mark] - directions[mark - 1]), 2.0 * math.pi)
            stops[mark] |= abs(turn) > STRAIGHT
    return Track(
        stacked,
        directions,
        np.hypot(steps[:, 0], steps[:, 1]),
        np.array(curvatures),
        np.array(stops),
        tuple(marks),
    )


def _rounded(
    field: CostField, leg: Array, spacing: float, radius: float, deviation: float
) -> list[tuple[Array, float, bool]]:
    """Straight pieces and chords: end point, curvature, whether the robot stops there."""
    apart = np.hypot(*np.diff(leg, axis=0).T) > 1e-9
    leg = leg[np.concatenate([[True], apart])]
    if len(leg) == 1:
        return []
    lengths = np.hypot(*np.diff(leg, axis=0).T)
    directions = np.arctan2(*np.diff(leg, axis=0).T[::-1])
    pieces: list[tuple[Array, float, bool]] = []
    for k in range(1, len(leg) - 1):
        turn = math.remainder(float(directions[k] - directions[k - 1]), 2.0 * math.pi)
        room = 0.48 * min(lengths[k - 1], lengths[k])
        arc = _arc(field, spacing, leg[k], float(directions[k - 1]), turn, radius, room, deviation)
        if arc is None:
            pieces.append((leg[k], 0.0, abs(turn) > STRAIGHT))
            continue
        chords, bend = arc
        pieces.append((chords[0], 0.0, False))
        pieces += [(point, bend, False) for point in chords[1:]]
    pieces.append((leg[-1], 0.0, False))
    return pieces


def _arc(
    field: CostField,
    spacing: float,
    corner: Array,
    direction: float,
    turn: float,
    radius: float,
    room: float,
    deviation: float,
) -> tuple[Array, float] | None:
    """Points of the arc that replaces a corner and its curvature; None if the corner stays."""
    half = abs(turn) / 2.0
    if abs(turn) <= STRAIGHT or half > math.radians(85.0):
        return None
    # Tangent length R·tan(half) must fit the pieces; the arc passes R·(1/cos(half) - 1) inside.
    full = radius
    radius = min(room / math.tan(half), deviation / (1.0 / math.cos(half) - 1.0))
    side = math.copysign(1.0, turn)
    for _ in range(4):
        if radius < TIGHTEST * full:
            return None
        # Chords short enough for the bend, long enough for yaw and speed to change on them.
        # A body that turns evenly along a long chord would crab on both its halves, and its
        # sideways force would come in blows.
        way = radius * abs(turn)
        count = max(math.ceil(abs(turn) / ARC_STEP), math.ceil(2.0 * way / spacing))
        count = max(2, min(count, int(way / SHORTEST)))
        tangent = radius * math.tan(half)
        begin = corner - tangent * np.array([math.cos(direction), math.sin(direction)])
        centre = begin + side * radius * np.array([-math.sin(direction), math.cos(direction)])
        angles = direction - side * math.pi / 2.0 + turn * np.arange(count + 1) / count
        points = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
        step = field.step
        if math.isfinite(polyline_cost(field, points, step)):
            return points, side / radius
        radius /= 2.0
    return None


def _stations(
    begin: Array, end: Array, spacing: float, ramp: float, *, near_start: bool, near_end: bool
) -> Array:
    """Points after ``begin`` up to ``end``, closer where the robot gathers or loses speed."""
    length = float(np.hypot(*(end - begin)))
    if length < 1e-9:
        return end[None, :]
    count = max(1, math.ceil(length / spacing - 1e-9))
    at = length * np.arange(1, count + 1) / count
    fine = ramp * np.array([0.05, 0.15, 0.3, 0.5, 0.75, 1.0, 1.3])
    if near_start:
        at = np.concatenate([at, fine])
    if near_end:
        at = np.concatenate([at, length - fine])
    at = np.unique(np.round(at[(at > 1e-6) & (at <= length)], 9))
    keep = np.diff(at, prepend=0.0) >= 0.045 * ramp
    keep[-1] = True
    at = at[keep]
    at[-1] = length
    return begin + (end - begin) * (at / length)[:, None]
