"""Attempts to break the certified bound: states, routes, grids, and limits where it is known."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest

import planner.search.lower_bound as lower_bound_module
from planner import plan_route
from planner.errors import Cancelled
from planner.power.model import PowerModel
from planner.power.vehicle import load_vehicle
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.bound import lower_bound
from planner.search.conditions import Circumstances
from planner.search.driving_ground import driving_ground
from planner.search.edge_energy import sample_surface
from planner.search.force_prices import best_prices, milder
from planner.search.ground import CostField
from planner.search.lower_bound import certify
from planner.search.motion_row import set_acceleration, set_motion
from planner.search.potential import levelled, steepest_potential, weights_at
from planner.search.price_table import PriceField, even_table, even_watts, table_watts
from planner.search.priced_power import PricedPower, priced_power, rotor_share, slower_power
from planner.search.ramps import PARTS
from planner.search.tabulate import steady_costs
from planner.search.triangle_costs import cell_ranges
from planner.terrain.heightmap import Terrain
from planner.terrain.interpolation import interpolate_many
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

    def paid(self, around: Circumstances, priced: PricedPower, mu: float, nu: float) -> np.ndarray:
        """W that the forces of slope and acceleration are paid at the prices along and across."""
        weight = around.mass * STANDARD_GRAVITY
        inertia = priced.moving * mu + priced.rotors * float(
            rotor_share(np.array(mu), priced.efficiency)
        )
        sideways = (priced.moving + priced.efficiency * priced.rotors) * nu
        lifted = mu * self.along + nu * self.across / (self.normal * self.stretch)
        paid = weight * self.speed * lifted / self.stretch
        return paid + self.speed * (inertia * self.a + sideways / self.stretch * self.b)


def random_states(around: Circumstances, share: np.ndarray, rng: np.random.Generator) -> States:
    """Any slope, yaw, yaw rate and acceleration, at the given shares of full speed (n,)."""
    count = len(share)
    rows = np.repeat(around.class_rows[:1], count, axis=0)
    rate, most = float(around.limits[6]), around.model.vehicle.limits.acceleration
    speed = float(around.limits[0]) * share
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
    bus = around.model.account(rows)["bus"]
    return States(rows, speed, along, across, a, b, stretch, np.sqrt(1.0 + steep**2), bus)


@pytest.mark.parametrize("payload", [0.0, 5.0])
@pytest.mark.parametrize("name", VEHICLES)
def test_no_state_undercuts_the_priced_power(name: str, payload: float) -> None:
    """Any slope, speed, yaw rate and acceleration: the power covers all forces at their prices.

    With prices μ along and ν across, power is at least the table's, plus what the forces of slope
    and acceleration are paid: m·g·ż and kinetic energy at μ, those across at ν.
    """
    around, priced = priced_of(name, payload)
    table = even_table(priced)
    at_rest = table._replace(watts=np.repeat(table.standing[..., None], 2, axis=2))
    rng = np.random.default_rng(5)
    share = np.where(rng.random(6000) < 0.5, 1.0, rng.uniform(0.002, 1.0, 6000))
    states = random_states(around, share, rng)
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
                [table_watts(t, mu, nu / s, f) for s, f in zip(states.stretch, factor, strict=True)]
            )
            for t in (table, at_rest)
        )
        floor = share * full + (1.0 - share) * standing
        left = states.bus - states.paid(around, priced, mu, nu) - floor
        worst = min(worst, float(left.min()))
    assert worst > -1e-9
    assert worst < 4.0


@pytest.mark.parametrize("name", VEHICLES)
def test_no_state_undercuts_the_power_below_full_speed(name: str) -> None:
    """At any speed between two parts of full speed, the straight line between their tables."""
    around, priced = priced_of(name, 2.0)
    slower = slower_power(priced, PARTS, turns=60)
    table = even_table(priced)
    parts = np.array(PARTS)
    rng = np.random.default_rng(11)
    share = parts[-1] * rng.uniform(0.001, 1.0, 6000)
    states = random_states(around, share, rng)
    factor = states.rows[:, INDEX["rolling_factor"]] / states.normal
    k = np.searchsorted(parts, share) - 1
    w = (share - parts[k]) / (parts[k + 1] - parts[k])
    tables = [
        table._replace(watts=even_watts(priced, slower.shares, slower.cross, watts))
        for watts in slower.watts
    ]
    worst = math.inf
    for mu, nu in zip(rng.uniform(0.5, 2.1, 16), rng.uniform(-0.3, 0.3, 16), strict=True):
        nu *= rng.random() < 0.7
        at = zip(k, w, nu / states.stretch, factor, strict=True)
        floor = np.array(
            [
                (1.0 - u) * table_watts(tables[n], mu, c, f)
                + u * table_watts(tables[n + 1], mu, c, f)
                for n, u, c, f in at
            ]
        )
        left = states.bus - states.paid(around, priced, mu, nu) - floor
        worst = min(worst, float(left.min()))
    assert worst > -1e-9
    assert worst < 4.0


def test_one_load_is_looked_at_only_where_more_never_takes_less() -> None:
    """Near rest friction may hold the robot: there the heavier load can be the cheaper one."""
    tables = lower_bound_module._tables_of(around_of(model_of("minibalance")), STEEPEST, False)
    assert tables is not None
    assert (tables.slower[..., 1] < tables.slower[..., 0]).any()
    assert not tables.full.heavier


def test_prices_are_of_the_table_on_any_slope() -> None:
    """Also where both slopes are the steepest, which is beyond what can be driven."""
    _, priced = priced_of("minibalance", 0.0)
    best = best_prices(even_table(priced), STEEPEST)
    shares, across = best.table[..., 0], best.table[..., 1]
    assert (shares >= priced.shares[0]).all()
    assert (shares <= priced.shares[-1]).all()
    assert (np.abs(across) <= priced.cross[-1] + 1e-12).all()
    # The steeper the climb, the dearer is force along it.
    assert (np.diff(shares[len(shares) // 2 :], axis=0) >= -1e-9).all()


def test_prices_get_milder_round_a_single_bad_cell() -> None:
    """On fine cells as well: one ledge between racks must not leave the quick floor alone."""
    _, priced = priced_of("minibalance", 0.0)
    table, best = even_table(priced), best_prices(even_table(priced), STEEPEST)
    even = np.full((121, 121), 1.3)
    none = np.zeros_like(even)
    bad = np.zeros((120, 120), bool)
    bad[60, 60] = True
    for cell in (1.0, 0.25, 0.1):
        before = PriceField(even, even, none, none)
        after = milder(table, before, bad, best.level, (cell, cell)).share - 1.0
        assert after[60:62, 60:62].max() < 0.75 * 0.3
        assert after[0, 0] == pytest.approx(0.3, abs=1e-3)
        # Prices change slowly: where they fall fast, the robot's own motion pays for driving.
        steepest = np.hypot(*np.gradient(after, cell)).max()
        assert 0.5 * table.moving * table.speed**2 * steepest < 0.5 * best.level


def field_of(ground: Terrain, model: PowerModel) -> tuple[CostField, Circumstances]:
    around = around_of(model)
    costs = steady_costs(around.model, around.class_rows)
    return driving_ground(ground, model.vehicle).field(costs), around


def test_slopes_and_heights_of_a_cell_stay_in_their_range() -> None:
    """Bernstein coefficients against the surface itself, at random points of rough ground."""
    rng = np.random.default_rng(8)
    heights = rng.normal(0.0, 0.3, (12, 14))
    ranges = cell_ranges(heights, 0.5, 0.7)
    x, y = rng.uniform(1.0, 12.0, 4000), rng.uniform(1.0, 10.0, 4000)
    z, px, py = interpolate_many(heights, 0.0, 0.0, 0.5, 0.7, 0.5 * x, 0.7 * y)
    cell = ranges[np.floor(y).astype(int) - 1, np.floor(x).astype(int) - 1]
    for value, low, high in ((px, 0, 1), (py, 2, 3), (z, 4, 5)):
        assert (value >= cell[:, low] - 1e-12).all()
        assert (value <= cell[:, high] + 1e-12).all()


def test_level_ground_is_bounded_by_the_cost_of_steady_driving() -> None:
    """On a plane the best motion is known: straight, at full speed, with both ramps."""
    model = model_of("minibalance")
    ground = terrain(np.zeros((40, 80)), cell=0.5)
    field, around = field_of(ground, model)
    steady = float(field.best.min(axis=(0, 1))[0])
    found = certify(field, around, (4.0, 10.0), (36.0, 10.0), seconds=600.0)
    assert found.how == "potential"
    assert 0.95 * 32.0 * steady < found.bound_j < 32.0 * steady + 1.0


def test_potential_in_an_even_cost_is_distance() -> None:
    """With |∇ψ| ≤ 1 everywhere the steepest potential falls by the distance, straight or across."""
    angle = 2.0 * math.pi * np.arange(48) / 48
    costs = np.broadcast_to(np.ones_like(angle), (30, 40, 2, 48)).copy()
    cell = (0.5, 0.25)
    ends = [weights_at(p, (0.0, 0.0), cell, (31, 41)) for p in ((2.0, 1.0), (17.0, 6.0))]
    found = []

    def more(psi: np.ndarray) -> bool:
        top, bottom = (sum(w * psi[n] for n, w in zip(*e, strict=True)) for e in ends)
        found.append(levelled(psi, costs, cell, top, bottom))
        return len(found) < 15

    steepest_potential(costs, np.zeros((31, 41)), cell, *ends, more=more)
    distance = math.hypot(15.0, 5.0)
    # 48 directions let a slope exceed 1 by a part in 470 between two of them.
    assert 0.99 * distance < max(found) <= 1.0022 * distance


def test_a_wall_lengthens_the_potential() -> None:
    """Where the straight way is shut, the potential falls by the way round."""
    costs = np.ones((40, 40, 2, 48))
    costs[5:40, 20] = np.inf
    ends = [weights_at(p, (0.0, 0.0), (1.0, 1.0), (41, 41)) for p in ((10.0, 20.0), (31.0, 20.0))]
    found = []

    def more(psi: np.ndarray) -> bool:
        top, bottom = (sum(w * psi[n] for n, w in zip(*e, strict=True)) for e in ends)
        found.append(levelled(psi, costs, (1.0, 1.0), top, bottom))
        return len(found) < 40

    steepest_potential(costs, np.zeros((41, 41)), (1.0, 1.0), *ends, more=more)
    round_it = math.hypot(10.0, 15.0) + 1.0 + math.hypot(10.0, 15.0)
    assert 0.97 * round_it < max(found) <= 1.0022 * round_it


@pytest.mark.parametrize("seconds", [2.0, 12.0])
@pytest.mark.parametrize("kind", ["hills", "rough", "tiny"])
def test_no_motion_at_random_undercuts_the_bound(kind: str, seconds: float) -> None:
    """Hundreds of motions at random speeds, yaw and accelerations, on the best routes and off."""
    heights = {
        "hills": hills(56, rms_degrees=5.0),
        "rough": hills(40, rms_degrees=7.0, seed=5),
        "tiny": hills(20, rms_degrees=4.0, seed=9),
    }[kind]
    ground = terrain(heights)
    model = model_of("minibalance")
    field, around = field_of(ground, model)
    far = 0.25 * len(heights) - 1.2
    start, goal = (1.2, 1.4), (far, far - 0.3)
    found = certify(field, around, start, goal, seconds=seconds)
    answer = plan_route(
        terrain=ground,
        model=model,
        start={"x": start[0], "y": start[1]},
        goal={"x": goal[0], "y": goal[1]},
        planner="grid",
    )
    assert answer.status == "ok", answer.reason
    routes = [answer.routes[0], *(b.route for b in answer.baselines.values())]
    paths = [np.column_stack([r.arrays["x"], r.arrays["y"]]) for r in routes]
    paths.append(np.array([start, goal]))
    least = min(r.energy_j for r in routes)
    assert found.bound_j < least
    assert found.bound_j < energies(field, around, paths, 60, seed=3).min()
    z, _ = sample_surface(field, np.array([start, goal]))
    quick = lower_bound(around, math.dist(start, goal), z[1] - z[0], float(field.limit.max()))
    assert found.bound_j >= quick


def test_a_coarse_grid_bounds_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several cells in one triangle: a lower bound again, and no better than the fine one."""
    field, around = field_of(terrain(hills(56, rms_degrees=4.0)), model_of("minibalance"))
    start, goal = (1.2, 1.4), (12.5, 12.0)
    fine = certify(field, around, start, goal, seconds=4.9)
    monkeypatch.setattr("planner.search.lower_bound.NODES", {True: 500, False: 500})
    coarse = certify(field, around, start, goal, seconds=4.9)
    path = np.array([start, goal])
    assert coarse.bound_j < energies(field, around, [path], 40, seed=2).min()
    assert coarse.bound_j < 1.05 * fine.bound_j


def test_what_the_bound_cannot_follow_gets_the_floor() -> None:
    """Wind, printed models and effects with unknown formulas fall back to the quick bound."""
    vehicle = load_vehicle("minibalance")
    ground = terrain(np.zeros((24, 24)))
    worn = PowerModel.from_vehicle(vehicle, effects=[*vehicle.active, "wheel_preload"])
    for place, (effect, *_) in enumerate(worn.slots):
        if effect.slug == "wheel_preload":
            worn = worn.with_parameter(place, 2.0)
            break
    models = [PowerModel.from_vehicle(vehicle, kind="printed/B"), worn]
    for model in models:
        field, around = field_of(ground, model)
        found = certify(field, around, (1.5, 1.5), (4.0, 4.0), seconds=2.0)
        assert found.how == "floor"
        quick = lower_bound(around, math.hypot(2.5, 2.5), 0.0, float(field.limit.max()))
        assert found.bound_j == pytest.approx(quick)


def test_cancelling_stops_it() -> None:
    field, around = field_of(terrain(np.zeros((24, 24))), model_of("minibalance"))
    with pytest.raises(Cancelled):
        certify(field, around, (1.5, 1.5), (4.0, 4.0), cancelled=lambda: True)
