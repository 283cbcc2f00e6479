"""What both ends add, against the integral over a ramp by the model itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.power.motion_row import set_motion
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.search.certificate.ends import both_ends
from planner.search.certificate.mesh import mesh_of
from planner.search.certificate.steady_floor import steady_floor
from planner.search.conditions import OperatingConditions
from tests.search.certificate.robots import field_of, model_of
from tests.search.maps import terrain

SPEED = [INDEX["vx"], INDEX["vy"]]


def power(conditions: OperatingConditions, slope: float, azimuth: float, speed: float) -> float:
    """W of steady driving less what is stored, with the best of 720 yaws."""
    rows = np.repeat(conditions.class_rows[:1], 720, axis=0)
    along, across = slope * math.cos(azimuth), slope * math.sin(azimuth)
    for row, yaw in zip(rows, 2.0 * math.pi * np.arange(720) / 720, strict=True):
        stretch = set_motion(row, along, across, yaw, 0.0, 1.0)
    rows[:, SPEED] *= speed
    stored = conditions.mass * STANDARD_GRAVITY * along * speed / stretch
    return float(conditions.model.watts(rows).min()) - stored


@pytest.mark.parametrize("slope", [0.0, 0.12])
@pytest.mark.parametrize("distance", [0.5, 4.0])
def test_ends_add_no_more_than_the_slow_driving_that_they_ask_for(
    slope: float, distance: float
) -> None:
    plane = slope * 0.25 * np.arange(48)[None, :] + np.zeros((48, 1))
    field, conditions = field_of(terrain(plane), model_of("minibalance"))
    floor = steady_floor(conditions)
    assert floor is not None
    start, goal = (4.0, 5.0), (4.0 + distance, 5.0)
    found = both_ends(floor, mesh_of(field, floor.steepest, 1), conditions, start, goal)
    top, most = float(conditions.limits[0]), conditions.model.vehicle.limits.acceleration
    reached = min(top, math.sqrt(most * distance))
    speeds = reached * (np.arange(40) + 0.5) / 40
    added = []
    for azimuth in np.arange(12) * math.pi / 6:
        watts = np.array([power(conditions, slope, azimuth, v) for v in speeds])
        steady = power(conditions, slope, azimuth, top) / top
        added.append(2.0 * float((watts - speeds * steady).mean()) * reached / most)
    assert 0.6 * min(added) < found <= min(added)
