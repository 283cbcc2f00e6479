"""Motions at random, and what they cost: attempts to undercut a bound.

A motion is a polyline with jitter between two places, driven with random yaw, turning, speeding up
and slowing down within the limits of speed, acceleration and yaw rate. Other limits (traction,
current, wheel load) are not kept: the bound may not need them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, sample_surface
from planner.search.trajectory import Motion, motion_rows

Array = NDArray[np.float64]


def random_motion(
    field: CostField, conditions: OperatingConditions, path: Array, rng: np.random.Generator
) -> Motion:
    """Drive along a polyline (n, 2) with random speeds and yaw; at rest at both ends."""
    limits = conditions.model.vehicle.limits
    top, most, rate = float(conditions.limits[0]), limits.acceleration, limits.yaw_rate
    spacing = 0.4 * min(field.dx, field.dy)
    points = [path[0]]
    for a, b in zip(path[:-1], path[1:], strict=True):
        # A route that turns on the spot stands at one place twice: no time passes between.
        count = math.ceil(math.dist(a, b) / spacing - 1e-9)
        points += [a + (b - a) * k / count for k in range(1, count + 1)]
    xy = np.array(points)
    z, _ = sample_surface(field, xy)
    lengths = np.sqrt((np.diff(xy, axis=0) ** 2).sum(axis=1) + np.diff(z) ** 2)
    # Targets of speed that change now and then, kept within the acceleration both ways.
    pieces = np.repeat(rng.uniform(0.3, 1.0, len(xy)), rng.integers(1, 60, len(xy)))[: len(xy)]
    if rng.random() < 0.6:
        pieces[:] = 1.0
    speed = top * pieces
    speed[[0, -1]] = 0.0
    gain = most * rng.uniform(0.5, 1.0)
    for k in range(1, len(xy)):
        speed[k] = min(speed[k], math.sqrt(speed[k - 1] ** 2 + 2.0 * gain * lengths[k - 1]))
    for k in range(len(xy) - 2, -1, -1):
        speed[k] = min(speed[k], math.sqrt(speed[k + 1] ** 2 + 2.0 * gain * lengths[k]))
    seconds = 2.0 * lengths / (speed[1:] + speed[:-1])
    travel = np.unwrap(np.arctan2(*np.diff(xy, axis=0).T[::-1]))
    travel = np.append(travel, travel[-1])
    aim = travel + rng.choice([0.0, 0.25, 0.5, 0.75, 1.0]) * math.pi
    if rng.random() < 0.3:
        aim = aim + np.cumsum(rng.normal(0.0, 0.1, len(xy)))
    yaw = aim.copy()
    for k in range(1, len(xy)):
        turn = (
            0.9 * rate * min(seconds[k - 1], lengths[k - 1] / max(speed[k - 1 : k + 1].max(), 1e-9))
        )
        yaw[k] = yaw[k - 1] + np.clip(aim[k] - yaw[k - 1], -turn, turn)
    nothing = np.zeros(len(lengths))
    time = np.concatenate([[0.0], np.cumsum(seconds)])
    return Motion(xy[:, 0], xy[:, 1], z, yaw, time, speed, nothing, nothing)


def energies(
    field: CostField,
    conditions: OperatingConditions,
    routes: list[Array],
    attempts: int,
    seed: int,
) -> Array:
    """J of random motions along jittered copies of routes (n, 2) each."""
    rng = np.random.default_rng(seed)
    found = np.empty(attempts)
    low = np.array([field.x0, field.y0])
    high = low + np.array([field.dx, field.dy]) * (np.array(field.heights.shape[::-1]) - 1)
    for k in range(attempts):
        path = routes[k % len(routes)]
        keep = np.sort(rng.choice(len(path), max(2, int(len(path) * rng.uniform(0.05, 0.6)))))
        keep[[0, -1]] = 0, len(path) - 1
        path = path[np.unique(keep)].copy()
        path[1:-1] += rng.normal(0.0, 1.0, path[1:-1].shape) * rng.choice([0.0, 0.05, 0.3, 1.0])
        motion = random_motion(field, conditions, np.clip(path, low, high), rng)
        rows, seconds, _ = motion_rows(field, motion, conditions.class_rows, conditions.wind)
        found[k] = float(conditions.model.watts(rows) @ seconds)
    return found
