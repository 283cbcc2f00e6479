"""Planned routes as the virtual robot drives them.

Position, yaw and speed vary linearly in time between poses, as ROUTE.json says; as no robot changes
its velocity in a step, corners are rounded. The slope under the robot is that of the plane which
lies best on a ring of contacts around its centre,

    dz/dx = 2/(K·l)·Σ z_k·cos φ_k        K points at angles φ_k, l half the wheelbase

or, where no terrain is given, the slope along the path alone.

Left out: a controller of position. The robot follows speeds; what it falls behind is not made up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from planner.arrays import Array, Integers
from planner.errors import InputError
from planner.telemetry.virtual.dynamics import BIN, MOTION
from planner.telemetry.virtual.profiles import (
    ROW,
    SURFACES,
    Profile,
    attitude,
    axes,
    bins_of,
    level_calm,
    set_quantities,
    tilting,
)
from planner.terrain.heightmap import Terrain

CONTACTS = 16
"""Points around the body's edge at which the ground is read."""
CORNER = 0.3
"""s before and after a corner of the route within which the robot rounds it."""


def planned_route(
    route: Mapping[str, Any],
    *,
    terrain: Terrain | None = None,
    half_length: float = 0.0,
    row: float = ROW,
    settings: Mapping[str, float] | None = None,
) -> Profile:
    """A profile of one run that drives the poses of a planned route.

    Args:
        route: one entry of ``routes`` in a ROUTE.json, with its ``poses``.
        terrain: what it leads over, for slopes along and across and the ground's rolling factor.
            Without it the slope along the path is taken from the poses' heights and the slope
            across it is zero.
        half_length: m, half the wheelbase, over which the robot feels the slope of a terrain.
        row: s, interval of a row.
        settings: names of ``CONDITIONS`` or ``START`` → value.

    Raises:
        InputError: the route has fewer than two poses, or a pose lacks a number.
    """
    poses = list(route.get("poses", ()))
    if len(poses) < 2:
        raise InputError("route poses", "too few", value=len(poses), accepted="two or more")
    keys = ("t", "x", "y", "z", "yaw", "speed")
    try:
        t, x, y, z, yaw, speed = np.array([[float(p[key]) for p in poses] for key in keys])
    except (KeyError, TypeError, ValueError) as error:
        accepted = f"poses with the numbers {', '.join(keys)}"
        raise InputError("route poses", f"unusable: {error!r}", accepted=accepted) from None
    later = np.concatenate([[True], np.diff(t) > 1e-9])
    t, x, y, z, yaw, speed = (q[later] for q in (t - t[0], x, y, z, np.unwrap(yaw), speed))
    # A last part of a row is filled up by standing at the goal.
    bins = bins_of(row) * math.ceil(t[-1] / row + 1e-9)
    edges = np.arange(bins + 1) * BIN
    step = np.hypot(np.diff(x), np.diff(y))
    going = np.arctan2(np.diff(y), np.diff(x))
    rise = np.divide(np.diff(z), step, out=np.zeros_like(step), where=step > 1e-9)
    piece = np.clip(np.searchsorted(t, edges, side="right") - 1, 0, len(step) - 1)
    yaws = np.interp(edges, t, yaw)
    if terrain is None:
        p, q = rise[piece] * np.cos(going[piece]), rise[piece] * np.sin(going[piece])
    else:
        ring = max(half_length, 1e-3)
        p, q = footprint_slopes(terrain, np.interp(edges, t, x), np.interp(edges, t, y), ring)
    motion = np.zeros((1, bins + 1, len(MOTION)))
    pace = np.where(edges <= t[-1] + BIN, np.interp(edges, t, speed), 0.0)
    # Along the surface: horizontal direction lifted onto the plane, then seen by the body.
    ux, uy = np.cos(going[piece]), np.sin(going[piece])
    along = np.stack([ux, uy, p * ux + q * uy])
    along *= pace / np.linalg.norm(along, axis=0)
    along = np.stack([_rounded(part) for part in along])
    forward, left = axes(p, q, yaws)
    motion[0, :, 0] = np.sum(along * forward, axis=0)
    motion[0, :, 1] = np.sum(along * left, axis=0)
    motion[0, :, 2] = _rounded(np.interp(edges + 0.5 * BIN, edges[1:], np.diff(yaws) / BIN))
    motion[0, :, 3], motion[0, :, 4] = attitude(p, q, yaws)
    conditions, starts = level_calm(1, bins)
    conditions[0, :, 0] = tilting(p, q)
    surfaces: tuple[str, ...] = SURFACES
    if terrain is not None:
        surfaces = tuple(kind.name for kind in terrain.ground_classes)
        middle = edges[:-1] + 0.5 * BIN
        kinds = _ground(terrain, np.interp(middle, t, x), np.interp(middle, t, y))
        conditions[0, :, 4] = kinds
        conditions[0, :, 6] = np.array([kind.rolling for kind in terrain.ground_classes])[kinds]
    set_quantities(settings or {}, conditions, starts)
    return Profile("planned_route", motion, conditions, starts, surfaces, ("route",), (), row)


def _rounded(velocity: Array) -> Array:
    """A velocity that changes in steps, as a robot with mass follows it; its integral stays."""
    reach = round(CORNER / BIN)
    window = np.hanning(2 * reach + 1)
    padded = np.pad(velocity, reach - 1, mode="edge")
    return np.convolve(padded, window[1:-1] / window.sum(), mode="valid")


def footprint_slopes(
    terrain: Terrain, x: Array, y: Array, half_length: float
) -> tuple[Array, Array]:
    """Slopes dz/dx and dz/dy of the best plane through a ring of contacts, arrays like x and y."""
    p, q = np.zeros_like(x), np.zeros_like(y)
    for angle in 2.0 * math.pi * np.arange(CONTACTS) / CONTACTS:
        c, s = math.cos(angle), math.sin(angle)
        z = np.asarray(terrain.height(x + half_length * c, y + half_length * s))
        # Σ cos² = CONTACTS/2, and cos, sin and 1 are orthogonal on the ring.
        p += 2.0 * c * z / (CONTACTS * half_length)
        q += 2.0 * s * z / (CONTACTS * half_length)
    return p, q


def _ground(terrain: Terrain, x: Array, y: Array) -> Integers:
    """Index of the ground class at each point."""
    rows, columns = terrain.ground.shape
    column = np.rint((x - terrain.origin[0]) / terrain.cell[0]).astype(np.int64)
    row = np.rint((y - terrain.origin[1]) / terrain.cell[1]).astype(np.int64)
    kinds = terrain.ground[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
    return kinds.astype(np.int64)
