"""A region to arrive in: which points lie inside, and the nearest one to a point outside.

region = Region.of(request.goal)
region.inside(points), region.nearest(points), region.outline(0.1)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.errors import RequestError
from planner.search.situation_request import RegionRequest

Array = NDArray[np.float64]
_CORNERS = "corners of an area whose edges do not cross"


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
        # A hair's breadth inside, so that rounding leaves nothing outside.
        west, south, east, north = self.extent
        hair = 1e-7 * max(east - west, north - south)
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

    def outline(self, spacing: float) -> Array:
        """Points (n, 2) along the edge, a hair inside, no further apart than ``spacing``."""
        west, south, east, north = self.extent
        hair = 1e-7 * max(east - west, north - south)
        if not len(self.corners):
            count = max(8, math.ceil(2.0 * math.pi * self.radius / spacing))
            angles = 2.0 * math.pi * np.arange(count) / count
            ring = np.column_stack([np.cos(angles), np.sin(angles)])
            return np.asarray(self.centre + (self.radius - hair) * ring)
        pieces = []
        for a, b in zip(self.corners, np.roll(self.corners, -1, axis=0), strict=True):
            count = max(1, math.ceil(math.hypot(*(b - a)) / spacing))
            pieces.append(a + (np.arange(count) / count)[:, None] * (b - a))
        return self._inwards(np.vstack(pieces), hair)

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
