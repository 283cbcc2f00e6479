"""The straight path through a narrow passage, found from the corners of what stands beside it.

    passage = narrow_passage(ground, start, goal)
    passage.entrance, passage.exit, passage.yaw

A passage little wider than the body leaves it one yaw and one line, which nodes of a grid and yaw
bins may miss. Through the narrowest place on the widest path, the widest empty strip is sought: of
all directions the one in which the corners on both sides leave most between them. The body passes
on the strip's middle line with its yaw along it. Both ends lie where the body can turn again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from planner.arrays import Array
from planner.search.resolution import YAW_BINS
from planner.search.situation.bottleneck import DIAGONALS, Node, bottleneck
from planner.search.situation.traversability import DrivingGround
from planner.terrain.footprint import touches
from planner.terrain.obstacles import rectangle_free

Place = tuple[float, float]
STRIPS = (4.0, 2.0, 1.0, 0.5)
"""Lengths of the strip to either side, in lengths of the body: the longest that is wide enough."""
DIRECTION_STEPS = (math.radians(1.0), math.radians(0.05), math.radians(0.0025))
"""rad from one direction to the next: all round first, then about the best one. Over the longest
strip the last moves an end by 0.15 mm."""
TURN = math.radians(6.0)
"""rad to either side by which the body can turn where a passage ends: a yaw bin, and no less."""
BEYOND = 0.1
"""m past the first such place, so that there is some room to turn in."""
FURTHEST = 6.0
"""Lengths of the body in which a passage ends to either side."""


@dataclass(frozen=True)
class NarrowPassage:
    """A straight path between places where the body can turn.

    Attributes:
        entrance, exit: m, on the start's and on the goal's side.
        direction: rad, from one to the other.
        width: m, of the strip that is free.
    """

    entrance: Place
    exit: Place
    direction: float
    width: float


def narrow_passage(ground: DrivingGround, start: Place, goal: Place) -> NarrowPassage | None:
    """The straight path through the narrowest place of the widest one, if the body passes there.

    None as well where it is so wide that nodes and yaw bins cannot miss it.

    Args:
        ground: map and body.
        start, goal: m.
    """
    found = narrowest_place(ground, start, goal)
    if found is None:
        return None
    place, level = found
    # The way of a corner from the nearest node and bin, on both sides.
    missed = math.hypot(*ground.cell) + ground.half_length * math.pi / YAW_BINS
    if passage_width(ground, place) >= 2.0 * ground.half_width + missed:
        return None
    centre = np.array(place)
    corners = _corners(ground, centre)
    for lengths in STRIPS:
        direction, offset, width = _widest_strip(corners, 2.0 * lengths * ground.half_length)
        if width < 2.0 * ground.half_width:
            continue
        across = np.array([-math.sin(direction), math.cos(direction)])
        middle = centre + offset * across
        ends = [_end(ground, middle, direction, side) for side in (1.0, -1.0)]
        if ends[0] is None or ends[1] is None:
            continue
        first, last = _in_order(ground, (ends[1], ends[0]), (centre, level), (start, goal))
        travel = direction if first is ends[1] else direction + math.pi
        return NarrowPassage(first, last, travel, width)
    return None


def narrowest_place(ground: DrivingGround, start: Place, goal: Place) -> tuple[Place, float] | None:
    """Where the path that keeps furthest away from everything comes nearest to it, and how near, m.

    None where nothing stands on the map, or all paths are blocked.
    """
    if not ground.blocked.any():
        return None
    found = bottleneck(
        np.where(ground.blocked, np.inf, -_distance(ground)),
        _node(ground, start),
        _node(ground, goal),
    )
    if found is None:
        return None
    (level, (j, i)), (x0, y0), (dx, dy) = found, ground.origin, ground.cell
    return (x0 + dx * i, y0 + dy * j), -level


def passage_width(ground: DrivingGround, place: Place) -> float:
    """m, of the widest empty strip through a place, half a body's length to either side."""
    corners = _corners(ground, np.array(place))
    return _widest_strip(corners, ground.half_length)[2]


def _distance(ground: DrivingGround) -> Array:
    """m from every node to the nearest blocked one."""
    cell = ground.cell[1], ground.cell[0]
    return np.asarray(ndimage.distance_transform_edt(~ground.blocked, sampling=cell))


def _node(ground: DrivingGround, place: Place) -> Node:
    (x0, y0), (dx, dy) = ground.origin, ground.cell
    ny, nx = ground.blocked.shape
    i, j = round((place[0] - x0) / dx), round((place[1] - y0) / dy)
    return min(max(j, 0), ny - 1), min(max(i, 0), nx - 1)


def _corners(ground: DrivingGround, centre: Array) -> Array:
    """Corners (n, 2) of blocked cells beside free ones, and of cells round the map, m off a centre.

    Those that the longest strip may meet.
    """
    solid = np.pad(ground.blocked, 1, constant_values=True)
    rim = solid & ~ndimage.binary_erosion(solid, DIAGONALS, border_value=1)
    j, i = np.nonzero(rim)
    (x0, y0), (dx, dy) = ground.origin, ground.cell
    x, y = x0 + dx * (i - 1) - centre[0], y0 + dy * (j - 1) - centre[1]
    four = [np.column_stack([x + a * dx, y + b * dy]) for a in (-0.5, 0.5) for b in (-0.5, 0.5)]
    corners = np.unique(np.vstack(four), axis=0)
    most = 4.0 * max(STRIPS) * ground.half_length
    return np.asarray(corners[np.hypot(*corners.T) <= most])


def _widest_strip(corners: Array, reach: float) -> tuple[float, float, float]:
    """Direction, offset of the middle and width of the widest empty strip past the origin.

    Args:
        corners: (n, 2) m off the origin.
        reach: m, length of the strip to either side.
    """

    def strip(direction: float) -> tuple[float, float]:
        cosine, sine = math.cos(direction), math.sin(direction)
        along = corners[:, 0] * cosine + corners[:, 1] * sine
        across = corners[:, 1] * cosine - corners[:, 0] * sine
        across = across[np.abs(along) <= reach]
        left = across[across > 0.0].min(initial=2.0 * reach)
        right = across[across <= 0.0].max(initial=-2.0 * reach)
        return 0.5 * float(left + right), float(left - right)

    best, spread = 0.0, 0.5 * math.pi
    for step in DIRECTION_STEPS:
        count = math.ceil(spread / step)
        tried = best + step * np.arange(-count, count + 1)
        best = float(max(tried, key=lambda direction: strip(direction)[1]))
        spread = step
    return best, *strip(best)


def _end(ground: DrivingGround, middle: Array, direction: float, side: float) -> Place | None:
    """Where the body can turn again, on the line through the middle; None if it comes nowhere."""
    step = 0.5 * min(ground.cell)
    (x0, y0), (dx, dy), half = ground.origin, ground.cell, (ground.half_length, ground.half_width)
    frame = np.array([x0, y0, dx, dy, *half])
    ux, uy = side * math.cos(direction), side * math.sin(direction)
    free_from = math.inf
    for k in range(math.ceil(2.0 * FURTHEST * ground.half_length / step)):
        away = k * step
        x, y = middle[0] + away * ux, middle[1] + away * uy
        turns = all(
            rectangle_free(ground.blocked, x0, y0, dx, dy, x, y, direction + turn, half[0], half[1])
            for turn in (-TURN, 0.0, TURN)
        )
        free_from = min(free_from, away) if turns else math.inf
        if away - free_from >= BEYOND:
            if touches(ground.blocked, frame, middle[0], middle[1], x, y, direction, 0.0):
                return None
            return float(x), float(y)
    return None


def _in_order(
    ground: DrivingGround,
    ends: tuple[Place, Place],
    narrowest: tuple[Array, float],
    route: tuple[Place, Place],
) -> tuple[Place, Place]:
    """The end on the start's side first: with the narrowest place shut, it is joined to it."""
    centre, level = narrowest
    away = _distance(ground)
    ny, nx = away.shape
    (x0, y0), (dx, dy) = ground.origin, ground.cell
    x, y = x0 + dx * np.arange(nx), y0 + dy * np.arange(ny)
    shut = np.hypot(x[None, :] - centre[0], y[:, None] - centre[1]) <= 2.0 * max(dx, dy) + (level)
    groups, _ = ndimage.label((away >= level - 1e-9) & ~shut, DIAGONALS)
    at_ends = [groups[_node(ground, end)] for end in ends]
    at_start, at_goal = (groups[_node(ground, place)] for place in route)
    backwards = (at_ends[1] == at_start != 0) or (at_ends[0] == at_goal != 0)
    forwards = (at_ends[0] == at_start != 0) or (at_ends[1] == at_goal != 0)
    return (ends[1], ends[0]) if backwards and not forwards else ends
