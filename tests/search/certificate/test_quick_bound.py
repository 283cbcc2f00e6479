"""The bound against everything the power model can do: random states, and routes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.power.motion_row import set_motion, set_wind
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.certificate.quick_bound import floor_per_metre, lower_bound
from planner.search.conditions import OperatingConditions
from planner.terrain.heightmap import Terrain
from tests.power.states import changed
from tests.search.certificate.robots import around_of, model_of, windy
from tests.search.maps import hills, terrain

WIND = {"x": 3.0, "y": 2.0}
VEHICLES = ("minibalance", "robotino", "four omni wheels", "steep rollers", "no limits")
VEHICLES += ("giving rollers",)


def random_states(conditions: OperatingConditions, count: int, steepest: float, seed: int):
    """Rows within the limits, metres along the surface for each horizontal one, and speeds."""
    rng = np.random.default_rng(seed)
    rows = np.repeat(conditions.class_rows[:1], count, axis=0)
    top = float(conditions.limits[0])
    speed = rng.uniform(0.025 * top, top, count)
    azimuth, yaw, direction = (rng.uniform(-math.pi, math.pi, count) for _ in range(3))
    steepness = np.tan(rng.uniform(0.0, math.atan(steepest), count))
    # Many of the motions along the body's axes and diagonals, where wheels or rollers stand still.
    special = rng.random(count) < 0.3
    yaw[special] = direction[special] + rng.integers(0, 24, special.sum()) * math.pi / 12
    stretch = np.empty(count)
    for k, row in enumerate(rows):
        slope = steepness[k] * math.cos(azimuth[k]), steepness[k] * math.sin(azimuth[k])
        stretch[k] = set_motion(row, *slope, yaw[k], direction[k], speed[k])
        set_wind(row, conditions.wind, yaw[k])
    rate = float(conditions.limits[6])
    rows[:, INDEX["wz"]] = rng.uniform(-rate, rate, count) * (rng.random(count) < 0.5)
    return rows, stretch, speed


def climbing(rows, mass: float):
    """W into height."""
    return -mass * (
        rows[:, INDEX["gravity_x"]] * rows[:, INDEX["vx"]]
        + rows[:, INDEX["gravity_y"]] * rows[:, INDEX["vy"]]
    )


@pytest.mark.parametrize("payload", [0.0, 5.0])
@pytest.mark.parametrize("name", VEHICLES)
def test_no_state_undercuts_the_floor(name: str, payload: float) -> None:
    """Random motions within the limits: dissipation per horizontal metre above the floor."""
    conditions = around_of(model_of(name), payload)
    steepest = math.tan(math.radians(18.0))
    floor = floor_per_metre(conditions, steepest)
    rows, stretch, speed = random_states(conditions, 10_000, steepest, seed=11)
    account = conditions.model.account(rows)
    assert account["least_load"].min() > 0.0
    # Bus power: a source that takes nothing back only adds to the losses.
    dissipated = (account["bus"] - climbing(rows, conditions.mass)) * stretch / speed
    assert dissipated.min() >= floor
    # A floor of nothing would pass as well.
    assert floor > 0.3 * dissipated.min() > 1.0


def test_floor_of_the_reference_robot_by_hand() -> None:
    """13.3 J/m by hand with even wheel loads and the yaw fixed, docs/physics.md."""
    conditions = around_of(model_of("minibalance"))
    assert 10.0 < floor_per_metre(conditions, math.tan(math.radians(20.0))) < 13.3


def test_wheel_drag_of_four_omni_wheels_by_hand() -> None:
    """No yaw helps a square of omni wheels: a metre costs Σ|sin|·(c_w + ...) at least.

    Along a wheel's axle two rims turn a metre each and the other two wheels' rollers as well:
    c_w·N·2 + c_r·N·2, with N a quarter of the weight. On the diagonal all turn 1/√2: the sum is
    4·(c_w + c_r)/√2·N, more. The electronics add 1 J/m at 1.2 m/s.
    """
    model = changed(
        model_of("four omni wheels"),
        electronics__power=1.2,
        coulomb_drag__coulomb_torque=0.0,
        gear_loss__efficiency=1.0,
    )
    model = replace(model, vehicle=replace(model.vehicle, com_height=0.0))
    floor = floor_per_metre(around_of(model), 0.0)
    by_hand = 1.0 + 2.0 * (0.035 + 0.045) * 12.0 * STANDARD_GRAVITY / 4.0
    # Less the margin between samples and what the smooth signs spare near rest.
    assert 0.98 * by_hand < floor < by_hand


def test_no_motion_gains_more_from_the_wind_than_the_bound_allows() -> None:
    """Every state in wind: the power above floor, climb and the wind's push on the way."""
    conditions = around_of(windy(), conditions={"wind": WIND})
    calm = around_of(windy())
    steepest = math.tan(math.radians(18.0))
    rows, stretch, speed = random_states(conditions, 10_000, steepest, seed=12)
    watts = conditions.model.account(rows)["bus"] - climbing(rows, conditions.mass)
    least = lower_bound(conditions, 1.0, 0.0, steepest)
    assert (watts * stretch / speed).min() >= least
    # The wind does push: some states do with less than in calm air they could.
    assert least < lower_bound(calm, 1.0, 0.0, steepest)
    rows[:, [INDEX["wind_x"], INDEX["wind_y"]]] = 0.0
    still = conditions.model.account(rows)["bus"] - climbing(rows, conditions.mass)
    assert (watts < still - 0.1).any()


def test_wind_leaves_the_bound_alone_where_the_air_does_not_act() -> None:
    model = model_of("minibalance")
    calm, wind = around_of(model), around_of(model, conditions={"wind": WIND})
    assert lower_bound(wind, 10.0, 1.0, 0.3) == lower_bound(calm, 10.0, 1.0, 0.3) > 0.0


def relief() -> Terrain:
    return terrain(hills(64, rms_degrees=5.0))


ROUTES = [
    *((name, mass, {}) for name in VEHICLES for mass in (0.0, 5.0)),
    ("windy", 0.0, {"wind": WIND}),
    ("windy", 0.0, {"wind": {"x": -3.0, "y": -2.0}}),
]


@pytest.mark.parametrize(("name", "payload", "conditions"), ROUTES)
def test_every_route_is_above_the_bound(name: str, payload: float, conditions: dict) -> None:
    """Routes across hills and over level ground, both ways, against the bound without a clip."""
    model = windy() if name == "windy" else model_of(name)
    at = around_of(model, payload, conditions=conditions)
    ends = {"x": 2.0, "y": 2.0}, {"x": 12.0, "y": 11.0}
    for ground in (relief(), terrain(np.zeros((64, 64)))):
        for start, goal in (ends, ends[::-1]):
            answer = plan_route(
                terrain=ground,
                model=model,
                start=start,
                goal=goal,
                payload={"mass": payload, "x": 0.02, "y": -0.01},
                conditions=conditions,
            )
            assert answer.status == "ok", answer.reason
            for route in (answer.routes[0], *(b.route for b in answer.baselines.values())):
                height = route.arrays["z"]
                climb = float(height[-1] - height[0])
                bound = lower_bound(at, math.hypot(10.0, 9.0), climb, math.tan(0.3))
                assert bound < route.energy_j
