"""Filling the tables of steady driving: the model is asked about every slope, heading and speed.

    tables = steady_costs(model, class_rows)          # steady_cost has the axes

For each angle of the body and each direction of the gradient the steepest slope within all limits
is bisected; up to it, a metre costs the least over all speeds, the fastest one included.

Where rollers stand, their dry friction changes its side. Turned downhill by a degree, those of
Mecanum wheels that drive ahead along a side slope creep, and their drag holds the robot so that its
motors need not: up to 5 % less than straight ahead. So in the bins round such angles the body may
lean off them, by as much as makes that drag the full one at full speed, or twice that, and what is
best is tabulated with its cost.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planner.power.account import ACCOUNT_LENGTH, PER_WHEEL
from planner.power.kernel_math import SLIDING_SPEED
from planner.power.kernels import KERNEL
from planner.power.kinematics import ROLLER
from planner.power.limits import broken_limit, limit_values
from planner.power.model import PowerModel
from planner.power.motion_row import set_motion
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.resolution import DIRECTIONS, GENTLE, OBJECTIVES, STEEPNESSES, YAWS
from planner.search.steady.steady_cost import SteadyCosts, cost_for_best_yaw, level_cost

SPEEDS = 8
CREEP = 4.0
"""Creep of a roller, in widths of its smooth sign, from which its drag counts as full."""
LEANS = (0.0, 1.0, 2.0, -1.0, -2.0)
"""Angles off that of standing rollers that are tried, in those at which they creep so."""

_F1 = types.Array(types.float64, 1, "C")
_F2 = types.Array(types.float64, 2, "C")
_F3 = types.Array(types.float64, 3, "C")
_F4 = types.Array(types.float64, 4, "C")
_VX, _VY = INDEX["vx"], INDEX["vy"]
_WHEEL_COLUMNS = len(PER_WHEEL)


@njit(
    types.float64(KERNEL, _F1, _F1, _F2, _F1, _F1, types.float64, types.int64, _F1, _F2),
    cache=True,
    error_model="numpy",
)
def _cost_at_speed(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    row: Any,
    limits: Any,
    speed: float,
    objective: int,
    account: Any,
    per_wheel: Any,
) -> float:
    """Cost per metre along the surface, or infinity where a limit is broken. Row is for 1 m/s."""
    vx, vy = row[_VX], row[_VY]
    row[_VX], row[_VY] = vx * speed, vy * speed
    watts: float = kernel(row, parameters, body, wheels, account, per_wheel)
    row[_VX], row[_VY] = vx, vy
    if broken_limit(account, limits, 1.0) >= 0:
        return np.inf
    if objective == 1:
        return 1.0 / speed
    return watts / speed


@njit(
    types.float64(KERNEL, _F1, _F1, _F2, _F1, _F1, types.int64, _F1, _F2),
    cache=True,
    error_model="numpy",
)
def _best_cost(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    row: Any,
    limits: Any,
    objective: int,
    account: Any,
    per_wheel: Any,
) -> float:
    """Least cost per metre along the surface over all speeds; the fastest one is bisected."""
    best, fastest, refused = np.inf, 0.0, 0.0
    for k in range(SPEEDS, 0, -1):
        speed = limits[0] * k / SPEEDS
        cost = _cost_at_speed(
            kernel, parameters, body, wheels, row, limits, speed, objective, account, per_wheel
        )
        best = min(best, cost)
        if cost == np.inf and fastest == 0.0:
            refused = speed
        elif fastest == 0.0:
            fastest = speed
    if fastest > 0.0 and refused > 0.0:
        for _ in range(4):
            speed = 0.5 * (fastest + refused)
            cost = _cost_at_speed(
                kernel, parameters, body, wheels, row, limits, speed, objective, account, per_wheel
            )
            best = min(best, cost)
            if cost == np.inf:
                refused = speed
            else:
                fastest = speed
    return best


@njit(
    types.float64(
        *(KERNEL, _F1, _F1, _F2, _F1, _F1, types.int64, _F1, _F2),
        *(types.float64, types.float64, types.float64),
    ),
    cache=True,
    error_model="numpy",
)
def _dissipated(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    row: Any,
    limits: Any,
    objective: int,
    account: Any,
    per_wheel: Any,
    along: float,
    across: float,
    yaw: float,
) -> float:
    """Least cost per horizontal metre on a slope, for energy less what climbing stores."""
    stretch = set_motion(row, along, across, yaw, 0.0, 1.0)
    cost: float = _best_cost(
        kernel, parameters, body, wheels, row, limits, objective, account, per_wheel
    )
    cost *= stretch
    if objective == 0:
        cost = max(cost - limits[4] * STANDARD_GRAVITY * along, 1e-3)
    return cost


@njit(
    types.void(
        *(KERNEL, _F1, _F1, _F2, _F1, _F1, types.int64, _F1, _F2),
        *(types.float64, types.float64, types.float64, types.float64, types.float64),
        _F1,
    ),
    cache=True,
    error_model="numpy",
)
def _leaning(
    kernel: Any,
    parameters: Any,
    body: Any,
    wheels: Any,
    row: Any,
    limits: Any,
    objective: int,
    account: Any,
    per_wheel: Any,
    along: float,
    across: float,
    yaw: float,
    still: float,
    lean: float,
    best: Any,
) -> None:
    """Write the least cost and its angle: ``yaw``, or one near ``still`` where there is a lean."""
    best[0], best[1] = np.inf, yaw
    for n in range(-1, len(LEANS) if lean > 0.0 else 0):
        turned = still + LEANS[n] * lean if n >= 0 else yaw
        if n >= 0 and turned == yaw:
            continue
        found = _dissipated(
            kernel,
            parameters,
            body,
            wheels,
            row,
            limits,
            objective,
            account,
            per_wheel,
            along,
            across,
            turned,
        )
        if found < best[0]:
            best[0], best[1] = found, turned


@njit(
    types.void(KERNEL, _F1, _F1, _F2, _F2, _F1, types.int64, _F2, _F4, _F3, _F4),
    cache=True,
    error_model="numpy",
    nogil=True,
)
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
    lean: Any,
) -> None:
    account = np.empty(ACCOUNT_LENGTH)
    per_wheel = np.empty((wheels.shape[0], _WHEEL_COLUMNS))
    best = np.empty(2)
    crawl = limits[0] / SPEEDS
    for c in range(by_yaw.shape[0]):
        row = class_rows[c].copy()
        for t in range(YAWS):
            yaw = 2.0 * math.pi * t / YAWS
            for f in range(DIRECTIONS):
                azimuth = 2.0 * math.pi * f / DIRECTIONS
                px, py = math.cos(azimuth), math.sin(azimuth)
                low, high = 0.0, limits[5]
                for _ in range(14):
                    middle = 0.5 * (low + high)
                    set_motion(row, px * middle, py * middle, yaw, 0.0, crawl)
                    kernel(row, parameters, body, wheels, account, per_wheel)
                    if broken_limit(account, limits, 1.0) >= 0:
                        high = middle
                    else:
                        low = middle
                set_motion(row, 0.0, 0.0, yaw, 0.0, crawl)
                kernel(row, parameters, body, wheels, account, per_wheel)
                level = broken_limit(account, limits, 1.0) < 0
                yaw_limit[c, t, f] = low if level else -1.0
                for s in range(STEEPNESSES):
                    # Just inside the limit, where the speed is not yet squeezed to a crawl.
                    steepness = low * (1.0 - 1e-3) * s / (STEEPNESSES - 1)
                    along, across = steepness * px, steepness * py
                    lean[c, t, f, s] = 0.0
                    if not level:
                        by_yaw[c, t, f, s] = np.inf
                        continue
                    if objective == 2:
                        by_yaw[c, t, f, s] = math.sqrt(1.0 + along * along)
                        continue
                    _leaning(
                        kernel,
                        parameters,
                        body,
                        wheels,
                        row,
                        limits,
                        objective,
                        account,
                        per_wheel,
                        along,
                        across,
                        yaw,
                        still[t, 0],
                        still[t, 1] if objective == 0 else 0.0,
                        best,
                    )
                    by_yaw[c, t, f, s], lean[c, t, f, s] = best[0], best[1] - yaw


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
                order[c, f, s] = np.argsort(cost)
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
    """The angle at which a roller stands in every bin, and how far off it it creeps at full speed.

    (YAWS, 2) rad; the second is 0 where none stands.
    """
    width = 2.0 * math.pi / YAWS
    found = np.zeros((YAWS, 2))
    for ahead, aside in model.wheels[:, ROLLER : ROLLER + 2]:
        lean = CREEP * SLIDING_SPEED / (math.hypot(ahead, aside) * model.vehicle.limits.speed)
        # A lean is to stay within its bin.
        if lean > 0.25 * width:
            continue
        for yaw in math.atan2(ahead, aside) + math.pi * np.arange(2):
            t = round(yaw / width)
            off = yaw - t * width
            # To the last bit the bin's own angle, where it is meant to be that.
            angle = t % YAWS * width + (off if abs(off) > 1e-9 else 0.0)
            found[t % YAWS] = angle, max(lean, found[t % YAWS, 1])
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
    lean = np.empty_like(by_yaw)
    _fill(
        model.kernel,
        model.parameters,
        model.body,
        model.wheels,
        np.ascontiguousarray(class_rows, dtype=float),
        limit_values(model, float(class_rows[0, INDEX["payload"]])),
        OBJECTIVES[objective],
        _still(model),
        by_yaw,
        yaw_limit,
        lean,
    )
    best = np.empty((classes, DIRECTIONS, STEEPNESSES))
    limit = np.empty((classes, DIRECTIONS))
    order = np.empty((*best.shape, YAWS), np.uint8)
    _minimise_over_yaw(by_yaw, yaw_limit, best, limit, order)
    reach = max(float(limit.min()), 1e-9)
    gentle = _gentle(best, limit, reach)
    return SteadyCosts(by_yaw, yaw_limit, lean, best, limit, gentle, order, reach)
