"""A polyline made drivable: corners rounded, samples close enough to integrate along.

    track = lay_track(field, points, spacing=..., speed=..., acceleration=...)

A robot cannot change the direction of its velocity at once. Every corner gets the widest arc that
free space and neighbouring corners allow, near the corner. Wider is cheaper: it can be taken
faster, and wheels fight less of a sideways force. Two corners share the piece between them so that
the tighter arc is as wide as possible. Where no arc of a useful radius fits, the robot stops at the
corner.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.compiled_code import njit
from planner.search.field import CostField, ground_classes, polyline_cost
from planner.search.kernel_arguments import Steps
from planner.search.resolution import OFF_MIDDLE
from planner.terrain.interpolation import interpolate

ARC_STEP = math.radians(8.0)
"""rad, largest change of direction between two chords of an arc."""
TIGHTEST_ARC = 0.06
"""Smallest radius as a share of the one for full speed; below it the robot stops to turn. An arc
needs some least radius. Half and double change next to nothing (docs/benchmarks/ablations.md)."""
OFF_CORNER, MOST_OFF_CORNER = 0.15, 0.5
"""m from a corner to its arc at most; half a cell where that is more, up to the second: the costs
beside a path are not those that it was chosen by."""
ONE_ARC = 0.96
"""Share of a piece that an arc may take if there is none at its other end."""
TIGHTER = 0.8
"""Factor on the radius of an arc where it is not free, until it is."""
SHARPEST = math.radians(170.0)
"""rad: at larger changes of direction the robot turns back, without an arc."""
SHORTEST_CHORD = 0.04
"""m, shortest chord of an arc, where the bend allows it."""
MOST_CHORDS = 500
"""Chords of one arc at most, the size of its scratch."""
MOST_LED = math.radians(70.0)
"""rad: at larger changes of direction the robot stops at a via place. From a quarter turn on, the
bend past it takes more than the stop; below this, it takes less for every robot that was tried."""
STRAIGHT = math.radians(0.5)
"""rad: smaller changes of direction need no arc; the tyres' creep takes them."""
CLOSER = np.array([0.05, 0.15, 0.3, 0.5, 0.75, 1.0, 1.3])
"""Samples beside a stop, in distances to full speed."""
LEAST_APART = 0.045
"""Distances to full speed from one sample to the next beside a stop: the speed's grid needs some
metres to change by one level."""
SLOPES_PER_CELL = 15
"""Points on a cell's length at which the slope is looked at."""
GENTLE_SLOPE_SHARE = 0.6
"""Share of the least slope limit below which no yaw comes near a limit."""


@dataclass(frozen=True)
class Track:
    """Samples of a path, in the horizontal plane.

    Attributes:
        points: (n, 2) m.
        directions: (n - 1,) rad, azimuth of each step.
        lengths: (n - 1,) m, horizontal.
        curvatures: (n - 1,) 1/m, positive to the left; of the arc that the step belongs to.
        stops: (n,) True where the robot must stand still: start, goal, corners without room.
        marks: sample at every fixed point (start, via points, goal).
    """

    points: Array
    directions: Array
    lengths: Array
    curvatures: Array
    stops: NDArray[np.bool_]
    marks: tuple[int, ...]

    def part(self, first: int, last: int) -> Track:
        """The samples from one to another, both included."""
        return Track(
            self.points[first : last + 1],
            self.directions[first:last],
            self.lengths[first:last],
            self.curvatures[first:last],
            self.stops[first : last + 1],
            (0, last - first),
        )


def lay_track(
    field: CostField,
    legs: list[Array],
    *,
    spacing: float,
    speed: float,
    acceleration: float,
) -> Track:
    """Round the corners of a route and space out its samples.

    Args:
        field: map and costs, to see whether an arc is free.
        legs: polylines (k, 2), each from one fixed point to the next.
        spacing: m, largest distance of samples.
        speed: m/s, the vehicle's limit.
        acceleration: m/s², the vehicle's limit.
    """
    points: list[Array] = [legs[0][:1]]
    curvatures: list[Array] = []
    stops: list[NDArray[np.bool_]] = [np.ones(1, bool)]
    marks = [0]
    off_corner = min(MOST_OFF_CORNER, max(OFF_CORNER, 0.5 * min(field.dx, field.dy)))
    radius = speed * speed / acceleration
    ramp = radius / 2.0  # distance to reach full speed, v²/2a
    for leg in legs:
        apart = np.hypot(*np.diff(leg, axis=0).T) > 1e-9
        leg = np.ascontiguousarray(leg[np.concatenate([[True], apart])])
        if len(leg) < 2:
            marks.append(marks[-1])
            continue
        ends, bends, halts = _rounded(field, leg, spacing, radius, off_corner)
        added, piece = _samples(points[-1][-1], ends, halts, spacing, ramp)
        points.append(added)
        curvatures.append(bends[piece])
        stops.append(halts[piece] & np.append(np.diff(piece) > 0, True))
        marks.append(marks[-1] + len(added))
    stacked, halting = np.vstack(points), np.concatenate(stops)
    halting[-1] = True
    steps = np.diff(stacked, axis=0)
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    for mark in marks[1:-1]:
        # The place itself has no arc: the robot stops where its travel turns.
        if 0 < mark < len(directions):
            turn = math.remainder(float(directions[mark] - directions[mark - 1]), 2.0 * math.pi)
            halting[mark] |= abs(turn) > STRAIGHT
    return Track(
        stacked,
        directions,
        np.hypot(steps[:, 0], steps[:, 1]),
        np.concatenate([np.zeros(0), *curvatures]),
        halting,
        tuple(marks),
    )


def led_past(field: CostField, legs: list[Array], radius: float) -> list[Array]:
    """Legs that go straight on through the places where they meet, as far as there is room.

    Each leg ends and begins on a piece along the mean of both directions. What is left are two
    corners beside the place, of half the turn each, and their arcs need no stop.

    Args:
        field: map and costs, to see whether the new pieces are free.
        legs: polylines (k, 2), each from one fixed point to the next.
        radius: m, of a bend that is driven at full speed.
    """
    led = list(legs)
    for k in range(len(led) - 1):
        before, after = led[k], led[k + 1]
        if min(len(before), len(after)) < 2:
            continue
        come, go = before[-1] - before[-2], after[1] - after[0]
        lengths = math.hypot(*come), math.hypot(*go)
        if min(lengths) < 1e-9:
            continue
        turn = abs(math.atan2(come[0] * go[1] - come[1] * go[0], float(come @ go)))
        if not STRAIGHT < turn <= MOST_LED:
            continue
        mean = come / lengths[0] + go / lengths[1]
        reach = min(radius * math.tan(0.25 * turn) / ONE_ARC, 0.5 * min(lengths))
        mean *= reach / math.hypot(*mean)
        ends = before[-1] - mean, before[-1] + mean
        bent = np.vstack([before[-2], ends[0], before[-1], ends[1], after[1]])
        if polyline_cost(field, bent, field.step) < math.inf:
            led[k] = np.vstack([before[:-1], bent[1:3]])
            led[k + 1] = np.vstack([bent[2:4], after[1:]])
    return led


@njit(cache=True, error_model="numpy", nogil=True)
def turns_of(leg: Any) -> Any:
    """Change of direction (n,) at each point of a polyline (n, 2), rad; none at its ends."""
    turns = np.zeros(leg.shape[0])
    for k in range(1, leg.shape[0] - 1):
        ax, ay = leg[k, 0] - leg[k - 1, 0], leg[k, 1] - leg[k - 1, 1]
        bx, by = leg[k + 1, 0] - leg[k, 0], leg[k + 1, 1] - leg[k, 1]
        turns[k] = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    return turns


@njit(cache=True, error_model="numpy", nogil=True)
def widest_arcs(leg: Any, turns: Any, off_corner: float) -> Any:
    """Radius (n,) in m of the widest arc at each corner of a polyline (n, 2); 0 for none.

    An arc takes radius times tan(turn / 2) of either piece. Where both arcs of a piece cannot be as
    wide as they might, they get the same radius, or one gets what the other leaves.

    Args:
        leg: m.
        turns: (n,) rad, from ``turns_of``.
        off_corner: m from a corner to the middle of its arc at most.
    """
    count = leg.shape[0]
    widest, tangent = np.zeros(count), np.zeros(count)  # m; and of an arc of 1 m
    for k in range(count):
        half = 0.5 * abs(turns[k])
        if STRAIGHT < abs(turns[k]) <= SHARPEST:
            tangent[k] = math.tan(half)
            widest[k] = off_corner / (1.0 / math.cos(half) - 1.0)
    found = widest.copy()
    for k in range(count - 1):
        ex, ey = leg[k + 1, 0] - leg[k, 0], leg[k + 1, 1] - leg[k, 1]
        both = tangent[k] > 0.0 and tangent[k + 1] > 0.0
        room = (1.0 if both else ONE_ARC) * math.sqrt(ex * ex + ey * ey)
        for one, other in ((k, k + 1), (k + 1, k)):
            if tangent[one] > 0.0:
                alike = room / (tangent[one] + tangent[other])
                left = (room - widest[other] * tangent[other]) / tangent[one]
                found[one] = min(found[one], max(alike, left))
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def _rounded(
    field: Any, leg: Any, spacing: float, radius: float, off_corner: float
) -> tuple[Any, Any, Any]:
    """Straight pieces and chords: end points (n, 2), curvatures (n,), whether the robot stops."""
    count = leg.shape[0]
    ends = np.empty((64, 2))
    curvatures = np.zeros(64)
    stops = np.zeros(64, np.bool_)
    arc = np.empty((MOST_CHORDS + 1, 2))
    turns = turns_of(leg)
    widest = widest_arcs(leg, turns, off_corner)
    n = 0
    for k in range(1, count):
        ax, ay = leg[k, 0] - leg[k - 1, 0], leg[k, 1] - leg[k - 1, 1]
        chords, bend = _arc(
            field, spacing, leg[k], math.atan2(ay, ax), turns[k], radius, widest[k], arc
        )
        if n + chords + 1 > ends.shape[0]:
            size = 2 * (n + chords + 1)
            old_ends, old_curvatures, old_stops = ends, curvatures, stops
            ends = np.empty((size, 2))
            curvatures = np.zeros(size)
            stops = np.zeros(size, np.bool_)
            for old in range(n):
                ends[old, 0], ends[old, 1] = old_ends[old, 0], old_ends[old, 1]
                curvatures[old], stops[old] = old_curvatures[old], old_stops[old]
        if chords == 0:
            ends[n, 0], ends[n, 1] = leg[k, 0], leg[k, 1]
            stops[n] = abs(turns[k]) > STRAIGHT
            n += 1
        else:
            # Arcs side by side meet: on a tiny step between them the body could hardly turn.
            first = 0
            if n > 0:
                gap = math.hypot(arc[0, 0] - ends[n - 1, 0], arc[0, 1] - ends[n - 1, 1])
                first = 1 if gap < SHORTEST_CHORD else 0
            for c in range(first, chords + 1):
                ends[n, 0], ends[n, 1] = arc[c, 0], arc[c, 1]
                curvatures[n] = bend if c > 0 else 0.0
                n += 1
    return ends[:n].copy(), curvatures[:n].copy(), stops[:n].copy()


@njit(cache=True, error_model="numpy", nogil=True)
def _arc(
    field: Any,
    spacing: float,
    corner: Any,
    direction: float,
    turn: float,
    full: float,
    widest: float,
    points: Any,
) -> tuple[int, float]:
    """Chords of the arc that replaces a corner, and its curvature; 0 chords if the corner stays.

    The arc's ``chords + 1`` points are written to ``points``.

    Args:
        field: map and costs.
        spacing: m, largest distance of samples.
        corner: (2,) m.
        direction: rad, azimuth of the travel before it.
        turn: rad.
        full, widest: m, radius for full speed, and the largest that there is room for.
        points: (MOST_CHORDS + 1, 2), written.
    """
    radius, side = widest, math.copysign(1.0, turn)
    while radius > 0.0 and radius >= TIGHTEST_ARC * full:
        # Chords short enough for the bend, long enough for yaw and speed to change on them.
        # A body that turns evenly along a long chord would crab on both its halves, with its
        # sideways force in blows.
        length = radius * abs(turn)
        chords = max(math.ceil(abs(turn) / ARC_STEP), math.ceil(2.0 * length / spacing))
        chords = int(max(2, min(chords, int(length / SHORTEST_CHORD), MOST_CHORDS)))
        tangent = radius * math.tan(0.5 * abs(turn))
        from_x = corner[0] - tangent * math.cos(direction)
        from_y = corner[1] - tangent * math.sin(direction)
        centre_x = from_x - side * radius * math.sin(direction)
        centre_y = from_y + side * radius * math.cos(direction)
        for c in range(chords + 1):
            angle = direction - side * math.pi / 2.0 + turn * c / chords
            points[c, 0] = centre_x + radius * math.cos(angle)
            points[c, 1] = centre_y + radius * math.sin(angle)
        if polyline_cost(field, points[: chords + 1], field.step) < np.inf:
            return chords, side / radius
        radius *= TIGHTER
    return 0, 0.0


@njit(cache=True, error_model="numpy", nogil=True)
def _samples(
    begin: Any, ends: Any, stops: Any, spacing: float, ramp: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points (n, 2) on the pieces from ``begin`` by ``ends``, and the number of each one's piece.

    They are closer where the robot speeds up or slows down.
    """
    fine = ramp * CLOSER
    found = [(0.0, 0.0, 0) for _ in range(0)]
    x, y = begin[0], begin[1]
    for piece in range(ends.shape[0]):
        ex, ey = ends[piece, 0] - x, ends[piece, 1] - y
        length = math.hypot(ex, ey)
        near_start = piece == 0
        near_end = piece == ends.shape[0] - 1 or stops[piece]
        count = max(1, int(math.ceil(length / spacing - 1e-9)))
        if length >= 1e-9 and (count > 1 or near_start or near_end):
            at = [length * k / count for k in range(1, count)]
            if near_start:
                at += [d for d in fine if d < length]
            if near_end:
                at += [length - d for d in fine if d < length]
            at.sort()
            least = LEAST_APART * ramp if near_start or near_end else 0.0
            before = 0.0
            for d in at:
                if d > 1e-6 and d - before >= least and length - d > 1e-9:
                    found.append((x + d / length * ex, y + d / length * ey, piece))
                before = d
        x, y = ends[piece, 0], ends[piece, 1]
        found.append((x, y, piece))
    points = np.empty((len(found), 2))
    pieces = np.empty(len(found), np.int64)
    for k in range(len(found)):
        points[k, 0], points[k, 1], pieces[k] = found[k]
    return points, pieces


def steps_of(field: CostField, track: Track) -> Steps:
    """Slopes and ground classes of every step of a track."""
    slopes = slopes_of_steps(field, track.points)
    steep = np.hypot(slopes[:, 2], slopes[:, 3]) > gentle_slope(field)
    ground = ground_classes(field, 0.5 * (track.points[1:] + track.points[:-1]))
    return Steps(track.directions, track.lengths, track.curvatures, slopes, steep, ground)


def slopes_of_steps(field: CostField, points: Array) -> Array:
    """Gradients (steps, 8) on the steps between points (n, 2).

    In columns 0 and 1 that at the middle, in 2 and 3 the steepest one of SLOPES_PER_CELL, in 4 and
    5 that late in the step, in 6 and 7 early. Where all are far from every limit, the one at the
    middle stands for them.
    """
    return np.asarray(_slopes_of_steps(field, points, gentle_slope(field)))


def gentle_slope(field: CostField) -> float:
    """tan(slope) up to which no yaw comes near a limit."""
    return GENTLE_SLOPE_SHARE * float(field.limit.min())


@njit(cache=True, error_model="numpy", nogil=True)
def _slopes_of_steps(field: Any, points: Any, gentle: float) -> Any:
    x0, y0, dx, dy = field.x0, field.y0, field.dx, field.dy
    slopes = np.empty((points.shape[0] - 1, 8))
    for j in range(slopes.shape[0]):
        x, y = points[j]
        ex, ey = points[j + 1, 0] - x, points[j + 1, 1] - y
        looks = max(3, int(math.ceil(SLOPES_PER_CELL * math.sqrt(ex * ex + ey * ey) / min(dx, dy))))
        most = 0.0
        for look in range(-1, looks):
            w = 0.5 if look < 0 else (look + 0.5) / looks
            _, px, py = interpolate(field.heights, x0, y0, dx, dy, x + w * ex, y + w * ey)
            if look < 0:
                slopes[j, 0::2], slopes[j, 1::2] = px, py
                continue
            steep = math.sqrt(px * px + py * py)
            if steep > max(most, gentle):
                most = steep
                slopes[j, 2], slopes[j, 3] = px, py
        if most > 0.0:
            for column, off in ((4, OFF_MIDDLE), (6, -OFF_MIDDLE)):
                w = 0.5 + off
                _, px, py = interpolate(field.heights, x0, y0, dx, dy, x + w * ex, y + w * ey)
                slopes[j, column], slopes[j, column + 1] = px, py
    return slopes
