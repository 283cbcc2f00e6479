"""No state of a robot takes less power than what is left once its forces are paid for."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

from planner.power.motion_row import set_acceleration, set_motion
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.certificate.dual_power import PricedPower, rotor_share, slower_power
from planner.search.certificate.price_table import even_table, even_watts, table_watts
from planner.search.certificate.start_and_stop import SPEED_PARTS
from planner.search.conditions import OperatingConditions
from tests.search.certificate.robots import STEEPEST, priced_of

VEHICLES = ("minibalance", "robotino", "four omni wheels")


class States(NamedTuple):
    """Random states: rows of the model, what drives them, and their power; arrays (n,)."""

    rows: np.ndarray
    speed: np.ndarray
    along: np.ndarray
    across: np.ndarray
    a: np.ndarray
    b: np.ndarray
    stretch: np.ndarray
    normal: np.ndarray
    bus: np.ndarray

    def paid(
        self, conditions: OperatingConditions, priced: PricedPower, mu: float, nu: float
    ) -> np.ndarray:
        """W that the forces of slope and acceleration are paid at the prices along and across."""
        weight = conditions.mass * STANDARD_GRAVITY
        robot = priced.robot
        rotors = float(rotor_share(np.array(mu), robot.efficiency))
        inertia = robot.moving * mu + robot.rotors * rotors
        sideways = (robot.moving + robot.efficiency * robot.rotors) * nu
        lifted = mu * self.along + nu * self.across / (self.normal * self.stretch)
        paid = weight * self.speed * lifted / self.stretch
        return paid + self.speed * (inertia * self.a + sideways / self.stretch * self.b)


def random_states(
    conditions: OperatingConditions, share: np.ndarray, rng: np.random.Generator
) -> States:
    """Any slope, yaw, yaw rate and acceleration, at the given shares of full speed (n,)."""
    count = len(share)
    rows = np.repeat(conditions.class_rows[:1], count, axis=0)
    rate, most = float(conditions.limits[6]), conditions.model.vehicle.limits.acceleration
    speed = float(conditions.limits[0]) * share
    steep = STEEPEST * np.sqrt(rng.random(count))
    azimuth, yaw = rng.uniform(-math.pi, math.pi, (2, count))
    special = rng.random(count) < 0.6
    yaw[special] = rng.integers(0, 24, special.sum()) * math.pi / 12
    yaw += rng.normal(0.0, 0.01, count) * (rng.random(count) < 0.5)
    along, across = steep * np.cos(azimuth), steep * np.sin(azimuth)
    a, b = most * rng.uniform(-1.0, 1.0, count), 1.1 * most * rng.uniform(-1.0, 1.0, count)
    a *= rng.random(count) < 0.7
    b *= rng.random(count) < 0.7
    stretch = np.empty(count)
    for k, row in enumerate(rows):
        # Travel along x: the slope's components are those along and across.
        stretch[k] = set_motion(row, along[k], across[k], yaw[k], 0.0, speed[k])
        set_acceleration(row, a[k], b[k], row[INDEX["vx"]], row[INDEX["vy"]], speed[k])
    rows[:, INDEX["wz"]] = rate * rng.choice([0.0, 0.0, 1.0, -1.0, 0.3, -0.1], count)
    bus = conditions.model.account(rows)["bus"]
    return States(rows, speed, along, across, a, b, stretch, np.sqrt(1.0 + steep**2), bus)


@pytest.mark.parametrize("payload", [0.0, 5.0])
@pytest.mark.parametrize("name", VEHICLES)
def test_no_state_undercuts_the_priced_power(name: str, payload: float) -> None:
    """Any slope, speed, yaw rate and acceleration: the power covers all forces at their prices.

    With prices μ along and ν across, power is at least the table's, plus what the forces of slope
    and acceleration are paid: m·g·ż and kinetic energy at μ, those across at ν.
    """
    conditions, priced = priced_of(name, payload)
    table = even_table(priced)
    at_rest = np.repeat(table.standing[..., None], 2, axis=2)
    rng = np.random.default_rng(5)
    share = np.where(rng.random(6000) < 0.5, 1.0, rng.uniform(0.002, 1.0, 6000))
    states = random_states(conditions, share, rng)
    factor = states.rows[:, INDEX["rolling_factor"]] / states.normal
    worst = math.inf
    for mu, nu in zip(
        rng.uniform(priced.shares[0], priced.shares[-1], 24),
        rng.uniform(-0.3, 0.3, 24),
        strict=True,
    ):
        nu *= rng.random() < 0.7
        full, standing = (
            np.array(
                [
                    table_watts(table, watts, mu, nu / s, f)
                    for s, f in zip(states.stretch, factor, strict=True)
                ]
            )
            for watts in (table.watts, at_rest)
        )
        floor = share * full + (1.0 - share) * standing
        left = states.bus - states.paid(conditions, priced, mu, nu) - floor
        worst = min(worst, float(left.min()))
    assert worst > -1e-9
    assert worst < 4.0


@pytest.mark.parametrize("name", VEHICLES)
def test_no_state_undercuts_the_power_below_full_speed(name: str) -> None:
    """At any speed between two parts of full speed, the straight line between their tables."""
    conditions, priced = priced_of(name, 2.0)
    slower = slower_power(priced, SPEED_PARTS, turns=60)
    table = even_table(priced)
    parts = np.array(SPEED_PARTS)
    rng = np.random.default_rng(11)
    share = parts[-1] * rng.uniform(0.001, 1.0, 6000)
    states = random_states(conditions, share, rng)
    factor = states.rows[:, INDEX["rolling_factor"]] / states.normal
    k = np.searchsorted(parts, share) - 1
    w = (share - parts[k]) / (parts[k + 1] - parts[k])
    tables = [even_watts(priced, slower.shares, slower.cross, watts) for watts in slower.watts]
    worst = math.inf
    for mu, nu in zip(rng.uniform(0.5, 2.1, 16), rng.uniform(-0.3, 0.3, 16), strict=True):
        nu *= rng.random() < 0.7
        at = zip(k, w, nu / states.stretch, factor, strict=True)
        floor = np.array(
            [
                (1.0 - u) * table_watts(table, tables[n], mu, c, f)
                + u * table_watts(table, tables[n + 1], mu, c, f)
                for n, u, c, f in at
            ]
        )
        left = states.bus - states.paid(conditions, priced, mu, nu) - floor
        worst = min(worst, float(left.min()))
    assert worst > -1e-9
    assert worst < 4.0
