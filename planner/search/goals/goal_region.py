"""A region to arrive in: which points lie inside, and the nearest one to a point outside.

region = Region.of(request.goal)
region.inside(points), region.nearest(points), region.outline(0.1, terrain.extent)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.errors import RequestError
from planner.search.requests import RegionRequest

_CORNERS = "corners of an area whose edges do not cross"
INSET_SHARE, LARGEST_INSET = 1e-7, 1e-4
"""How far inside its edge a region's points lie: a share of its size, and the most in m.

Rounding of coordinates of up to 1e9 m moves points by 2e-7 m, which must leave none outside.
"""


@dataclass(frozen=True)
class Region:
    """A circle, or a polygon whose edges do not cross.

    Attributes:
        centre, radius: m, of the circle; the radius is 0 for a polygon.
        corners: (n, 2) m, of the polygon; empty for a circle.
    """

    centre: Array
    radius: float
    corners: Array

    @classmethod
    def of(cls, request: RegionRequest) -> Region:
        """The region of a request that is a circle or a polygon.

        Raises:
            RequestError: the polygon has no extent, or edges of it cross.
        """
        if request.polygon is None:
            centre = np.array([request.x, request.y], float)
            return cls(centre, float(request.radius or 0.0), np.empty((0, 2)))
        corners = np.array(request.polygon, float)
        corners = corners[np.any(corners != np.roll(corners, 1, axis=0), axis=1)]
        crossing = _crossing(corners)
        if crossing is not None:
            at = f"near x {crossing[0]:g}, y {crossing[1]:g}"
            raise RequestError("goal.polygon", f"crosses itself {at}", accepted=_CORNERS)
        x, y = corners.T
        area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
        size = float(np.ptp(corners, axis=0).max()) if len(corners) else 0.0
        if abs(area) <= 1e-9 * size * size or len(corners) < 3:
            raise RequestError("goal.polygon", "has no extent", accepted=_CORNERS)
        return cls(corners.mean(axis=0), 0.0, corners)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """xmin, ymin, xmax, ymax, m."""
        low, high = self.centre - self.radius, self.centre + self.radius
        if len(self.corners):
            low, high = self.corners.min(axis=0), self.corners.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """Whether each of points (n, 2) lies inside, (n,)."""
        if not len(self.corners):
            return np.asarray(np.hypot(*(points - self.centre).T) <= self.radius)
        inside = np.zeros(len(points), np.bool_)
        x, y = points.T
        for (ax, ay), (bx, by) in zip(self.corners, np.roll(self.corners, -1, axis=0), strict=True):
            if ay != by:
                passes = (ay > y) != (by > y)
                inside ^= passes & (x < ax + (y - ay) * (bx - ax) / (by - ay))
        return inside

    def nearest(self, points: Array) -> Array:
        """For each of points (n, 2) the same where it lies inside, else the nearest one inside."""
        outside = ~self.inside(points)
        result = points.copy()
        if not outside.any():
            return result
        hair = self._hair
        if not len(self.corners):
            away = points[outside] - self.centre
            share = (self.radius - hair) / np.hypot(*away.T)
            result[outside] = self.centre + away * share[:, None]
            return result
        best = np.full(int(outside.sum()), np.inf)
        found = np.empty((len(best), 2))
        for a, b in zip(self.corners, np.roll(self.corners, -1, axis=0), strict=True):
            along = b - a
            share = np.clip((points[outside] - a) @ along / (along @ along), 0.0, 1.0)
            foot = a + share[:, None] * along
            apart = np.hypot(*(points[outside] - foot).T)
            found[apart < best] = foot[apart < best]
            best = np.minimum(best, apart)
        result[outside] = self._inwards(found, hair)
        return result

    def outline(self, spacing: float, box: tuple[float, float, float, float]) -> Array:
        """Points along the edge, as far as it runs through a box, a hair inside the region.

        Args:
            spacing: m between two points at most.
            box: xmin, ymin, xmax, ymax, m; an edge may be many times as long as what runs through.

        Returns:
            (n, 2) m.
        """
        pieces = [np.empty((0, 2))]
        if not len(self.corners):
            for begin, end in self._arcs(box):
                length = self.radius * (end - begin)
                count = max(
                    math.ceil((end - begin) / (0.25 * math.pi)), math.ceil(length / spacing)
                )
                angles = begin + (end - begin) * np.arange(count) / count
                ring = np.column_stack([np.cos(angles), np.sin(angles)])
                pieces.append(self.centre + (self.radius - self._hair) * ring)
            return np.vstack(pieces)
        for a, b in zip(self.corners, np.roll(self.corners, -1, axis=0), strict=True):
            begin, end = _within(a, b, box)
            if begin <= end:
                count = max(1, math.ceil((end - begin) * math.hypot(*(b - a)) / spacing))
                shares = begin + (end - begin) * np.arange(count) / count
                pieces.append(a + shares[:, None] * (b - a))
        return self._inwards(np.vstack(pieces), self._hair)

    @property
    def _hair(self) -> float:
        """How far inside the edge a point lies for certain, m."""
        west, south, east, north = self.extent
        return min(INSET_SHARE * max(east - west, north - south), LARGEST_INSET)

    def _arcs(self, box: tuple[float, float, float, float]) -> list[tuple[float, float]]:
        """First and last angle, rad, of the arcs of the circle that run through a box."""
        west, south, east, north = box
        x, y = (float(value) for value in self.centre)
        cuts = [0.0, 2.0 * math.pi]
        for share in ((west - x) / self.radius, (east - x) / self.radius):
            if abs(share) <= 1.0:
                cuts += [math.acos(share), 2.0 * math.pi - math.acos(share)]
        for share in ((south - y) / self.radius, (north - y) / self.radius):
            if abs(share) <= 1.0:
                cuts += [math.asin(share) % (2.0 * math.pi), math.pi - math.asin(share)]
        arcs = []
        for begin, end in pairwise(sorted(cuts)):
            middle = 0.5 * (begin + end)
            at_x, at_y = x + self.radius * math.cos(middle), y + self.radius * math.sin(middle)
            if west <= at_x <= east and south <= at_y <= north:
                arcs.append((begin, end))
        return arcs

    def _inwards(self, edge: Array, hair: float) -> Array:
        """Points on a polygon's edge moved inside by a hair."""
        result = edge.copy()
        left = ~self.inside(edge)
        for angle in 2.0 * math.pi * np.arange(16) / 16:
            for reach in (1.0, 10.0):
                moved = edge + reach * hair * np.array([math.cos(angle), math.sin(angle)])
                good = left & self.inside(moved)
                result[good] = moved[good]
                left &= ~good
        return result


def _within(a: Array, b: Array, box: tuple[float, float, float, float]) -> tuple[float, float]:
    """First and last share of the line from a to b that lies in a box; the first is larger if none.

    Liang and Barsky, "A new concept and method for line clipping", 1984.
    """
    begin, end = 0.0, 1.0
    for axis in (0, 1):
        start, along = float(a[axis]), float(b[axis] - a[axis])
        low, high = box[axis], box[axis + 2]
        if along == 0.0:
            if not low <= start <= high:
                return 1.0, 0.0
            continue
        near, far = sorted(((low - start) / along, (high - start) / along))
        begin, end = max(begin, near), min(end, far)
    return begin, end


def _crossing(corners: Array) -> Array | None:
    """A corner whose following edge crosses or touches another that is no neighbour of it."""
    a, b = corners, np.roll(corners, -1, axis=0)
    count = len(corners)

    def side(p: Array, q: Array, r: Array) -> Array:
        return np.sign(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1])
            - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )

    for k in range(count):
        others = np.array([m for m in range(k + 2, count) if (m + 1) % count != k], int)
        if not len(others):
            continue
        c, d = a[others], b[others]
        one = side(a[k], b[k], c) * side(a[k], b[k], d)
        two = side(c, d, a[k]) * side(c, d, b[k])
        if ((one < 0) & (two < 0)).any():
            return np.asarray(a[k])
    return None
