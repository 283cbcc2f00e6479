"""An independent integrator: the energy of a route from its poses alone.

It reads the poses of ROUTE.json and the map, interpolates the ground with scipy's bicubic spline,
derives velocity, acceleration and yaw rate from the poses by differences, and asks the second power
model of tests/power/reference.py for the power, in steps of a few centimetres. Nothing of
planner/search or planner/power is used.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from tests.power.reference import Robot, State, evaluate, gravity_on


def energy(
    poses: list[dict[str, float]],
    heights: NDArray[np.float64],
    origin: tuple[float, float],
    cell: tuple[float, float],
    robot: Robot,
    *,
    pieces: int = 6,
) -> float:
    """J drawn from the source along the poses.

    Args:
        poses: as in ROUTE.json.
        heights: (ny, nx) m, ground as the robot's footprint feels it; row 0 is south.
        origin, cell: m, centre of cell [0, 0] and cell sides.
        robot: numbers of the second model.
        pieces: midpoint steps between two poses.
    """
    x = origin[0] + cell[0] * np.arange(heights.shape[1])
    y = origin[1] + cell[1] * np.arange(heights.shape[0])
    ground = RectBivariateSpline(y, x, heights, kx=3, ky=3)
    total = 0.0
    for k in range(len(poses) - 1):
        a, b = poses[k], poses[k + 1]
        duration = b["t"] - a["t"]
        if duration <= 0.0:
            continue
        across = _turning(poses, k)
        for piece in range(pieces):
            w = (piece + 0.5) / pieces
            total += _watts(a, b, w, duration, across, ground, robot) * duration / pieces
    return total


def _watts(
    a: dict[str, float],
    b: dict[str, float],
    w: float,
    duration: float,
    across: float,
    ground: Any,
    robot: Robot,
) -> float:
    dx, dy = b["x"] - a["x"], b["y"] - a["y"]
    moving = math.hypot(dx, dy) > 1e-9
    speed = a["speed"] + (b["speed"] - a["speed"]) * w
    # Share of the way after the share w of the time, at constant acceleration.
    mean = 0.5 * (a["speed"] + b["speed"])
    way = w * (a["speed"] + 0.5 * (b["speed"] - a["speed"]) * w) / mean if moving else w
    px, py = a["x"] + dx * way, a["y"] + dy * way
    slope_x = float(ground(py, px, dy=1)[0, 0])
    slope_y = float(ground(py, px, dx=1)[0, 0])
    yaw = a["yaw"] + (b["yaw"] - a["yaw"]) * way
    gravity = gravity_on(slope_x, slope_y, yaw)
    vx = vy = ax = ay = 0.0
    if moving:
        length = math.hypot(dx, dy)
        ux, uy = dx / length, dy / length
        # Body axes on the slope, by their definition.
        normal = np.array([-slope_x, -slope_y, 1.0])
        normal /= np.linalg.norm(normal)
        forward = np.array(
            [math.cos(yaw), math.sin(yaw), slope_x * math.cos(yaw) + slope_y * math.sin(yaw)]
        )
        forward /= np.linalg.norm(forward)
        left = np.cross(normal, forward)
        travel = np.array([ux, uy, slope_x * ux + slope_y * uy])
        travel /= np.linalg.norm(travel)
        cx, cy = float(travel @ forward), float(travel @ left)
        vx, vy = speed * cx, speed * cy
        along = (b["speed"] - a["speed"]) / duration
        sideways = across * speed
        ax, ay = along * cx - sideways * cy, along * cy + sideways * cx
    rate = (b["yaw"] - a["yaw"]) / duration
    if moving:
        rate *= speed / mean
    state = State(velocity=(vx, vy, rate), gravity=gravity, acceleration=(ax, ay, 0.0))
    return float(evaluate(robot, state).supply)


def _turning(poses: list[dict[str, float]], k: int) -> float:
    """Rate of change of the direction of travel on step k, rad/s, from the steps beside it."""

    def direction(j: int) -> float | None:
        if not 0 <= j < len(poses) - 1:
            return None
        dx, dy = poses[j + 1]["x"] - poses[j]["x"], poses[j + 1]["y"] - poses[j]["y"]
        return math.atan2(dy, dx) if math.hypot(dx, dy) > 1e-9 else None

    here, before, after = direction(k), direction(k - 1), direction(k + 1)
    if here is None:
        return 0.0
    turns = []
    for other, one, two in ((before, k - 1, k), (after, k, k + 1)):
        if other is not None:
            turn = math.remainder((here - other) * (1 if other is before else -1), 2.0 * math.pi)
            middle = 0.5 * (poses[two + 1]["t"] - poses[one]["t"])
            turns.append(turn / middle)
    return sum(turns) / len(turns) if turns else 0.0
