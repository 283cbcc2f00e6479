"""Tables of steady driving, filled by the power model for every slope, heading and speed.

    tables = steady_costs(model, class_rows)          # steady_cost has the axes

For each angle of the body and each direction of the gradient the steepest slope within all limits
is bisected. Up to it, a metre costs the least over all speeds, the fastest one included.

Where rollers stand, their dry friction changes its sign. On a side slope, Mecanum wheels that drive
ahead creep when the body is turned downhill by a degree. Their drag then holds the robot in place
of its motors: up to 5 % less than straight ahead. So in the bins round such angles the body may
take a crab angle, at which that drag is the full one at full speed, or twice that. The best one is
tabulated with its cost.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from planner.compiled_code import njit
from planner.power.account import ACCOUNT_LENGTH, PER_WHEEL
from planner.power.kernels import KERNEL
from planner.power.kinematics import ROLLER
from planner.power.limits import broken_limit, limit_values
from planner.power.model import PowerModel
from planner.power.motion_row import set_motion
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.kernel_arguments import EAGER, F1, F2, F3, F4
from planner.search.resolution import (
    DIRECTIONS,
    GENTLE,
    LEAST_COST,
    OBJECTIVES,
    STEEPNESSES,
    YAWS,
)
from planner.search.steady.steady_cost import SteadyCosts, cost_for_best_yaw, level_cost

SPEEDS = 8
"""Speeds up to the largest at which a metre is priced: the cost is flat round its minimum."""
FULL_DRAG = 4.0
"""Speed of a roller from which its drag counts as full, in widths of its smooth sign: to 3 %."""
CRAB_ANGLES = (0.0, 1.0, 2.0, -1.0, -2.0)
"""Angles off that of standing rollers that are tried, in those at which their drag is full."""

_VX, _VY = INDEX["vx"], INDEX["vy"]
_WHEEL_COLUMNS = len(PER_WHEEL)


class _Robot(NamedTuple):
    """What a model is evaluated with.

    Attributes:
        parameters, body, wheels: of the model.
        limits: see ``planner.power.limits``.
        row: of the motion at 1 m/s; changed from one evaluation to the next.
        account, per_wheel: scratch.
    """

    parameters: Any
    body: Any
    wheels: Any
    limits: Any
    row: Any
    account: Any
    per_wheel: Any


@njit(cache=True, error_model="numpy")
def _watts(kernel: Any, robot: Any) -> float:
    """Power of the motion in the row, or infinity where a limit is broken."""
    parameters, body, wheels, limits, row, account, per_wheel = robot
    watts: float = kernel(row, parameters, body, wheels, account, per_wheel)
    return np.inf if broken_limit(account, limits) >= 0 else watts


@njit(cache=True, error_model="numpy")
def _cost_at_speed(kernel: Any, robot: Any, speed: float, objective: int) -> float:
    """Cost per metre along the surface, or infinity where a limit is broken."""
    row = robot.row
    vx, vy = row[_VX], row[_VY]
    row[_VX], row[_VY] = vx * speed, vy * speed
    watts = _watts(kernel, robot)
    row[_VX], row[_VY] = vx, vy
    if objective == 1 and watts < np.inf:
        return 1.0 / speed
    return watts / speed


@njit(cache=True, error_model="numpy")
def _best_cost(kernel: Any, robot: Any, objective: int) -> float:
    """Least cost per metre along the surface over all speeds; the fastest one is bisected."""
    best, fastest, refused = np.inf, 0.0, 0.0
    for k in range(SPEEDS, -4, -1):
        if k > 0:
            speed = robot.limits[0] * k / SPEEDS
        elif fastest > 0.0 and refused > 0.0:
            speed = 0.5 * (fastest + refused)
        else:
            break
        cost = _cost_at_speed(kernel, robot, speed, objective)
        best = min(best, cost)
        if cost == np.inf and (fastest == 0.0 or k <= 0):
            refused = speed
        elif fastest == 0.0 or k <= 0:
            fastest = speed
    return best


@njit(cache=True, error_model="numpy")
def _with_crab_angles(
    kernel: Any,
    robot: Any,
    objective: int,
    pose: tuple[float, float, float],
    still: tuple[float, float],
) -> tuple[float, float]:
    """Least cost per horizontal metre, and its yaw.

    Costs are for energy without what climbing stores.

    Args:
        kernel, robot, objective: the model, what it is evaluated with, and the aim.
        pose: slope along and across the travel, and yaw to it in rad.
        still: angle at which rollers stand, and the crab angle off it, 0 where none stands; rad.
    """
    along, across, yaw = pose
    angle, crab = still
    best, best_yaw = np.inf, yaw
    for n in range(-1, len(CRAB_ANGLES) if crab > 0.0 else 0):
        turned = angle + CRAB_ANGLES[n] * crab if n >= 0 else yaw
        if n >= 0 and turned == yaw:
            continue
        stretch = set_motion(robot.row, along, across, turned, 0.0, 1.0)
        cost: float = _best_cost(kernel, robot, objective)
        cost *= stretch
        if objective == 0:
            cost = max(cost - robot.limits[4] * STANDARD_GRAVITY * along, LEAST_COST)
        if cost < best:
            best, best_yaw = cost, turned
    return best, best_yaw


@njit(types.void(KERNEL, F1, F1, F2, F2, F1, types.int64, F2, F4, F3, F4), **EAGER)
def _fill(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    class_rows: Any,
    limits: Any,
    objective: int,
    still: Any,
    by_yaw: Any,
    yaw_limit: Any,
    crab_angle: Any,
) -> None:
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    crawl = limits[0] / SPEEDS
    for c in range(by_yaw.shape[0]):
        row = class_rows[c].copy()
        robot = _Robot(parameters, body, wheels, limits, row, account, per_wheel)
        for t in range(YAWS):
            yaw = 2.0 * math.pi * t / YAWS
            for f in range(DIRECTIONS):
                azimuth = 2.0 * math.pi * f / DIRECTIONS
                px, py = math.cos(azimuth), math.sin(azimuth)
                low, high = 0.0, limits[5]
                for _ in range(14):
                    middle = 0.5 * (low + high)
                    set_motion(row, px * middle, py * middle, yaw, 0.0, crawl)
                    if _watts(kernel, robot) == np.inf:
                        high = middle
                    else:
                        low = middle
                set_motion(row, 0.0, 0.0, yaw, 0.0, crawl)
                level = _watts(kernel, robot) < np.inf
                yaw_limit[c, t, f] = low if level else -1.0
                for s in range(STEEPNESSES):
                    # Just inside the limit, where the speed is not yet squeezed to a crawl.
                    steepness = low * (1.0 - 1e-3) * s / (STEEPNESSES - 1)
                    along, across = steepness * px, steepness * py
                    crab_angle[c, t, f, s] = 0.0
                    if not level:
                        by_yaw[c, t, f, s] = np.inf
                        continue
                    if objective == 2:
                        by_yaw[c, t, f, s] = math.sqrt(1.0 + along * along)
                        continue
                    crab = still[t, 1] if objective == 0 else 0.0
                    best, best_yaw = _with_crab_angles(
                        kernel, robot, objective, (along, across, yaw), (still[t, 0], crab)
                    )
                    by_yaw[c, t, f, s], crab_angle[c, t, f, s] = best, best_yaw - yaw


@njit(cache=True, error_model="numpy")
def _minimise_over_yaw(by_yaw: Any, yaw_limit: Any, best: Any, limit: Any, order: Any) -> None:
    cost = np.empty(YAWS)
    for c in range(best.shape[0]):
        for f in range(DIRECTIONS):
            limit[c, f] = yaw_limit[c, :, f].max()
            for s in range(STEEPNESSES):
                steepness = max(limit[c, f], 0.0) * s / (STEEPNESSES - 1)
                for t in range(YAWS):
                    edge = yaw_limit[c, t, f]
                    cost[t] = np.inf
                    if 0.0 <= edge >= steepness:
                        cost[t] = level_cost(by_yaw[c, t, f], edge, steepness, STEEPNESSES)
                for rank, t in enumerate(np.argsort(cost)):
                    order[c, f, s, rank] = t
                best[c, f, s] = cost.min()


@njit(cache=True, error_model="numpy")
def _gentle(best: Any, limit: Any, reach: float) -> Any:
    table = np.empty((best.shape[0], GENTLE, GENTLE))
    for c in range(best.shape[0]):
        for i in range(GENTLE):
            for j in range(GENTLE):
                along = reach * (2.0 * i / (GENTLE - 1) - 1.0)
                across = reach * (2.0 * j / (GENTLE - 1) - 1.0)
                # The corners are never looked up, their neighbours inside the circle are.
                steepness = math.sqrt(along * along + across * across)
                azimuth = math.atan2(across, along)
                table[c, i, j] = cost_for_best_yaw(best, limit, c, azimuth, steepness, 1e9)
    return table


def _still(model: PowerModel) -> NDArray[np.float64]:
    """The angle at which a roller stands in every bin, and the crab angle of full drag.

    (YAWS, 2) rad; the second is 0 where none stands.
    """
    width = 2.0 * math.pi / YAWS
    found = np.zeros((YAWS, 2))
    for ahead, aside in model.wheels[:, ROLLER : ROLLER + 2]:
        top = math.hypot(ahead, aside) * model.vehicle.limits.speed
        crab = FULL_DRAG * model.sliding_speed / top
        # Every crab angle stays within its bin.
        if crab > 0.25 * width:
            continue
        for yaw in math.atan2(ahead, aside) + math.pi * np.arange(2):
            t = round(yaw / width)
            off = yaw - t * width
            # To the last bit the bin's own angle, where it is meant to be that.
            angle = t % YAWS * width + (off if abs(off) > 1e-9 else 0.0)
            found[t % YAWS] = angle, max(crab, found[t % YAWS, 1])
    return found


def steady_costs(
    model: PowerModel, class_rows: NDArray[np.float64], objective: str = "energy"
) -> SteadyCosts:
    """Tabulate steady driving for a model.

    Args:
        model: the power model.
        class_rows: (classes, ROW_LENGTH) conditions, one row for each ground class of the map.
        objective: "energy" (dissipated J/m), "time" (s/m) or "length" (m/m).
    """
    classes = len(class_rows)
    by_yaw = np.empty((classes, YAWS, DIRECTIONS, STEEPNESSES))
    yaw_limit = np.empty((classes, YAWS, DIRECTIONS))
    crab_angle = np.empty_like(by_yaw)
    _fill(
        *(model.kernel, model.parameters, model.body, model.wheels),
        np.ascontiguousarray(class_rows, dtype=float),
        limit_values(model, float(class_rows[0, INDEX["payload"]])),
        OBJECTIVES[objective],
        _still(model),
        *(by_yaw, yaw_limit, crab_angle),
    )
    best = np.empty((classes, DIRECTIONS, STEEPNESSES))
    limit = np.empty((classes, DIRECTIONS))
    order = np.empty((*best.shape, YAWS), np.uint8)
    _minimise_over_yaw(by_yaw, yaw_limit, best, limit, order)
    reach = max(float(limit.min()), 1e-9)
    gentle = _gentle(best, limit, reach)
    return SteadyCosts(by_yaw, yaw_limit, crab_angle, best, limit, gentle, order, reach)
