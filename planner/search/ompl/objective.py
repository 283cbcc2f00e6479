"""What OMPL minimises and what it may drive: our cost on a plane of two coordinates.

Two planes are planned in. ``WholeMap`` is the map itself, (x, y). ``Tube`` is the strip round a
given path, (distance along it, offset across it): there the path is a straight line, which OMPL
tries first, so the tube is the warm start that the bindings do not otherwise allow.

Costs are dissipated energy, so never negative and lower than energy only by the constant M·g·Δz.
They differ by direction: ``isSymmetric`` is False. Yaw is eliminated in the cost itself.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numba import njit
from ompl import base as ob

from planner.arrays import Array
from planner.search.field import CostField, passable, segment_cost
from planner.search.waypoints import even


class Plane(Protocol):
    """A space of two coordinates with costs."""

    low: tuple[float, float]
    high: tuple[float, float]
    start: tuple[float, float]
    goal: tuple[float, float]

    def cost(self, a0: float, a1: float, b0: float, b1: float) -> float:
        """Cost of the straight motion between two points; infinity where it is impossible."""

    def valid(self, a0: float, a1: float) -> bool:
        """Whether the robot can be there at all."""

    def floor(self, a0: float, a1: float, b0: float, b1: float) -> float:
        """A cost that no motion between the points undercuts."""

    def path(self, states: Array) -> Array:
        """The polyline in the map's frame for states of the space."""


class WholeMap:
    """The map's own x and y."""

    def __init__(
        self,
        field: CostField,
        start: tuple[float, float],
        goal: tuple[float, float],
        cheapest: float,
    ) -> None:
        ny, nx = field.heights.shape
        self.field = field
        self.low = (field.x0 - 0.5 * field.dx, field.y0 - 0.5 * field.dy)
        self.high = (field.x0 + (nx - 0.5) * field.dx, field.y0 + (ny - 0.5) * field.dy)
        self.start, self.goal = start, goal
        self.cheapest = cheapest
        self.step = field.step

    def cost(self, a0: float, a1: float, b0: float, b1: float) -> float:
        """Cost of a straight segment."""
        return float(segment_cost(self.field, a0, a1, b0, b1, self.step))

    def valid(self, a0: float, a1: float) -> bool:
        """Whether any direction can be driven there."""
        return any(passable(self.field, a0, a1, 0.5 * math.pi * k) for k in range(4))

    def floor(self, a0: float, a1: float, b0: float, b1: float) -> float:
        """Straight distance at the cheapest metre there is."""
        return self.cheapest * math.hypot(b0 - a0, b1 - a1)

    def path(self, states: Array) -> Array:
        """States are points already."""
        return states


@njit(cache=True, error_model="numpy")
def _to_map(line: Any, spacing: float, s: float, d: float) -> tuple[float, float]:
    last = line.shape[0] - 1
    k = min(max(int(s / spacing), 0), last - 1)
    w = s / spacing - k
    cx = line[k, 0] + w * (line[k + 1, 0] - line[k, 0])
    cy = line[k, 1] + w * (line[k + 1, 1] - line[k, 1])
    nx = line[k, 2] + w * (line[k + 1, 2] - line[k, 2])
    ny = line[k, 3] + w * (line[k + 1, 3] - line[k, 3])
    return cx + d * nx, cy + d * ny


@njit(cache=True, error_model="numpy")
def _tube_cost(
    field: Any, line: Any, spacing: float, a0: float, a1: float, b0: float, b1: float, chord: float
) -> float:
    pieces = max(1, int(math.ceil(max(abs(b0 - a0), abs(b1 - a1)) / chord)))
    step = field.step
    x, y = _to_map(line, spacing, a0, a1)
    total = 0.0
    for k in range(1, pieces + 1):
        w = k / pieces
        u, v = _to_map(line, spacing, a0 + w * (b0 - a0), a1 + w * (b1 - a1))
        total += segment_cost(field, x, y, u, v, step)
        if total == np.inf:
            return total
        x, y = u, v
    return total


class Tube:
    """A strip of constant width round a path: distance along and offset across."""

    def __init__(
        self, field: CostField, path: Array, cheapest: float, *, half_width_cells: float = 12.0
    ) -> None:
        cell = min(field.dx, field.dy)
        centre = even(path, 2.0 * cell)
        for _ in range(30):  # smooth, so that the strip does not fold over itself
            centre[1:-1] = 0.5 * centre[1:-1] + 0.25 * (centre[:-2] + centre[2:])
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(centre, axis=0).T))])
        count = max(2, len(centre))
        at = np.linspace(0.0, along[-1], count)
        line = np.column_stack([np.interp(at, along, centre[:, k]) for k in (0, 1)])
        tangent = np.gradient(line, axis=0)
        tangent /= np.hypot(*tangent.T)[:, None]
        self.line = np.ascontiguousarray(np.column_stack([line, -tangent[:, 1], tangent[:, 0]]))
        self.field = field
        self.spacing = float(along[-1] / (count - 1))
        self.chord = 4.0 * cell
        half = half_width_cells * cell
        self.low = (0.0, -half)
        self.high = (float(along[-1]), half)
        self.start = (0.0, 0.0)
        self.goal = (float(along[-1]), 0.0)
        self.cheapest = cheapest

    def cost(self, a0: float, a1: float, b0: float, b1: float) -> float:
        """Cost of a motion that is straight in the strip, driven in chords."""
        return float(_tube_cost(self.field, self.line, self.spacing, a0, a1, b0, b1, self.chord))

    def valid(self, a0: float, a1: float) -> bool:
        """Whether any direction can be driven there."""
        x, y = _to_map(self.line, self.spacing, a0, a1)
        return any(passable(self.field, x, y, 0.5 * math.pi * k) for k in range(4))

    def floor(self, a0: float, a1: float, b0: float, b1: float) -> float:
        """Straight distance in the map at the cheapest metre there is."""
        ax, ay = _to_map(self.line, self.spacing, a0, a1)
        bx, by = _to_map(self.line, self.spacing, b0, b1)
        return self.cheapest * math.hypot(bx - ax, by - ay)

    def path(self, states: Array) -> Array:
        """The polyline in the map's frame."""
        points = [states[:1]]
        for a, b in zip(states[:-1], states[1:], strict=True):
            pieces = max(1, math.ceil(float(np.abs(b - a).max()) / self.chord))
            points.append(a + (b - a) * (np.arange(1, pieces + 1) / pieces)[:, None])
        return np.array([_to_map(self.line, self.spacing, s, d) for s, d in np.vstack(points)])


class DissipatedEnergy(ob.OptimizationObjective):  # type: ignore[misc]
    """OMPL's objective on a plane's cost."""

    def __init__(self, information: Any, plane: Plane) -> None:
        super().__init__(information)
        self.plane = plane
        self.evaluations = 0

    def stateCost(self, _state: Any) -> Any:
        """Being somewhere costs nothing."""
        return ob.Cost(0.0)

    def motionCost(self, a: Any, b: Any) -> Any:
        """Cost of the straight motion."""
        self.evaluations += 1
        return ob.Cost(self.plane.cost(a[0], a[1], b[0], b[1]))

    def motionCostHeuristic(self, a: Any, b: Any) -> Any:
        """A lower bound of the motion's cost."""
        return ob.Cost(self.plane.floor(a[0], a[1], b[0], b[1]))

    def isSymmetric(self) -> bool:
        """Uphill is not downhill."""
        return False


class Driveable(ob.MotionValidator):  # type: ignore[misc]
    """A motion is valid where its cost is finite."""

    def __init__(self, information: Any, plane: Plane) -> None:
        super().__init__(information)
        self.plane = plane

    def checkMotion(self, a: Any, b: Any, *_last: Any) -> bool:
        """Whether the straight motion can be driven."""
        return math.isfinite(self.plane.cost(a[0], a[1], b[0], b[1]))
