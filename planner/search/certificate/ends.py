"""What starting and stopping costs at least: the time that a robot needs to become fast.

    joules = both_ends(floor, mesh, conditions, start, goal)

A steadily driven route dissipates no less than steady driving at its own speed. Within s of rest
that speed is at most √(2·a·s) with the largest acceleration a. The floor of the metres counts the
best speed. So the difference may be added: over a ramp, with ds = v·dv/a,

    (1/a)·∫ [p(v) - v·c] dv,      v from 0 to the largest speed, or to √(a·distance) if that is less

p(v) is the least power at speed v and c the floor of a metre at the same slope. p - v·c is looked
up at the speeds of the table and is the least over all slopes round the place. It falls with the
speed: below the first one it counts as there, and between two as on their chord, less
``SPEED_RESERVE``.
"""

from __future__ import annotations

import math

import numpy as np

from planner.search.certificate.mesh import Mesh
from planner.search.certificate.steady_floor import COARSE, FINER, SPEEDS, SteadyFloor
from planner.search.conditions import OperatingConditions

Place = tuple[float, float]

SPEED_RESERVE = 0.03
"""Share taken off for speeds between those of the table."""


def both_ends(
    floor: SteadyFloor, mesh: Mesh, conditions: OperatingConditions, start: Place, goal: Place
) -> float:
    """J that start and stop add at least to the floor of the metres.

    Args:
        floor, mesh: table and ground.
        conditions: for speed and acceleration.
        start, goal: x, y, m.
    """
    top, most = float(conditions.limits[0]), conditions.model.vehicle.limits.acceleration
    reached = min(top, math.sqrt(most * math.dist(start, goal)))
    speeds = top * np.arange(1, SPEEDS + 1) / SPEEDS
    total = 0.0
    for place in (start, goal):
        steepest = _steepest_near(mesh, place, 0.5 * reached * reached / most)
        slopes = np.linspace(-floor.steepest, floor.steepest, COARSE)
        near = np.hypot(slopes[:, None], slopes[None, :]) <= steepest + 2.0 * FINER * floor.step
        over = floor.by_speed - floor.least[:, None, ::FINER, ::FINER]
        least = np.maximum(over[:, :, near].min(axis=(0, 2)), 0.0) * speeds
        # No way to drive so fast is known: nothing is counted.
        least[~np.isfinite(least)] = 0.0
        ramp = np.linspace(0.0, reached, 65)
        watts = np.interp(ramp, speeds, least)
        # A metre along the ground is longer than a horizontal one.
        total += float(np.trapezoid(watts, ramp)) / math.hypot(1.0, steepest)
    return (1.0 - SPEED_RESERVE) * total / most


def _steepest_near(mesh: Mesh, place: Place, distance: float) -> float:
    """Largest slope of the ground within a distance, m."""
    rows, columns = mesh.ranges.shape[:2]
    axes = list(zip(place, mesh.origin, mesh.cell, strict=True))
    first, last = (
        [math.floor((p + reach - o) / d) for p, o, d in axes] for reach in (-distance, distance)
    )
    part = mesh.ranges[
        min(max(first[1], 0), rows - 1) : max(min(last[1], rows - 1), 0) + 1,
        min(max(first[0], 0), columns - 1) : max(min(last[0], columns - 1), 0) + 1,
    ]
    along, across = np.abs(part[..., :2]).max(), np.abs(part[..., 2:]).max()
    return math.hypot(float(along), float(across))
