"""Why a start is refused and why there is no route, in one sentence that names the place."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from planner.errors import RequestError
from planner.power.limits import LIMIT_NAMES, broken_limit
from planner.power.motion_row import set_motion
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, sample_surface
from planner.search.grid import build_lattice, cost_to_go
from planner.search.requests import PoseRequest
from planner.search.resolution import ALL_YAWS, DIRECTIONS, SPARE
from planner.search.situation.traversability import DrivingGround
from planner.terrain.footprint import body_fits
from planner.terrain.interpolation import interpolate

YAW_TRIES = 64
"""Yaw angles over a full turn at which a place is tried, where the request leaves the yaw free."""


def check_place(
    name: str,
    pose: PoseRequest,
    ground: DrivingGround,
    field: CostField,
    conditions: OperatingConditions,
) -> None:
    """Refuse a start, goal or via point at which there is no room for the robot.

    Raises:
        RequestError: naming the field, the place and what would be accepted.
    """
    terrain = ground.terrain
    x, y = pose.x, pose.y
    west, south, east, north = terrain.extent
    if not terrain.contains(x, y):
        raise RequestError(
            name,
            "outside the map",
            value=(x, y),
            accepted=f"x from {west:g} to {east:g}, y from {south:g} to {north:g} m",
        )
    j, i = field.nodes_at((x, y))
    if ground.blocked[j, i]:
        what = _what_blocks(ground, x, y)
        article = {"obstacle": "on an obstacle", "hole": "on a hole (height unknown)"}
        raise RequestError(
            name,
            article.get(what, f"on a {what}"),
            value=(x, y),
            accepted=_nearest_free(ground, field, x, y),
        )
    yaws = _tried(pose.yaw)
    if not any(body_fits(field, x, y, yaw) for yaw in yaws):
        at = "with this yaw" if pose.yaw is not None else "with any yaw"
        raise RequestError(
            name,
            f"the body with {conditions.model.vehicle.limits.clearance:g} m clearance touches "
            f"something {at}",
            value=(x, y) if pose.yaw is None else (x, y, pose.yaw),
            accepted=_nearest_free(ground, field, x, y),
        )


def check_hold(
    name: str, pose: PoseRequest, field: CostField, conditions: OperatingConditions
) -> None:
    """Refuse a place at which the robot cannot stand still on the slope.

    Raises:
        RequestError: naming the field, the slope and what would be accepted.
    """
    _, gradient = sample_surface(field, np.array([[pose.x, pose.y]]))
    px, py = float(gradient[0, 0]), float(gradient[0, 1])
    kind = field.ground[field.nodes_at((pose.x, pose.y))]
    row = conditions.class_rows[kind].copy()
    broken = 0
    for yaw in _tried(pose.yaw):
        set_motion(row, px, py, yaw, 0.0, 0.0)
        accounts, _ = conditions.model.evaluate(row[None])
        broken = broken_limit(accounts[0], conditions.limits)
        if broken < 0:
            return
    # With a fitting yaw this slope can be driven in every direction.
    least = float(field.limit[kind, : DIRECTIONS // 2].min()) * field.margin
    raise RequestError(
        name,
        f"the slope of {math.degrees(math.atan(math.hypot(px, py))):.1f}° there cannot be held: "
        f"{LIMIT_NAMES[broken]}",
        value=(pose.x, pose.y),
        accepted=f"a slope of at most {math.degrees(math.atan(max(least, 0.0))):.1f}°",
    )


def explain_no_route(
    ground: DrivingGround,
    field: CostField,
    start: tuple[float, float],
    goal: tuple[float, float],
) -> str:
    """What blocks the path: the narrowest gap between what start and goal can reach, and why."""
    lattice = build_lattice(field)
    to_goal = np.isfinite(cost_to_go(field, lattice, goal).values)
    from_start = np.isfinite(cost_to_go(field, lattice, start, from_start=True).values)
    straight = math.atan2(goal[1] - start[1], goal[0] - start[0])
    for reach, words, (x, y) in (
        (to_goal, "the goal cannot be reached", goal),
        (from_start, "the start cannot be left", start),
    ):
        if not reach.any():
            steps = ((a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b)
            ring = [(x, y), *((x + field.dx * a, y + field.dy * b) for a, b in steps)]
            what, bx, by = _blocking(ground, field, ring, straight)
            return f"{words}: {what} at x {bx:.2f}, y {by:.2f}"
    if float(field.limit.max()) <= 0.0:
        return "the robot cannot drive even on level ground: it is too heavy or too weak for it"
    distance, nearest = ndimage.distance_transform_edt(
        ~to_goal, sampling=(field.dy, field.dx), return_indices=True
    )
    distance = np.where(from_start, distance, np.inf)
    j, i = np.unravel_index(int(np.argmin(distance)), distance.shape)
    j2, i2 = nearest[0][j, i], nearest[1][j, i]
    count = 2 * int(max(abs(j2 - j), abs(i2 - i))) + 1
    if count > 1:
        straight = math.atan2(field.dy * (j2 - j), field.dx * (i2 - i))
    line = [
        (field.x0 + field.dx * (i + (i2 - i) * w), field.y0 + field.dy * (j + (j2 - j) * w))
        for w in np.linspace(0.0, 1.0, count)
    ]
    what, bx, by = _blocking(ground, field, line, straight)
    return (
        f"no way from start to goal: between x {line[0][0]:.2f}, y {line[0][1]:.2f} and "
        f"x {line[-1][0]:.2f}, y {line[-1][1]:.2f} blocks {what} at x {bx:.2f}, y {by:.2f}"
    )


def _blocking(
    ground: DrivingGround,
    field: CostField,
    points: list[tuple[float, float]],
    direction: float,
) -> tuple[str, float, float]:
    """The worst thing along points driven in a direction: something solid, a slope, no room."""
    steep, narrow = (-math.inf, "a slope", *points[0]), None
    for x, y in points:
        j, i = field.nodes_at((x, y))
        if ground.blocked[j, i]:
            what = _what_blocks(ground, x, y)
            return f"an {what}" if what[0] in "aeiou" else f"a {what}", x, y
        if ground.mask[j, i] != ALL_YAWS and narrow is None:
            needed = 2.0 * (ground.half_width - SPARE)
            narrow = (f"a passage too narrow for the body ({needed:.2f} m with clearance)", x, y)
        _, px, py = interpolate(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
        steepness = math.hypot(px, py)
        uphill = math.atan2(py, px) - direction
        direction_bin = round(uphill / (2.0 * math.pi) * DIRECTIONS) % DIRECTIONS
        limit = float(field.limit[field.ground[j, i], direction_bin])
        excess = steepness / max(limit * field.margin, 1e-6)
        if excess > steep[0]:
            slope = math.degrees(math.atan(steepness))
            allowed = math.degrees(math.atan(limit * field.margin))
            text = f"a slope of {slope:.1f}° > {allowed:.1f}° limit in this direction"
            if excess <= 1.0:
                # The limit is broken beside the straight line that is looked at here.
                text = f"ground too steep to cross (a slope of {slope:.1f}° and more)"
            steep = (excess, text, x, y)
    if steep[0] <= 1.0 and narrow is not None:
        return narrow
    return steep[1], steep[2], steep[3]


def _what_blocks(ground: DrivingGround, x: float, y: float) -> str:
    j, i = ground.terrain.cell_index(x, y)
    return ground.terrain.why_blocked(ground.step_height, j, i) or "ledge"


def _tried(yaw: float | None) -> list[float]:
    if yaw is not None:
        return [yaw]
    return [2.0 * math.pi * k / YAW_TRIES for k in range(YAW_TRIES)]


def _nearest_free(ground: DrivingGround, field: CostField, x: float, y: float) -> str:
    """The nearest place with room for the body, in words."""
    free: NDArray[np.bool_] = ground.mask != 0
    if not free.any():
        return "a map with room for the robot somewhere"
    j, i = np.nonzero(free)
    px, py = field.x0 + field.dx * i, field.y0 + field.dy * j
    k = int(np.argmin((px - x) ** 2 + (py - y) ** 2))
    return f"free ground, the nearest at x {px[k]:.2f}, y {py[k]:.2f}"
