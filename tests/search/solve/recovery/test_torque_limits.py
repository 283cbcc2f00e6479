"""Near the limits of torque: what is found there is the best of what the strategies lead to."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from planner import energy_time_front, plan_route
from planner.power.model import PowerModel
from planner.power.vehicles import load_vehicle
from planner.terrain.heightmap import Terrain

ALIKE = 3e-3
"""Share by which energies may differ where they ought not to: motions scatter by about as much."""


class Question(NamedTuple):
    """Smooth hills, and places on them.

    Attributes:
        seed: of the hills.
        cell: m.
        degrees: mean slope.
        grains: cells, of the finer and the coarser hills.
        start, goal: x and y, m.
        torques: N·m of continuous torque, both of which leave a route.
    """

    seed: int
    cell: float
    degrees: float
    grains: tuple[float, float]
    start: tuple[float, float]
    goal: tuple[float, float]
    torques: tuple[float, float]

    @property
    def fields(self) -> dict[str, Any]:
        """What to ask, but for the vehicle."""
        (x, y), (to_x, to_y) = self.start, self.goal
        return {"terrain": self.hills, "start": {"x": x, "y": y}, "goal": {"x": to_x, "y": to_y}}

    @property
    def hills(self) -> Terrain:
        random, shape = np.random.default_rng(self.seed), (120, 160)
        heights = np.zeros(shape)
        for grain, share in zip(self.grains, (1.0, 2.0), strict=True):
            noise = gaussian_filter(random.standard_normal(shape), grain)
            heights += share * noise / noise.std()
        slope = np.hypot(*np.gradient(heights, self.cell)).mean()
        heights *= math.tan(math.radians(self.degrees)) / slope
        return Terrain.from_arrays(heights, cell=(self.cell, self.cell), name="hills")


PEAK = Question(
    *(0, 0.3, 7.4154, (7.0, 14.0), (36.96, 9.765), (10.536, 33.4)), torques=(0.013, 0.01378)
)
"""Half a minute long: the peak decides."""
MEAN = Question(
    *(100, 1.0, 5.1157, (6.0, 18.0), (112.25, 6.51), (38.2, 65.15)), torques=(0.009276, 0.009973)
)
"""Longer than the thermal time: the mean decides, and routes rest."""


def model(torque: float) -> PowerModel:
    """The built-in robot with another continuous torque, and twice of it as peak."""
    vehicle = load_vehicle("minibalance")
    limits = replace(vehicle.limits, continuous_torque=torque, peak_torque=2.0 * torque)
    return PowerModel.from_vehicle(replace(vehicle, limits=limits))


@cache
def energy(asked: Question, torque: float) -> float:
    (route,) = plan_route(model=model(torque), **asked.fields).routes
    return route.energy_j


@pytest.mark.parametrize("asked", [PEAK, MEAN])
def test_stronger_motors_never_take_more(asked: Question) -> None:
    """Whatever the weaker robot drives, the stronger one may drive as well."""
    weak, strong = (energy(asked, torque) for torque in asked.torques)
    assert strong <= (1.0 + ALIKE) * weak


def test_ends_of_the_front_are_the_answers_and_a_deadline_finds_them() -> None:
    strong = model(MEAN.torques[1])
    front = energy_time_front(model=strong, points=2, **MEAN.fields)
    quickest, frugal = front.points[0].route, front.points[-1].route
    least = energy(MEAN, MEAN.torques[1])
    # A front looks for quick paths with more patience than an answer does for its baselines.
    assert frugal.energy_j == pytest.approx(least, rel=0.01)
    late = (1.0 + ALIKE) * quickest.duration_s
    timely = plan_route(model=strong, max_duration_s=late, **MEAN.fields)
    assert timely.status == "ok"
    assert timely.routes[0].duration_s <= late
