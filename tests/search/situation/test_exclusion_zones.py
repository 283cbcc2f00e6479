"""Areas to keep out of: no part of the body enters them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner import plan_route
from planner.errors import RequestError
from planner.power.vehicles import load_vehicle
from planner.terrain.heightmap import Terrain

WAY = {"start": {"x": 2.0, "y": 5.0}, "goal": {"x": 18.0, "y": 5.0}}


@pytest.fixture(scope="module")
def level() -> Terrain:
    """20 m by 10 m of level ground."""
    return Terrain.from_arrays(np.zeros((40, 80)), cell=(0.25, 0.25))


def nearest(route, x: float, y: float) -> float:
    """Least distance of the robot's centre from a point."""
    return float(np.hypot(route.arrays["x"] - x, route.arrays["y"] - y).min())


def test_a_circle_is_driven_round(level):
    straight = plan_route(terrain=level, **WAY).routes[0]
    assert nearest(straight, 10.0, 5.0) < 0.1
    conditions = plan_route(terrain=level, **WAY, avoid=[{"x": 10, "y": 5, "radius": 1.5}]).routes[
        0
    ]
    half_width = 0.5 * load_vehicle("minibalance").width
    assert nearest(conditions, 10.0, 5.0) > 1.5 + half_width
    # The shortest way round a circle, from and to 8 m off, with a little for cells and corners.
    reach = 1.5 + half_width
    shortest = 2.0 * (math.sqrt(64.0 - reach**2) + reach * (math.pi / 2 - math.acos(reach / 8.0)))
    assert shortest * 0.999 < conditions.length_m < shortest * 1.05
    assert conditions.energy_j > straight.energy_j


def test_a_polygon_across_every_path_leaves_none(level):
    bar = [[9.5, -1.0], [10.5, -1.0], [10.5, 11.0], [9.5, 11.0]]
    answer = plan_route(terrain=level, **WAY, avoid=[{"polygon": bar}])
    assert answer.status == "no_route"
    bar[2][1] = bar[3][1] = 7.0
    gap = plan_route(terrain=level, **WAY, avoid=[{"polygon": bar}]).routes[0]
    assert gap.arrays["y"].max() > 7.0


@pytest.mark.parametrize(
    ("area", "words"),
    [
        ({"x": 1.0}, "neither a circle"),
        ({"x": 1.0, "y": 1.0, "radius": 1.0, "polygon": [[1, 1], [2, 1], [1, 2]]}, "neither"),
        ({"polygon": [[1, 1], [2, 2]]}, "too few"),
        ({"x": 1.0, "y": 1.0, "radius": -1.0}, "too small"),
        ({"x": 500.0, "y": 1.0, "radius": 1.0}, "covers nothing"),
        ({"x": 2.0, "y": 5.0, "radius": 1.0}, "start"),
    ],
)
def test_what_is_no_area_is_refused(level, area, words):
    with pytest.raises(RequestError, match=words):
        plan_route(terrain=level, **WAY, avoid=[area])


@pytest.mark.parametrize(
    ("x", "words"),
    [(10.0, r"goal: in the area avoid\[1\]"), (11.2, r"goal: .* touches the area avoid\[1\]")],
)
def test_a_place_in_an_area_or_beside_it_is_refused_by_the_areas_number(level, x, words):
    areas = [{"x": 5.0, "y": 8.0, "radius": 0.5}, {"x": 10.0, "y": 5.0, "radius": 1.0}]
    asked = {"start": WAY["start"], "goal": {"x": x, "y": 5.0, "yaw": 0.0}}
    with pytest.raises(RequestError, match=words):
        plan_route(terrain=level, **asked, avoid=areas)
