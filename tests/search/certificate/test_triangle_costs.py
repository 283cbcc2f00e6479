"""Costs of a triangle against the table that they come from, at slopes and directions between."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from planner.search.certificate.mesh import mesh_of
from planner.search.certificate.steady_floor import steady_floor
from planner.search.certificate.triangle_costs import TRAVEL_DIRECTIONS, triangle_costs
from tests.search.certificate.robots import field_of, model_of
from tests.search.certificate.test_steady_floor import looked_up
from tests.search.maps import hills, terrain

STEP = 2.0 * math.pi / TRAVEL_DIRECTIONS


def test_costs_are_below_the_table_at_every_slope_and_direction() -> None:
    """Also between two directions, where a slope that keeps to both costs is their mean."""
    field, conditions = field_of(terrain(hills(40, rms_degrees=7.0)), model_of("minibalance"))
    floor = steady_floor(conditions)
    assert floor is not None
    mesh = mesh_of(field, floor.steepest, 1)
    costs = triangle_costs(floor, mesh)
    rng = np.random.default_rng(6)
    checked = 0
    for _ in range(3000):
        j, i = (int(rng.integers(0, n)) for n in mesh.ranges.shape[:2])
        x0, x1, y0, y1 = mesh.ranges[j, i]
        px, py = rng.uniform(x0, x1), rng.uniform(y0, y1)
        k, w = int(rng.integers(0, TRAVEL_DIRECTIONS)), rng.random()
        angle = (k + w) * STEP
        c, s = math.cos(angle), math.sin(angle)
        if math.hypot(px, py) > floor.steepest or mesh.wall[j, i, 0]:
            continue
        first, second = costs[j, i, 0, k], costs[j, i, 0, (k + 1) % TRAVEL_DIRECTIONS]
        most = first * math.sin((1.0 - w) * STEP) + second * math.sin(w * STEP)
        assert most / math.sin(STEP) <= looked_up(floor, px * c + py * s, py * c - px * s) + 1e-9
        checked += 1
    assert checked > 2500


def test_a_plane_costs_what_the_table_says() -> None:
    """With one slope everywhere, only what lies between two directions is taken off."""
    slope = 0.1
    plane = slope * 0.25 * np.arange(24)[None, :] + np.zeros((24, 1))
    field, conditions = field_of(terrain(plane), model_of("minibalance"))
    floor = steady_floor(conditions)
    assert floor is not None
    costs = triangle_costs(floor, mesh_of(field, floor.steepest, 1))[10, 10, 0]
    for k, cost in enumerate(costs):
        angle = k * STEP
        known = looked_up(floor, slope * math.cos(angle), -slope * math.sin(angle))
        assert 0.97 * known < cost <= known


def test_wide_rectangles_of_slopes_cost_no_more_than_any_slope_in_them() -> None:
    """Steep, rough ground, whose rectangles are looked up in turned squares; on two classes."""
    heights = hills(24, rms_degrees=7.0) + 0.12 * np.random.default_rng(2).standard_normal((24, 24))
    field, conditions = field_of(terrain(heights), model_of("minibalance"))
    floor = steady_floor(conditions)
    assert floor is not None
    floor = replace(floor, least=np.concatenate([floor.least, 0.8 * floor.least]))
    mesh = mesh_of(field, floor.steepest, 1)
    rng = np.random.default_rng(7)
    classes = rng.integers(1, 4, mesh.classes.shape).astype(np.uint64)
    costs = triangle_costs(floor, replace(mesh, classes=classes))
    widths = np.diff(mesh.ranges.reshape(*mesh.ranges.shape[:2], 2, 2))[..., 0] / floor.step
    checked = 0
    for _ in range(6000):
        j, i = (int(rng.integers(0, n)) for n in mesh.ranges.shape[:2])
        x0, x1, y0, y1 = mesh.ranges[j, i]
        px, py = rng.uniform(x0, x1), rng.uniform(y0, y1)
        k = int(rng.integers(0, TRAVEL_DIRECTIONS))
        c, s = math.cos(k * STEP), math.sin(k * STEP)
        if math.hypot(px, py) > floor.steepest or mesh.wall[j, i, 0] or widths[j, i].max() < 8.0:
            continue
        least = looked_up(floor, px * c + py * s, py * c - px * s)
        assert costs[j, i, 0, k] <= (0.8 if classes[j, i] >= 2 else 1.0) * least + 1e-9
        checked += 1
    assert checked > 1000
