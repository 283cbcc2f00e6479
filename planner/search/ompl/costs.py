"""Costs of straight motions between two states, in the plane or with the yaw.

    costs = costs_of(run, "energy", poses=False)
    costs.between((2.0, 2.0), (3.0, 2.0))                      # J
    costs = costs_of(run, "energy", poses=True)
    costs.between((2.0, 2.0, 0.0), (3.0, 2.0, 0.5))            # J, turning included

In the plane the yaw is eliminated: at every point the free yaw that costs least counts. With the
yaw, place and yaw change evenly along a motion, the yaw by the shorter way. Metres cost what the
tables of planner.search.steady say for the body's angle to the travel. Turning costs what it takes
on the spot; on the move as much without the electronics, which metres pay already.

OMPL's callbacks read these numbers. They know no object of OMPL's: reference cycles through its
objects never end.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from planner.compiled_code import njit
from planner.quantities import INDEX
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, passable, segment_cost, wind_cost
from planner.search.resolution import ALL_YAWS, DIRECTIONS, LEAST_COST, MARGIN, YAWS
from planner.search.run import Run
from planner.search.steady import polar
from planner.terrain.footprint import body_fits
from planner.terrain.interpolation import interpolate

State = tuple[float, ...]
"""(x, y) in m, or (x, y, yaw) in m and rad."""
RADIANS = 0.2
"""rad of turning between two points of a motion at which it is priced, at most."""
SLACK = 1.03
"""Share of the steady slope limit up to which a motion is feasible: the tables of that limit are
so coarse, and every trajectory that keeps all limits has to be valid."""


class TurningRates(NamedTuple):
    """Cost of a radian on the spot at full rate, and of one while the robot drives."""

    on_the_spot: float
    on_the_move: float


class MotionCosts(NamedTuple):
    """What a straight motion costs.

    Attributes:
        field: map and costs.
        cheapest: cost of the cheapest metre there is.
        turning: None in the plane.
    """

    field: CostField
    cheapest: float
    turning: TurningRates | None

    @property
    def poses(self) -> bool:
        """Whether states have a yaw."""
        return self.turning is not None

    def between(self, a: State, b: State) -> float:
        """Cost of the straight motion; infinity where it is infeasible."""
        if self.turning is None:
            return float(segment_cost(self.field, a[0], a[1], b[0], b[1], self.field.step))
        (xa, ya, yaw_a), (xb, yb, yaw_b) = a, b
        return float(pose_cost(self.field, self.turning, (xa, ya, yaw_a), (xb, yb, yaw_b)))

    def bound(self, a: State, b: State) -> float:
        """A cost that no motion undercuts."""
        return self.cheapest * math.dist(a[:2], b[:2])

    def feasible(self, state: State) -> bool:
        """Whether the robot can be there."""
        if self.turning is None:
            turns = (2.0 * math.pi * k / DIRECTIONS for k in range(DIRECTIONS))
            return any(passable(self.field, state[0], state[1], turn) for turn in turns)
        return bool(pose_feasible(self.field, state[0], state[1], state[2]))


def costs_of(run: Run, objective: str, poses: bool) -> MotionCosts:
    """The costs for a request's objective: "energy" in J, "time" in s or "length" in m."""
    field = run.field(objective, MARGIN)
    cheapest = run.situation.lattice(objective, field).cheapest
    return MotionCosts(field, cheapest, turning_rates(run.conditions, objective) if poses else None)


def turning_rates(conditions: OperatingConditions, objective: str) -> TurningRates:
    """Costs of turning, on level ground."""
    rate = conditions.model.vehicle.limits.yaw_rate
    if objective == "length":
        return TurningRates(0.0, 0.0)
    if objective == "time":
        return TurningRates(1.0 / rate, 0.0)
    rows = np.repeat(conditions.class_rows[:1], 2, axis=0)
    rows[1, INDEX["wz"]] = rate
    still, turning = (float(watts) for watts in conditions.model.watts(rows))
    return TurningRates(turning / rate, (turning - still) / rate)


@njit(cache=True, error_model="numpy")
def pose_feasible(field: Any, x: float, y: float, yaw: float) -> bool:
    """Whether the body fits at a pose and its slope can be stood on."""
    ny, nx = field.heights.shape
    i = min(max(int(math.floor((x - field.x0) / field.dx + 0.5)), 0), nx - 1)
    j = min(max(int(math.floor((y - field.y0) / field.dy + 0.5)), 0), ny - 1)
    if field.mask[j, i] != ALL_YAWS and not body_fits(field, x, y, yaw):
        return False
    _, px, py = interpolate(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
    return bool(px * px + py * py < field.limit.max() ** 2)


@njit(cache=True, error_model="numpy")
def _metre(field: Any, place: Any, node: Any, yaw: float, direction: float, slack: float) -> float:
    """Cost of a metre at a place with a yaw; infinity beyond ``slack`` times the slope limit."""
    (x, y), (j, i) = place, node
    _, px, py = interpolate(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
    steepness = math.sqrt(px * px + py * py)
    azimuth = math.atan2(py, px) - direction
    a = (yaw - direction) / (2.0 * math.pi) * YAWS
    a -= YAWS * math.floor(a / YAWS)
    t = int(a) % YAWS
    share = a - int(a)
    ground = field.ground[j, i]
    cost, weights = 0.0, 0.0
    for at, weight in ((t, 1.0 - share), ((t + 1) % YAWS, share)):
        by_yaw, yaw_limit = field.by_yaw[ground, at], field.yaw_limit[ground, at]
        own = polar(by_yaw, yaw_limit, azimuth, steepness, slack)
        # Between an angle at which the slope can be climbed and one at which it cannot, the
        # feasible one counts.
        if weight > 0.0 and own < np.inf:
            cost += weight * own
            weights += weight
    return cost / weights if weights > 0.0 else np.inf


@njit(cache=True, error_model="numpy")
def pose_cost(
    field: Any, turning: Any, a: tuple[float, float, float], b: tuple[float, float, float]
) -> float:
    """Cost between two poses by the midpoint rule; infinity where a limit is broken."""
    ny, nx = field.heights.shape
    (xa, ya, yaw_a), (xb, yb, yaw_b) = a, b
    ex, ey = xb - xa, yb - ya
    length = math.sqrt(ex * ex + ey * ey)
    turn = yaw_b - yaw_a
    turn -= 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))
    on_the_spot = length < 1e-9
    count = max(1, int(math.ceil(length / field.step)), int(abs(turn) / RADIANS))
    direction = math.atan2(ey, ex)
    wind = 0.0 if on_the_spot else wind_cost(field, direction)
    total = 0.0
    for k in range(count):
        w = (k + 0.5) / count
        x, y, yaw = xa + w * ex, ya + w * ey, yaw_a + w * turn
        i = min(max(int(math.floor((x - field.x0) / field.dx + 0.5)), 0), nx - 1)
        j = min(max(int(math.floor((y - field.y0) / field.dy + 0.5)), 0), ny - 1)
        if field.mask[j, i] != ALL_YAWS and not body_fits(field, x, y, yaw):
            return np.inf
        if not on_the_spot:
            cost = _metre(field, (x, y), (j, i), yaw, direction, SLACK)
            if field.factor.shape[0] > 1:
                cost *= field.factor[j, i]
            total += max(cost + wind, LEAST_COST)
    rate = turning.on_the_spot if on_the_spot else turning.on_the_move
    joules: float = total * length / count + abs(turn) * rate
    return joules
