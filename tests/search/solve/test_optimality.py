"""Routes against what can be worked out by hand, and against symmetries of the problem."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import Vehicle, load_vehicle
from planner.terrain.heightmap import Terrain
from planner.terrain.surface import GroundClass
from tests.search.maps import hills, terrain

G = 9.80665


def ideal_vehicle(**changes: float) -> Vehicle:
    """minibalance with some losses taken away; names as in its parameters, "slug.name"."""
    vehicle = load_vehicle("minibalance")
    values = {slug: dict(table) for slug, table in vehicle.parameters.items()}
    for name, value in changes.items():
        slug, parameter = name.split("__")
        values[slug][parameter] = value
    return replace(vehicle, parameters=values)


def plane(degrees: float, azimuth_degrees: float = 30.0, count: int = 100) -> Terrain:
    """A tilted plane of 25 m, uphill towards ``azimuth_degrees``."""
    x = 0.25 * np.arange(count)
    rise = math.tan(math.radians(degrees))
    a = math.radians(azimuth_degrees)
    return terrain(rise * (math.cos(a) * x[None, :] + math.sin(a) * x[:, None]))


def test_straight_on_a_plane_without_heading_cost():
    """Without roller drag, on the flat, nothing is cheaper than the straight line."""
    model = PowerModel.from_vehicle(ideal_vehicle(roller_drag__roller=0.0))
    answer = plan_route(
        terrain=plane(0.0),
        model=model,
        start={"x": 3, "y": 4},
        goal={"x": 19, "y": 12},
    )
    assert answer.routes[0].length_m == pytest.approx(math.hypot(16, 8), rel=1e-4)


def test_straight_up_a_tilted_plane():
    """On an even slope below all limits the cost per metre is the same everywhere: straight."""
    ground = plane(5.0)
    answer = plan_route(terrain=ground, start={"x": 4, "y": 4}, goal={"x": 18, "y": 12})
    route = answer.routes[0]
    rise = route.arrays["z"][-1] - route.arrays["z"][0]
    assert route.length_m == pytest.approx(math.hypot(14, 8, rise), rel=5e-3)


def test_carpet_is_gone_round_as_snell_says():
    """Two grounds with a straight border: the route breaks like light, n1·sin = n2·sin."""
    count, cell = 120, 0.25
    ground = np.zeros((count, count), np.uint8)
    ground[:, count // 2 :] = 1
    classes = (GroundClass("concrete"), GroundClass("carpet", rolling=4.0))
    field = terrain(np.zeros((count, count)), ground=ground, classes=classes)
    start, goal = (5.0, 5.0), (25.0, 25.0)
    answer = plan_route(
        terrain=field,
        start=dict(zip("xy", start, strict=True)),
        goal=dict(zip("xy", goal, strict=True)),
    )
    route = answer.routes[0]
    border = (count // 2 - 0.5) * cell
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    per_metre = [
        model.watts(rows_from(vx=1.2, rolling_factor=factor))[0] / 1.2 for factor in (1.0, 4.0)
    ]
    crossing = np.linspace(5.0, 25.0, 20001)
    one = np.hypot(border - start[0], crossing - start[1])
    two = np.hypot(goal[0] - border, goal[1] - crossing)
    best = float((per_metre[0] * one + per_metre[1] * two).min())
    straight = float(
        per_metre[0] * math.hypot(border - 5, (border - 5))
        + per_metre[1] * math.hypot(25 - border, 25 - border)
    )
    assert best < 0.98 * straight
    # Start and stop cost beside the even drive: half of it on each of the grounds.
    ramps = 0.0
    for factor, metre in zip((1.0, 4.0), per_metre, strict=True):
        flat = plan_route(
            terrain=terrain(np.zeros((80, 80)), classes=(GroundClass("one", rolling=factor),)),
            start={"x": 5.0, "y": 5.0},
            goal={"x": 14.0, "y": 5.0},
        ).routes[0]
        ramps += 0.5 * (flat.energy_j - 9.0 * metre)
    assert route.energy_j - ramps == pytest.approx(best, rel=5e-3)


def test_lossless_robot_takes_back_what_it_climbed():
    """Without losses and with full regeneration A→B and B→A differ by exactly 2·m·g·Δz."""
    model = PowerModel.from_vehicle(
        ideal_vehicle(
            electronics__power=0.0,
            wheel_rolling__rolling=0.0,
            roller_drag__roller=0.0,
            gear_loss__efficiency=1.0,
            copper_loss__resistance=1e-3,
            coulomb_drag__coulomb_torque=0.0,
        ),
        effects=[],
    )
    ground = plane(6.0)
    ends = {"x": 4, "y": 4}, {"x": 18, "y": 12}
    there, back = (
        plan_route(terrain=ground, model=model, start=a, goal=b).routes[0]
        for a, b in (ends, ends[::-1])
    )
    weight = 12.0 * G
    rise = there.arrays["z"][-1] - there.arrays["z"][0]
    assert there.energy_j - back.energy_j == pytest.approx(2.0 * weight * rise, rel=5e-3)
    assert there.energy_j == pytest.approx(weight * rise, rel=5e-3)


def test_with_losses_a_round_trip_costs():
    """A→B and back is positive, and the difference is at most what climbing exchanges, twice."""
    ground = terrain(hills())
    ends = {"x": 3, "y": 3}, {"x": 20, "y": 18}
    there, back = (
        plan_route(terrain=ground, start=a, goal=b).routes[0] for a, b in (ends, ends[::-1])
    )
    assert there.energy_j + back.energy_j > 0.0


def test_payload_costs_energy():
    """More payload, more energy, on every ground."""
    ground = terrain(hills())
    energies = [
        plan_route(
            terrain=ground,
            start={"x": 3, "y": 3},
            goal={"x": 20, "y": 18},
            payload={"mass": mass},
        )
        .routes[0]
        .energy_j
        for mass in (0.0, 1.5, 3.0)
    ]
    assert energies[0] < energies[1] < energies[2]


@pytest.mark.parametrize("change", ["rotated", "mirrored", "shifted"])
def test_symmetry(change):
    """Rotating by 90°, mirroring or shifting map and request leaves the energy as it is."""
    heights = hills()
    size = 0.25 * (len(heights) - 1)
    start, goal = (3.0, 4.0, 0.3), (20.0, 17.0, 1.2)
    if change == "rotated":
        # x' = size - y, y' = x
        other = terrain(np.ascontiguousarray(np.rot90(heights, k=-1)))
        moved = [(size - y, x, yaw + math.pi / 2) for x, y, yaw in (start, goal)]
    elif change == "mirrored":
        other = terrain(np.ascontiguousarray(heights[:, ::-1]))
        moved = [(size - x, y, math.pi - yaw) for x, y, yaw in (start, goal)]
    else:
        other = terrain(heights, origin=(500_000.0, -20.0))
        moved = [(x + 500_000.0, y - 20.0, yaw) for x, y, yaw in (start, goal)]
    energies = []
    for ground, (a, b) in ((terrain(heights), (start, goal)), (other, moved)):
        answer = plan_route(
            terrain=ground,
            start=dict(zip(("x", "y", "yaw"), a, strict=True)),
            goal=dict(zip(("x", "y", "yaw"), b, strict=True)),
        )
        energies.append(answer.routes[0].energy_j)
    assert energies[1] == pytest.approx(energies[0], rel=5e-3)


def test_bound_lies_below_and_baselines_above():
    """lower_bound ≤ energy ≤ both baselines, and the gap is a share of the dissipated energy."""
    answer = plan_route(
        terrain=terrain(hills(rms_degrees=8.0)),
        start={"x": 3, "y": 3},
        goal={"x": 20, "y": 18},
        iterations=500,
    )
    route = answer.routes[0]
    assert 0.0 < route.lower_bound_j < route.energy_j
    assert 0.0 < route.gap < 1.0
    for baseline in answer.baselines.values():
        assert baseline.energy_j >= route.energy_j * (1.0 - 1e-9)
    assert answer.baselines["shortest"].length_m <= route.length_m * 1.001
    assert answer.baselines["fastest"].duration_s <= route.duration_s * 1.005
