"""The bound against everything the power model can do: random states, and routes."""

from __future__ import annotations

import math

import numpy as np

from planner.power.model import PowerModel, rows_from
from planner.power.vehicle import load_vehicle
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.bound import floor_per_metre
from planner.search.conditions import circumstances
from planner.search.request import PlanRequest
from planner.search.steady import set_motion
from tests.search.maps import terrain


def test_no_state_undercuts_the_floor():
    """10,000 random motions within the limits: dissipation per horizontal metre above the floor."""
    rng = np.random.default_rng(11)
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    request = PlanRequest.from_json(
        {"map": "test", "start": {"x": 1, "y": 1}, "goal": {"x": 2, "y": 2}}
    )
    around = circumstances(request, model, terrain(np.zeros((8, 8))))
    steepest = math.tan(math.radians(23.0))
    floor = floor_per_metre(around, steepest)
    assert floor > 10.0  # 13.3 J/m by hand with even wheel loads, docs/physics.md
    count = 10_000
    rows = np.repeat(rows_from(vx=0.0), count, axis=0)
    speed = rng.uniform(0.02, 1.2, count)
    azimuth, yaw, direction = (rng.uniform(-math.pi, math.pi, count) for _ in range(3))
    steepness = np.tan(rng.uniform(0.0, math.radians(23.0), count))
    # A tenth of the motions along the body's axes and diagonals, where wheels stand still.
    special = rng.random(count) < 0.3
    yaw[special] = direction[special] + rng.integers(0, 8, special.sum()) * math.pi / 4
    stretch = np.empty(count)
    for k, row in enumerate(rows):
        slope = steepness[k] * math.cos(azimuth[k]), steepness[k] * math.sin(azimuth[k])
        stretch[k] = set_motion(row, *slope, yaw[k], direction[k], speed[k])
    rows[:, INDEX["wz"]] = rng.uniform(-1.0, 1.0, count) * (rng.random(count) < 0.5)
    climb = -(
        rows[:, INDEX["gravity_x"]] * rows[:, INDEX["vx"]]
        + rows[:, INDEX["gravity_y"]] * rows[:, INDEX["vy"]]
    )
    # Bus power: a source that takes nothing back only adds to the losses.
    dissipated = model.account(rows)["bus"] - 12.0 * climb
    assert (dissipated * stretch / speed).min() >= floor
    assert STANDARD_GRAVITY == 9.80665
