"""The cost of straight lines: sums, factors, walls and the slope limit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.field import CostField
from planner.search.field.cost_field import (
    passable,
    polyline_cost,
    segment_cost,
)
from planner.search.requests import SituationRequest
from planner.search.resolution import WIDTH
from planner.search.situation import situation_of
from planner.search.trajectory.yaw import core_of
from planner.terrain.footprint import body_fits, middle_fits
from planner.terrain.heightmap import Terrain
from planner.terrain.obstacles import rectangle_free
from tests.search.maps import hills

CELL = 0.25
AZIMUTHS = np.radians([0.0, 33.0, 90.0, 147.0, 180.0, 250.0])


def field_of(heights: np.ndarray, obstacles: np.ndarray | None = None) -> CostField:
    """Map and energy costs for heights (ny, nx) in m."""
    terrain = Terrain.from_arrays(heights, cell=(CELL, CELL), obstacles=obstacles)
    return situation_of(SituationRequest(map="here"), terrain=terrain).field("energy")


def plane(slope: float) -> np.ndarray:
    """24 m by 24 m that rise to the east."""
    return np.tile(slope * CELL * np.arange(96), (96, 1))


@pytest.fixture(scope="module")
def relief() -> CostField:
    """Hills of 24 m."""
    return field_of(hills())


def test_parts_of_a_line_add_up_to_the_whole(relief):
    rng = np.random.default_rng(1)
    for _ in range(20):
        a, b = rng.uniform(3.0, 21.0, (2, 2))
        middle = a + rng.uniform(0.2, 0.8) * (b - a)
        # Steps so short that it does not matter where the parts' points lie.
        step = 0.02
        whole = segment_cost(relief, *a, *b, step)
        parts = segment_cost(relief, *a, *middle, step) + segment_cost(relief, *middle, *b, step)
        assert math.isfinite(whole)
        assert parts == pytest.approx(whole, rel=2e-3)
        line = np.array([a, middle, b])
        assert polyline_cost(relief, line, step) == pytest.approx(parts, rel=1e-12)


def test_a_line_on_a_plane_costs_its_length(relief):
    field = field_of(plane(0.08))
    for azimuth in AZIMUTHS:
        towards = np.array([math.cos(azimuth), math.sin(azimuth)])
        once, thrice = (
            segment_cost(field, 12.0, 12.0, *(12.0 + length * towards), field.step)
            for length in (2.5, 7.5)
        )
        assert thrice == pytest.approx(3.0 * once, rel=1e-9)
    assert segment_cost(field, 12.0, 12.0, 12.0, 12.0, field.step) == 0.0


def test_ground_at_twice_the_cost_costs_twice(relief):
    dear = relief._replace(factor=np.full(relief.heights.shape, 2.0))
    line = (4.0, 5.0, 19.0, 13.0)
    once = segment_cost(relief, *line, relief.step)
    assert segment_cost(dear, *line, relief.step) == pytest.approx(2.0 * once, rel=1e-12)


def test_beyond_the_slope_limit_no_line_is_finite():
    # No wheel holds on 45°; 5° is a ramp that people push chairs up.
    gentle, steep = (field_of(plane(math.tan(math.radians(angle)))) for angle in (5.0, 45.0))
    for azimuth in AZIMUTHS:
        end = 12.0 + 5.0 * math.cos(azimuth), 12.0 + 5.0 * math.sin(azimuth)
        assert math.isfinite(segment_cost(gentle, 12.0, 12.0, *end, gentle.step))
        assert passable(gentle, 12.0, 12.0, azimuth)
        assert segment_cost(steep, 12.0, 12.0, *end, steep.step) == math.inf
        assert not passable(steep, 12.0, 12.0, azimuth)


def test_no_line_leads_through_a_wall():
    obstacles = np.zeros((96, 96), bool)
    obstacles[:, 48] = True
    field = field_of(np.zeros((96, 96)), obstacles)
    assert segment_cost(field, 8.0, 12.0, 16.0, 12.0, field.step) == math.inf
    assert not passable(field, 12.0, 12.0, 0.0)
    assert math.isfinite(segment_cost(field, 8.0, 4.0, 8.0, 20.0, field.step))


def test_where_the_middle_or_the_core_of_the_body_touches_no_yaw_fits():
    """They spare tests of the body, and so must never refuse where it fits."""
    rng = np.random.default_rng(5)
    field = field_of(np.zeros((40, 40)), rng.random((40, 40)) < 0.06)
    grid = field.blocked, field.x0, field.y0, field.dx, field.dy
    sides = core_of(field.half_length, field.half_width)
    fitting = refused = 0
    for _ in range(400):
        x, y = rng.uniform(1.0, 9.0, 2)
        yaws = rng.uniform(0.0, math.pi, 24)
        fits = [body_fits(field, x, y, yaw) for yaw in yaws]
        middle = middle_fits(field, x, y)
        assert middle or not any(fits)
        for yaw, fit in zip(yaws, fits, strict=True):
            turned = yaw + rng.uniform(-0.5, 0.5) * WIDTH
            core = rectangle_free(*grid, x, y, turned, *sides)
            assert core or not fit
            fitting, refused = fitting + fit, refused + (not core)
    assert fitting > 1000
    assert refused > 1000
