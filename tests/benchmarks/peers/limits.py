"""Whether a finished route keeps to every limit, looked at ten times a cell.

    broken = broken_limits(case, route)         # {"traction": 3, ...}: samples that break each one

Everything is derived from the poses of the answer: acceleration, yaw rate and how fast the travel
turns by differences, the slope from the map. Only the power model is the planner's.
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from planner.power.limits import LIMIT_NAMES, broken_limit, gear_torques, rms_torques
from planner.power.motion_row import set_acceleration, set_motion, set_wind
from planner.quantities import INDEX
from planner.search.field import ground_classes, sample_surface
from planner.search.results import Route
from planner.terrain.obstacles import rectangle_free
from tests.benchmarks.peers.case import Array, Case

SHARE = 0.1
"""Cells between two samples."""
ROUNDING = 1e-6
BENDS = 0.02
"""Share by which a bend derived from chords may be tighter than the arc that they belong to."""


def broken_limits(case: Case, route: Route) -> dict[str, int]:
    """How many samples of a route break each limit; empty where none does."""
    field, conditions = case.field, case.situation.conditions
    limits = conditions.model.vehicle.limits
    x, y, yaw, time, speed = (route.arrays[name] for name in ("x", "y", "yaw", "t", "speed"))
    lengths, seconds = np.hypot(np.diff(x), np.diff(y)), np.diff(time)
    turns = _turning(x, y, lengths)
    forces = turns
    if route.motion is not None:
        # A straight step beside an arc is no bend, though its chords have one at an end.
        arcs = (1.0 + BENDS) * np.abs(route.motion.curvatures)
        forces = np.clip(turns, -arcs, arcs)
    # What the robot drives along the surface is a little longer than its shadow on the map.
    way = np.hypot(lengths, np.diff(route.arrays["z"]))
    count = np.maximum(1, np.ceil(lengths / (SHARE * min(field.dx, field.dy)))).astype(int)
    step = np.repeat(np.arange(len(count)), count)
    share = np.concatenate([(np.arange(n) + 0.5) / n for n in count])
    points = np.column_stack([x[:-1], y[:-1]])[step]
    points = points + np.column_stack([np.diff(x), np.diff(y)])[step] * share[:, None]
    held = seconds[step] / count[step]
    angles = yaw[:-1][step] + np.diff(yaw)[step] * share
    # Speeds change evenly in time, so their squares do along the way.
    squares = speed[:-1][step] ** 2 + np.diff(speed**2)[step] * share
    here = np.sqrt(np.maximum(squares, 0.0))
    faster = np.diff(speed) / seconds
    mean = np.maximum(way / seconds, 1e-12)
    rates = np.diff(yaw)[step] / seconds[step] * np.where(way[step] > 1e-9, here / mean[step], 1.0)
    _, slopes = sample_surface(field, points)
    rows = conditions.class_rows[ground_classes(field, points)].copy()
    for n, k in enumerate(step):
        moving = way[k] > 1e-9
        direction = math.atan2(y[k + 1] - y[k], x[k + 1] - x[k]) if moving else angles[n]
        set_motion(rows[n], *slopes[n], angles[n], direction, here[n] if moving else 0.0)
        if moving:
            vx, vy = rows[n, INDEX["vx"]], rows[n, INDEX["vy"]]
            sideways = here[n] ** 2 * forces[k]
            set_acceleration(rows[n], faster[k], sideways, vx, vy, max(here[n], 1e-12))
        rows[n, INDEX["wz"]] = rates[n]
        set_wind(rows[n], conditions.wind, angles[n])
    accounts, _ = conditions.model.evaluate(rows)
    broken: Counter[str] = Counter()
    for n, account in enumerate(accounts):
        k = step[n]
        number = broken_limit(account, conditions.limits)
        if number >= 0:
            broken[LIMIT_NAMES[number]] += 1
        if not rectangle_free(
            field.blocked,
            *(field.x0, field.y0, field.dx, field.dy),
            *points[n],
            angles[n],
            *(field.half_length, field.half_width),
        ):
            broken["clearance"] += 1
    broken["speed"] = int((here > limits.speed * (1.0 + ROUNDING)).sum())
    together = np.hypot(faster[step], here**2 * turns[step])
    broken["acceleration"] = int((together > limits.acceleration * (1.0 + BENDS)).sum())
    rms = rms_torques(gear_torques(conditions.model, rows), held, limits.thermal_time)
    broken["torque rms"] = int((rms > limits.continuous_torque * (1.0 + 1e-3)).sum())
    broken["yaw rate"] = int((np.abs(rates) > limits.yaw_rate * (1.0 + 1e-3)).sum())
    return {name: times for name, times in broken.items() if times}


def _turning(x: Array, y: Array, lengths: Array) -> Array:
    """1/m by which the travel turns on every step: the mean of both its ends."""
    directions = np.arctan2(np.diff(y), np.diff(x))
    bends = np.zeros(len(lengths) + 1)
    for k in range(1, len(lengths)):
        before, after = lengths[k - 1], lengths[k]
        if min(before, after) > 1e-9:
            turn = math.remainder(float(directions[k] - directions[k - 1]), 2.0 * math.pi)
            bends[k] = turn / (0.5 * (before + after))
    return 0.5 * (bends[1:] + bends[:-1])
