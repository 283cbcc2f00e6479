"""Attempts to break the certified bound: states, routes, grids, and limits where it is known."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from planner import plan_route
from planner.power.model import PowerModel
from planner.power.vehicle import load_vehicle
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.bound import lower_bound
from planner.search.conditions import Circumstances
from planner.search.edge_energy import sample_surface
from planner.search.ground import CostField, driving_ground
from planner.search.lower_bound import certify
from planner.search.potential import levelled, steepest_potential, weights_at
from planner.search.priced_power import PricedPower, priced_power, rotor_share
from planner.search.steady import set_acceleration, set_motion, steady_costs
from planner.search.triangle_costs import cell_ranges, even_table, table_watts
from planner.terrain.heightmap import Terrain
from planner.terrain.interpolation import interpolate_many
from tests.power.states import changed
from tests.search.maps import hills, terrain
from tests.search.random_motions import energies
from tests.search.test_bound import around_of, model_of

STEEPEST = 0.3
VEHICLES = ("minibalance", "robotino", "four omni wheels")


@lru_cache
def priced_of(name: str, payload: float) -> tuple[Circumstances, PricedPower]:
    around = around_of(model_of(name), payload)
    priced = priced_power(around, STEEPEST, turns=60)
    assert priced is not None
    return around, priced


@pytest.mark.parametrize("payload", [0.0, 5.0])
@pytest.mark.parametrize("name", VEHICLES)
def test_no_state_undercuts_the_priced_power(name: str, payload: float) -> None:
    """Any slope, speed, yaw rate and acceleration: the power covers all forces at their prices.

    With prices μ along and ν across, power is at least the table's, plus what the forces of slope
    and acceleration are paid: m·g·ż and kinetic energy at μ, those across at ν.
    """
    around, priced = priced_of(name, payload)
    table = even_table(priced)
    rng = np.random.default_rng(5)
    count = 6000
    rows = np.repeat(around.class_rows[:1], count, axis=0)
    top, rate = float(around.limits[0]), float(around.limits[6])
    most = around.model.vehicle.limits.acceleration
    speed = top * np.where(rng.random(count) < 0.5, 1.0, rng.uniform(0.002, 1.0, count))
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
    account = around.model.account(rows)
    normal = np.sqrt(1.0 + steep**2)
    weight = around.mass * STANDARD_GRAVITY
    worst = math.inf
    for mu, nu in zip(
        rng.uniform(priced.shares[0], priced.shares[-1], 24), rng.uniform(-0.3, 0.3, 24),
        strict=True,
    ):
        nu *= rng.random() < 0.7
        share = speed / top
        factor = rows[:, INDEX["rolling_factor"]] / normal
        full = np.array(
            [table_watts(table, mu, nu / s, f) for s, f in zip(stretch, factor, strict=True)]
        )
        standing = float(priced.standing.min())
        floor = share * full + (1.0 - share) * standing
        rotor = float(rotor_share(np.array(mu), priced.efficiency))
        inertia = priced.moving * mu + priced.rotors * rotor
        sideways = (priced.moving + priced.efficiency * priced.rotors) * nu
        paid = weight * speed * (mu * along + nu * across / (normal * stretch)) / stretch
        paid += speed * (inertia * a + sideways / stretch * b)
        worst = min(worst, float((account["bus"] - paid - floor).min()))
    assert worst > -1e-9
    assert worst < 4.0
